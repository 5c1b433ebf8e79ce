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
    let (film, header) = (&merged.film, &merged.header);
    let mut report = Report::of_film(film, &header.weights, &header.display);
    if args.partial {
        report.noise = film.noise_of_sampled(&header.weights, &header.display);
    }
    update_metadata(&mut merged.header, &report);
    is_writing.store(true, Ordering::Release);
    save::persist(|| output.write(&merged.film, &merged.header))?;
    let plan = &merged.part.plan;
    let rays = plan.settings.base_rays + merged.part.rays;
    let path = args.output.display();
    if args.json.json {
        return print_json(&json!({
            "output": path.to_string(),
            "spp_min": report.spp.min,
            "spp_mean": report.spp.mean,
            "spp_max": report.spp.max,
            "noise_levels": report.noise.map(|noise| noise.rmse.levels),
            "rmse_linear": report.noise.map(|noise| noise.rmse.linear),
            "rays": rays,
            "missing": merged.part.missing(),
        }));
    }
    print_line(&format!("{path}  {}  {rays} rays", part_file::summary(&report)))?;
    if let Some(missing) = merged.part.missing() {
        print_line(&format!(
            "missing of {} shards: {missing}; {}",
            plan.settings.shards,
            cost(&report, &merged)
        ))?;
    }
    Ok(())
}

/// Formats the noise of the merged picture, which lacks shards, without its empty tiles.
fn cost(report: &Report, merged: &Merged) -> String {
    let film = &merged.film;
    let empty = (0..film.tile_count()).filter(|tile| film.counts(*tile) == [0; 2]).count();
    let noise = report.noise.map_or("unknown noise".to_string(), |noise| {
        format!("noise {:.3} 8-bit levels", noise.rmse.levels)
    });
    match empty {
        0 => noise,
        empty => format!("{noise} without {empty} of {} tiles, which are black", film.tile_count()),
    }
}
