//! `zerkalo info`: prints the origin of a picture, film or plan file, and compares it with a scene.

use crate::command::args::InfoArgs;
use crate::command::{Failure, print_json, print_line, read_scene};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use zerkalo_render::SampleInputs;
use zerkalo_render::export::{noise_of_text, scene_hash, settings_text};
use zerkalo_render::image_file::FileMetadata;
use zerkalo_render::plan::{Part, Plan, PlanHead, is_plan_file};
use zerkalo_scene::value::sanitized;

pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let mut origin = match is_plan_file(&args.file) {
        true => of_plan(&Plan::read(&args.file)?),
        false => FileMetadata::read(&args.file)?,
    };
    if let Some(film) = &origin.film {
        origin.entries.push(("Light groups".to_string(), film.group_names.join(", ")));
        if let Some(part) = Part::of_header(&args.file, film)? {
            origin.entries.push(("Rays".to_string(), part.rays.to_string()));
            origin.entries.push(("Plan".to_string(), target(&part.plan)));
        }
    }
    if args.json.json {
        return print_json(&results(&origin, &args.file)).and_then(|()| match &args.scene {
            Some(path) => compare(&origin, path, args).map(drop),
            None => Ok(()),
        });
    }
    let [width, height] = origin.size;
    let (path, format) = (args.file.display(), origin.format);
    print_line(&format!("{path}: {format}, {width} x {height} pixels"))?;
    // The texts of a file must not look like further lines.
    let entries = origin.entries.iter().map(|(key, value)| [sanitized(key), sanitized(value)]);
    let entries: Vec<_> = entries.collect();
    let widest = entries.iter().map(|[key, _]| key.len()).max().unwrap_or(0);
    for [key, value] in entries {
        print_line(&format!("  {key:widest$}  {value}"))?;
    }
    match &args.scene {
        Some(path) => print_line(&compare(&origin, path, args)?),
        None => Ok(()),
    }
}

/// Returns the results of `--json`. docs/command-line.md describes the keys.
fn results(origin: &FileMetadata, file: &Path) -> Value {
    let noise = origin.get("Noise").and_then(noise_of_text);
    json!({
        "file": file.display().to_string(),
        "format": origin.format,
        "size": origin.size,
        "noise_levels": noise.map(|noise| noise.levels),
        "rmse_linear": noise.map(|noise| noise.linear),
        "metadata": origin.entries.iter().cloned().collect::<BTreeMap<_, _>>(),
    })
}

/// Returns the description of a plan, in the form of a file's metadata.
fn of_plan(plan: &Plan) -> FileMetadata {
    let settings = &plan.settings;
    let base = settings.base_plan.map_or("none".to_string(), |plan| format!("plan {plan:016x}"));
    let (base_rays, total) = (settings.base_rays as f64, settings.total_rays);
    let rays = format!(
        "{:.3e} in this round, {base_rays:.3e} before, {total:.3e} in all rounds",
        plan.rays()
    );
    let sampler = settings.sampler.name();
    let method = settings_text(sampler, settings.precision, true, &settings.display);
    let entries = [
        ("Source", settings.source.clone()),
        ("Scene hash", settings.scene_hash.clone()),
        ("Seed", settings.seed.to_string()),
        ("Settings", method),
        ("Plan", target(&plan.head())),
        ("Base", base),
        ("Expected rays", rays),
        ("Checksum", format!("{:016x}", plan.checksum())),
    ];
    let entries = entries.map(|(key, value)| (key.to_string(), value)).to_vec();
    FileMetadata { format: "plan", size: settings.size.map(|n| n as usize), entries, film: None }
}

/// Formats shards, samples per pixel, noise target and expected noise of a plan.
fn target(plan: &PlanHead) -> String {
    let settings = &plan.settings;
    format!(
        "round {}, {} shards, {:.2} samples per pixel, target {} 8-bit levels of noise, expected {:.3}",
        settings.round,
        settings.shards,
        plan.spp(),
        settings.noise_levels,
        plan.predicted_levels
    )
}

/// Compares `origin` with the scene file at `path`. Returns the result if they agree.
///
/// # Errors
/// Fails if the file of `origin` shows another scene, or has no scene hash.
fn compare(origin: &FileMetadata, path: &Path, args: &InfoArgs) -> Result<String, Failure> {
    let document = read_scene(path)?;
    let scene = document.scene();
    let [file, shown] = [&args.file, path].map(|path| path.display());
    let Some(hash) = origin.get("Scene hash") else {
        let what = format!("{file} has no scene hash; zerkalo did not write it");
        return Err(Failure::Failed(what));
    };
    if hash == scene_hash(document.text(), scene) {
        return Ok(format!("scene: {shown} and the files that it names are those of {file}"));
    }
    // `render --size` overrides the size in the scene file.
    let mut sized = scene.clone();
    sized.film.size = origin.size.map(|n| n as u32);
    match origin.film.as_ref().and_then(SampleInputs::of).map(|inputs| inputs.fit(&sized)) {
        Some(true) => Ok(format!(
            "scene: the pictures of {shown} and {file} differ in light weights, names or layout of \
             the text only; --resume keeps the samples"
        )),
        _ => Err(Failure::Failed(format!("{file} shows another scene than {shown} describes"))),
    }
}
