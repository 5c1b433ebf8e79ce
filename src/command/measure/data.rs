//! Results of `zerkalo measure` as JSON and CSV. Scripts rely on the keys.

use crate::command::measure::table::MeasureReport;
use crate::measure::{Measured, Measurement, Variant, median, spread};
use serde::Serialize;
use serde_json::{Value, json};

/// Point of an error curve. Its fields are columns of the CSV file and keys of the JSON file.
#[derive(Serialize)]
struct Point {
    samples: u64,
    spp: f64,
    seconds: f64,
    seconds_spread: f64,
    estimated_levels: Option<f64>,
    rmse_levels: f64,
    rmse_levels_spread: f64,
    rmse_linear: f64,
    /// Null if it was not measured or has no bound, as `cut_paths_levels`.
    rounding_levels: Option<f64>,
    cut_paths_levels: Option<f64>,
}

/// First columns of a line of CSV, before the fields of [`Point`].
#[derive(Serialize)]
struct FirstColumns<'a> {
    setting: &'static str,
    name: &'a str,
    threads: usize,
}

fn points(measured: &Measured) -> impl Iterator<Item = Point> {
    measured.points.iter().map(|p| Point {
        samples: p.samples,
        spp: p.spp,
        seconds: median(&p.seconds),
        seconds_spread: spread(&p.seconds),
        estimated_levels: p.estimated_levels,
        rmse_levels: p.errors.rmse_levels,
        rmse_levels_spread: p.errors.spread,
        rmse_linear: p.errors.rmse_linear,
        rounding_levels: p.parts.as_ref().and_then(|parts| parts.rounding),
        cut_paths_levels: p
            .parts
            .as_ref()
            .and_then(|parts| parts.cut_paths)
            .filter(|levels| levels.is_finite()),
    })
}

fn variation(measured: &Measured, targets: &[f64]) -> Value {
    let (speed, slope) = (measured.samples_per_second(), measured.slope());
    let Variant { experiment, name, threads, .. } = &measured.variant;
    let crossings = targets.iter().filter_map(|levels| measured.time_to(*levels));
    json!({
        "setting": experiment.name,
        "name": name,
        "threads": threads,
        "samples_per_second": speed.map(|s| s.value),
        "samples_per_second_spread": speed.map(|s| s.spread),
        "slope": slope.map(|s| s.value),
        "slope_standard_error": slope.map(|s| s.standard_error),
        // Null for unbiased settings. Also null if both pictures are without noise: the z-score is
        // then infinite, which JSON cannot represent.
        "bias_z": measured.bias.map(|b| b.z),
        "bias_levels": measured.bias.map(|b| b.levels),
        // Smallest bias that can be distinguished from noise.
        "bias_least_levels": measured.bias.map(|b| b.least_levels),
        "crossings": crossings.collect::<Vec<_>>(),
        "points": points(measured).collect::<Vec<_>>(),
    })
}

pub fn json(report: &MeasureReport) -> String {
    let m = report.measurement;
    let document = json!({
        "scene": report.scene.display().to_string(),
        "version": env!("CARGO_PKG_VERSION"),
        "machine": report.machine(),
        "size": m.size,
        "lanes": m.lanes,
        "threads": m.default().variant.threads,
        "reference_spp": m.reference.spp,
        "reference_levels": m.reference.noise_levels(),
        "reference_linear": m.reference.noise_linear(),
        "reference_seconds": m.reference.seconds,
        "compared_at_levels": m.compared_at,
        // Largest relative uncertainty that the noise of the reference causes in a measured error.
        "errors_spread": m.reference_uncertainty(),
        // Noise targets that were not reached, with ranges of extrapolated times.
        "expected": m.expected,
        "variations": m.measured.iter().map(|v| variation(v, &m.targets)).collect::<Vec<_>>(),
    });
    format!("{document:#}\n")
}

/// Serialises the points of all error curves, one line per point.
pub fn csv(measurement: &Measurement) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for measured in &measurement.measured {
        let Variant { experiment, name, threads, .. } = &measured.variant;
        for point in points(measured) {
            let first = FirstColumns { setting: experiment.name, name, threads: *threads };
            writer.serialize((first, point)).expect("a vector takes everything");
        }
    }
    writer.into_inner().expect("a vector takes everything")
}
