//! `zerkalo measure`: measures the cost of accuracy on a scene.

mod data;
mod table;

use crate::command::args::MeasureArgs;
use crate::command::progress::style;
use crate::command::{
    Failure, IS_INTERRUPTIBLE, cancel_on_signals, print_line, read_scene_and_warn,
};
use crate::measure::{self, EXPERIMENTS, Plan, Reference};
use indicatif::ProgressBar;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use zerkalo_render::film::Display;
use zerkalo_render::image_file;
use zerkalo_scene::disk::{self, check_writable};

/// Names of the experiments that run if neither `--only` nor `--full` is given.
const SHORT: [&str; 3] = ["adaptivity", "precision", "threads"];

pub fn run(args: &MeasureArgs) -> Result<(), Failure> {
    [&args.json, &args.csv, &args.plot]
        .into_iter()
        .flatten()
        .try_for_each(|p| check_writable(p))?;
    let document = read_scene_and_warn(&args.scene)?;
    let mut scene = document.scene().clone();
    args.picture.resize(&mut scene).map_err(Failure::Usage)?;
    let reference = args.reference.as_ref();
    let display = args.picture.display(&scene);
    let reference = reference.map(|path| given_reference(path, scene.film.size, &display));
    let reference = reference.transpose()?;
    let plan = plan(args, display);
    let signals = cancel_on_signals(Arc::clone(&plan.cancel))?;
    IS_INTERRUPTIBLE.store(true, Ordering::Release);
    let bar = ProgressBar::new(1).with_style(style("measuring {bar:30} {msg}"));
    let measurement =
        measure::measure(&Arc::new(scene), &plan, reference, &mut |step, done, total| {
            bar.set_length(total as u64);
            bar.set_position(done as u64);
            bar.set_message(step.to_string());
            // There are no results before the curve of the default settings, the second step.
            IS_INTERRUPTIBLE.store(done < 2, Ordering::Release);
            signals.caught().is_none()
        })?;
    IS_INTERRUPTIBLE.store(false, Ordering::Release);
    bar.finish_and_clear();

    let report = table::MeasureReport { scene: &args.scene, measurement: &measurement };
    let printed = print_line(&report.to_string());
    if let Some(path) = &args.json {
        disk::write(path, data::json(&report).as_bytes())?;
    }
    if let Some(path) = &args.csv {
        disk::write(path, &data::csv(&measurement))?;
    }
    if let Some(path) = &args.plot {
        let drawn = measure::plot::svg(&measurement, &report.title());
        let svg = drawn.map_err(|error| format!("cannot draw: {error}"))?;
        disk::write(path, svg.as_bytes())?;
    }
    printed?;
    match signals.caught() {
        Some(status) => Err(Failure::Signalled(status)),
        None => Ok(()),
    }
}

fn plan(args: &MeasureArgs, display: Display) -> Plan {
    let all = EXPERIMENTS.iter();
    let experiments = match &args.only[..] {
        [] => all.filter(|e| args.full || SHORT.contains(&e.name)).collect(),
        only => only.to_vec(),
    };
    let seconds = args.seconds.unwrap_or(if args.full { 300.0 } else { 50.0 });
    let mut targets = args.noise.clone();
    targets.sort_by(|a, b| b.total_cmp(a));
    Plan {
        targets,
        experiments,
        repetitions: usize::from(args.repetitions),
        seconds,
        threads: args.compute.threads(),
        seed: args.compute.seed,
        display,
        cancel: Arc::default(),
    }
}

/// Reads the reference picture, an EXR file of the given size.
fn given_reference(path: &Path, size: [u32; 2], display: &Display) -> Result<Reference, Failure> {
    let failed = |reason: String| Failure::Failed(format!("{}: {reason}", path.display()));
    let read = image_file::read_exr(path).map_err(failed)?;
    let [width, height] = read.size;
    if read.size != size.map(|n| n as usize) {
        return Err(failed(format!(
            "the reference is {width} x {height} pixels, the scene {} x {}; expected the same, \
             such as by --size {width}x{height}",
            size[0], size[1]
        )));
    }
    Ok(match &read.replicates {
        Some([a, b]) => Reference::of_replicates(a, b, display),
        None => Reference::of_pixels(read.pixels, display),
    })
}
