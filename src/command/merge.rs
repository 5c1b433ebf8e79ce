//! `zerkalo merge`: adds the films of the shards of a plan.

use crate::command::args::MergeArgs;
use crate::command::part_file::{self, FilmOutput};
use crate::command::{Failure, on_signal, print_json, print_line, save};
use serde_json::json;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use zerkalo_render::export::update_metadata;
use zerkalo_render::plan::Merged;
use zerkalo_render::session::Report;

pub fn run(args: &MergeArgs) -> Result<(), Failure> {
    let output = FilmOutput::new(&args.output, args.bits, args.clobber.existing())?;
    // A signal ends the command at once, but a write that has begun is finished.
    let is_writing = Arc::new(AtomicBool::new(false));
    let writes = Arc::clone(&is_writing);
    on_signal(move |status| {
        if !writes.load(Ordering::Acquire) {
            std::process::exit(status.into());
        }
    })?;
    let mut merged = Merged::of_files(&args.parts, args.partial)?;
    let report = Report::of_film(&merged.film, &merged.header.weights, &merged.header.display);
    update_metadata(&mut merged.header, &report);
    is_writing.store(true, Ordering::Release);
    save::persist(|| output.write(&merged.film, &merged.header))?;
    let plan = &merged.part.plan;
    let path = args.output.display();
    if args.json.json {
        return print_json(&json!({
            "output": path.to_string(),
            "spp_min": report.spp.min,
            "spp_mean": report.spp.mean,
            "spp_max": report.spp.max,
            "noise_levels": report.noise.map(|noise| noise.rmse.levels),
            "rmse_linear": report.noise.map(|noise| noise.rmse.linear),
            "rays": merged.part.rays,
            "missing": merged.part.missing(),
        }));
    }
    print_line(&format!("{path}  {}  {} rays", part_file::summary(&report), merged.part.rays))?;
    if let Some(missing) = merged.part.missing() {
        print_line(&format!(
            "missing of {} shards: {missing}; {}",
            plan.settings.shards,
            cost(&report, plan.predicted_levels)
        ))?;
    } else if let Some(noise) = report.noise
        && noise.rmse.levels > plan.settings.noise_levels
    {
        print_line(&format!(
            "the noise is {:.1} % above the target of {}: merge to a .zk file, and plan another \
             round by `zerkalo plan --from`",
            100.0 * (noise.rmse.levels / plan.settings.noise_levels - 1.0),
            plan.settings.noise_levels
        ))?;
    }
    Ok(())
}

/// Formats the noise of the merged picture, which lacks shards, and the noise predicted for all
/// shards.
fn cost(report: &Report, predicted_levels: f64) -> String {
    match report.noise {
        Some(noise) => format!(
            "noise {:.3} instead of about {predicted_levels:.3} 8-bit levels",
            noise.rmse.levels
        ),
        None => "noise unknown, because some tiles have no samples".to_string(),
    }
}
