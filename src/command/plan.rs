//! `zerkalo plan`: divides a render among shards.

use crate::command::args::PlanArgs;
use crate::command::part_file::{self, FilmOutput};
use crate::command::progress::style;
use crate::command::{
    Failure, is_quiet, print_json, print_line, read_scene_and_warn, warn_of_precision,
};
use indicatif::{ProgressBar, ProgressDrawTarget};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_kernel::sampling::SampleSettings;
use zerkalo_render::export::scene_hash;
use zerkalo_render::film::file::{FilmReader, SavedFilm};
use zerkalo_render::film::{Estimator, Noise};
use zerkalo_render::plan::{BASE, Part, PartShard, Plan, PlanSettings};
use zerkalo_render::schedule::{Settings, Stop, USUAL_SLOPE};
use zerkalo_render::{Options, SyncRender};
use zerkalo_scene::disk;

/// Noise at which the pilot ends by default, divided by the noise target. With a ratio of 2, the
/// pilot traces a third to a half of all rays, and the final noise differs from the target by at
/// most 10 %.
const PILOT: f64 = 2.0;

pub fn run(args: &PlanArgs) -> Result<(), Failure> {
    args.clobber.check_writable(&args.output)?;
    let plan = match (&args.from, &args.scene) {
        (Some(film), _) => next_round(args, film)?,
        (None, Some(scene)) => by_pilot(args, scene)?,
        (None, None) => return Err(Failure::Usage("name a scene or --from FILE.zk".into())),
    };
    disk::write(&args.output, plan.text().as_bytes())?;
    let rays: Vec<f64> = (BASE..=plan.settings.shards).map(|shard| plan.rays(shard)).collect();
    let (base, shards) = rays.split_at(1);
    let most = shards.iter().copied().fold(0.0, f64::max);
    let total: f64 = rays.iter().sum();
    if args.json.json {
        return print_json(&json!({
            "plan": args.output.display().to_string(),
            "shards": plan.settings.shards,
            "spp": plan.spp(),
            "noise_levels": plan.predicted_levels,
            "rays": total,
            "base_rays": base[0],
            "largest_shard_rays": most,
        }));
    }
    print_line(&format!(
        "{}  {} shards  {:.0} spp  expected noise {:.3} 8-bit levels",
        args.output.display(),
        plan.settings.shards,
        plan.spp(),
        plan.predicted_levels
    ))?;
    print_line(&format!(
        "expected rays: {total:.3e}; base {:.1} %, largest shard {:.2} %",
        100.0 * base[0] / total,
        100.0 * most / total
    ))
}

/// Renders the pilot, an adaptive render to a coarser noise, and plans the remaining samples.
fn by_pilot(args: &PlanArgs, path: &Path) -> Result<Plan, Failure> {
    let pilot_noise = args.pilot.unwrap_or(PILOT * args.noise);
    if pilot_noise < args.noise {
        return Err(Failure::Usage(format!(
            "--pilot {pilot_noise} is below --noise {}: a pilot ends before the target",
            args.noise
        )));
    }
    let base_file = args.base.clone().unwrap_or_else(|| default_base(&args.output));
    args.clobber.check_writable(&base_file)?;
    let document = read_scene_and_warn(path)?;
    let mut scene = document.scene().clone();
    args.picture.resize(&mut scene).map_err(Failure::Usage)?;
    let sampling = SampleSettings { seed: args.compute.seed, kind: args.sampler };
    let options = Options::new(args.precision.precision, sampling, args.picture.display(&scene));
    warn_of_precision(&scene, &options.world);
    let threads = args.compute.threads();
    let mut pilot = SyncRender::new(&scene, &options, settings(pilot_noise), threads)?;
    trace(&mut pilot, pilot_noise);
    let state = &pilot.state;
    let settings = PlanSettings {
        source: path.display().to_string(),
        scene_hash: scene_hash(document.text(), document.scene()),
        size: scene.film.size,
        seed: args.compute.seed,
        sampler: args.sampler,
        precision: state.world.info().precision,
        display: args.picture.display(&scene),
        rays_per_pixel: scene.film.rays_per_pixel,
        noise_levels: args.noise,
        shards: args.shards,
        base_plan: None,
    };
    let mut schedule = pilot.schedule.clone();
    schedule.settings.stop.noise_levels = Some(args.noise);
    let plan = Plan::of_schedule(&schedule, [USUAL_SLOPE; 2], settings)
        .ok_or("the pilot has no estimate of its noise")?;
    let part = Part {
        plan: Arc::new(plan),
        shards: vec![PartShard { number: BASE, complete: true }],
        rays: schedule.rays,
    };
    let report = part_file::write(
        &FilmOutput::Film(base_file.clone(), args.clobber.existing()),
        state,
        &part,
    )?
    .report;
    announce(
        args,
        &format!(
            "{}  {}  {} rays  {:.2} s  (pilot, the base of the plan)",
            base_file.display(),
            part_file::summary(&report),
            schedule.rays,
            pilot.seconds
        ),
    )?;
    Ok(Arc::unwrap_or_clone(part.plan))
}

/// Prints a line about the base of the plan.
fn announce(args: &PlanArgs, line: &str) -> Result<(), Failure> {
    if args.json.json { Ok(()) } else { print_line(line) }
}

/// Traces the pilot until it ends, and shows its noise.
fn trace(pilot: &mut SyncRender, target: f64) {
    let bar = ProgressBar::new_spinner();
    if is_quiet() {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    let bar = bar.with_style(style("{spinner} {msg}  {elapsed}"));
    while pilot.step().is_none() {
        if let Some(noise) = pilot.noise_levels() {
            bar.set_message(format!("pilot: noise {noise:.2} of {target} 8-bit levels"));
        }
        bar.tick();
    }
    bar.finish_and_clear();
}

/// Plans the samples that the merged film at `path` lacks.
fn next_round(args: &PlanArgs, path: &Path) -> Result<Plan, Failure> {
    let failed =
        |reason: &str| Failure::Failed(format!("cannot plan from {}: {reason}", path.display()));
    let reader = FilmReader::open(path)?;
    let part = Part::of_header(path, &reader.header)?;
    let part = part.ok_or_else(|| {
        failed("it belongs to no plan; name a film that `zerkalo merge` has written")
    })?;
    if part.missing().is_some() {
        return Err(failed("it lacks shards of its plan; merge all of them first"));
    }
    let SavedFilm { header, film } = reader.read()?;
    let estimator = Estimator::new(&film.header.scales, &header.weights, &header.display);
    let cap = part.plan.settings.rays_per_pixel;
    let schedule_settings = Settings { rays_per_pixel: cap, ..settings(args.noise) };
    let schedule = part.plan.schedule(&film, &estimator, schedule_settings);
    let schedule = schedule.ok_or_else(|| failed("it has no estimate of its noise"))?;
    announce(
        args,
        &format!(
            "{}  noise {:.3} 8-bit levels (the base of the plan)",
            path.display(),
            schedule.noise.map_or(0.0, |noise: Noise| noise.rmse.levels)
        ),
    )?;
    let settings = PlanSettings {
        noise_levels: args.noise,
        shards: args.shards,
        base_plan: Some(part.plan.checksum()),
        ..part.plan.settings.clone()
    };
    Plan::of_schedule(&schedule, part.plan.slopes, settings)
        .ok_or_else(|| failed("it has no estimate of its noise"))
}

/// Returns the default path of the pilot's film: `job-0.zk` for the plan `job.plan`.
fn default_base(plan: &Path) -> PathBuf {
    let mut name = plan.file_stem().unwrap_or_default().to_os_string();
    name.push("-0.zk");
    plan.with_file_name(name)
}

fn settings(noise_levels: f64) -> Settings {
    Settings::until(Stop { noise_levels: Some(noise_levels), ..Stop::default() })
}
