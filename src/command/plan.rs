//! `zerkalo plan`: divides a render among shards.

use crate::command::args::PlanArgs;
use crate::command::work::describe;
use crate::command::{Failure, print_json, print_line, read_scene_and_warn, warn_of_precision};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_kernel::sampling::SampleSettings;
use zerkalo_render::export::scene_hash;
use zerkalo_render::plan::{Job, Plan, PlanSettings};
use zerkalo_render::{Options, RenderState};
use zerkalo_scene::disk;

pub fn run(args: &PlanArgs) -> Result<(), Failure> {
    let (path, plan) = match (&args.from, &args.scene, &args.output) {
        (Some(job), ..) => next_round(args, job)?,
        (None, Some(scene), Some(output)) => (output.clone(), first_round(args, scene)?),
        (None, ..) => {
            return Err(Failure::Usage("name a scene and --output, or --from PLAN".into()));
        }
    };
    args.clobber.check_writable(&path)?;
    disk::write(&path, plan.text().as_bytes())?;
    if !args.json.json {
        return print_line(&describe(&path, &plan));
    }
    let settings = &plan.settings;
    print_json(&json!({
        "plan": path.display().to_string(),
        "round": settings.round,
        "shards": settings.shards,
        "spp": plan.head().spp(),
        // Null in the first round, before there is an estimate.
        "noise_levels": Some(plan.predicted_levels).filter(|levels| *levels > 0.0),
        "rays": plan.rays(),
        "base_rays": settings.base_rays,
        "total_rays": Some(settings.total_rays).filter(|rays| *rays > 0.0),
    }))
}

/// Plans the first round, which needs no samples.
fn first_round(args: &PlanArgs, path: &Path) -> Result<Plan, Failure> {
    let document = read_scene_and_warn(path)?;
    let mut scene = document.scene().clone();
    args.picture.resize(&mut scene).map_err(Failure::Usage)?;
    let sampling = SampleSettings { seed: args.seed, kind: args.sampler };
    let options = Options::new(args.precision.precision, sampling, args.picture.display(&scene));
    warn_of_precision(&scene, &options.world);
    let size = scene.film.size;
    let rays_per_pixel = scene.film.rays_per_pixel;
    let state = RenderState::without_film(&Arc::new(scene), &options)?;
    let info = state.world.info();
    let settings = PlanSettings {
        source: path.display().to_string(),
        scene_hash: scene_hash(document.text(), document.scene()),
        size,
        seed: args.seed,
        sampler: args.sampler,
        precision: info.precision,
        display: options.display,
        rays_per_pixel,
        noise_levels: args.noise,
        shards: args.shards.unwrap_or(1),
        round: 1,
        base_plan: None,
        base_rays: 0,
        total_rays: 0.0,
    };
    Ok(Plan::first(settings, info.light_period))
}

/// Plans a further round of the complete job at `path`. Returns the path of the new plan, too.
fn next_round(args: &PlanArgs, path: &Path) -> Result<(PathBuf, Plan), Failure> {
    let job = Job::open(path)?;
    let mut plan = job.next_plan(args.noise)?.ok_or_else(|| {
        let noise = args.noise;
        format!("{} meets the noise {noise} already, or cannot get nearer", job.path.display())
    })?;
    plan.settings.shards = args.shards.unwrap_or(plan.settings.shards);
    Ok((job.next_path(), plan))
}
