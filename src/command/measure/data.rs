//! Results of `zerkalo measure` as JSON and CSV. Scripts rely on the keys.

use crate::command::measure::table::MeasureReport;
use crate::measure::{Expected, Measured, Measurement, TimeToTarget, median, spread};
use serde::Serialize;

#[derive(Serialize)]
struct Document<'a> {
    scene: String,
    version: &'static str,
    machine: String,
    size: [u32; 2],
    lanes: &'static str,
    threads: usize,
    reference_spp: f64,
    reference_levels: f64,
    reference_linear: f64,
    reference_seconds: f64,
    compared_at_levels: f64,
    /// Largest relative uncertainty of a measured error by the noise of the reference.
    errors_spread: f64,
    /// Largest relative spread of a time over the repetitions of its render.
    times_spread: f64,
    /// Largest fraction of the processors' time that other programs used. Null if unknown.
    taken_by_others: Option<f64>,
    /// Noise targets that were not reached, with ranges of extrapolated times.
    expected: &'a [Expected],
    variations: Vec<Variation<'a>>,
}

#[derive(Serialize)]
struct Variation<'a> {
    setting: &'static str,
    name: &'a str,
    threads: usize,
    samples_per_second: Option<f64>,
    samples_per_second_spread: Option<f64>,
    slope: Option<f64>,
    slope_standard_error: Option<f64>,
    /// 1 / (MSE of the linear picture x seconds).
    efficiency: Option<f64>,
    bias_z: Option<f64>,
    bias_levels: Option<f64>,
    /// Smallest bias that can be distinguished from noise.
    bias_least_levels: Option<f64>,
    crossings: Vec<TimeToTarget>,
    points: Vec<Point>,
}

/// Point of an error curve.
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
    rel_mse: f64,
}

/// First columns of a line of CSV, before the fields of [`Point`].
#[derive(Serialize)]
struct Variant<'a> {
    setting: &'static str,
    name: &'a str,
    threads: usize,
}

fn points(measured: &Measured) -> impl Iterator<Item = Point> {
    measured.points.iter().map(|p| Point {
        samples: p.samples,
        spp: p.spp,
        seconds: median(&measured.seconds(p)),
        seconds_spread: spread(&measured.seconds(p)),
        estimated_levels: p.estimated_levels,
        rmse_levels: p.errors.rmse_levels,
        rmse_levels_spread: p.errors.spread,
        rmse_linear: p.errors.rmse_linear,
        rel_mse: p.errors.rel_mse,
    })
}

fn variation<'a>(measured: &'a Measured, targets: &[f64]) -> Variation<'a> {
    let speed = measured.samples_per_second();
    let slope = measured.slope();
    Variation {
        setting: measured.experiment.name(),
        name: &measured.name,
        threads: measured.threads,
        samples_per_second: speed.map(|s| s.value),
        samples_per_second_spread: speed.map(|s| s.spread),
        slope: slope.map(|s| s.value),
        slope_standard_error: slope.map(|s| s.standard_error),
        efficiency: measured.efficiency(),
        // Without noise, the z-score is infinite, which JSON cannot represent.
        bias_z: measured.bias.map(|b| b.z).filter(|z| z.is_finite()),
        bias_levels: measured.bias.map(|b| b.levels),
        bias_least_levels: measured.bias.map(|b| b.least_levels),
        crossings: targets.iter().filter_map(|levels| measured.time_to(*levels)).collect(),
        points: points(measured).collect(),
    }
}

pub fn json(report: &MeasureReport) -> Vec<u8> {
    let m = report.measurement;
    let steadiness = m.steadiness();
    let document = Document {
        scene: report.scene.display().to_string(),
        version: env!("CARGO_PKG_VERSION"),
        machine: report.machine(),
        size: m.size,
        lanes: report.lanes,
        threads: report.threads,
        reference_spp: m.reference_spp,
        reference_levels: m.reference_levels,
        reference_linear: m.reference_linear,
        reference_seconds: m.reference_seconds,
        compared_at_levels: m.compared_at,
        errors_spread: m.reference_uncertainty(),
        times_spread: steadiness.spread,
        taken_by_others: steadiness.stolen,
        expected: &m.expected,
        variations: m.measured.iter().map(|v| variation(v, &m.targets)).collect(),
    };
    let mut bytes = serde_json::to_vec_pretty(&document).expect("numbers and strings only");
    bytes.push(b'\n');
    bytes
}

/// Serialises the points of all error curves, one line per point.
pub fn csv(measurement: &Measurement) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for measured in &measurement.measured {
        for point in points(measured) {
            let variant = Variant {
                setting: measured.experiment.name(),
                name: &measured.name,
                threads: measured.threads,
            };
            writer.serialize((variant, point)).expect("a vector takes everything");
        }
    }
    writer.into_inner().expect("a vector takes everything")
}
