//! Error curve of one variant, from the first samples to the target noise.

use crate::measure::contention::RunQueueDelay;
use crate::measure::experiment::Variant;
use crate::measure::reference::{Errors, Reference};
use crate::render::SyncRender;
use std::io;

/// Point of an error curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Number of preceding decisions of the schedule.
    pub step: usize,
    /// Samples over all pixels.
    pub samples: u64,
    /// Samples per pixel, mean.
    pub spp: f64,
    /// Seconds of tracing, one entry for each repetition.
    pub seconds: Vec<f64>,
    /// The program's own estimate of the error, in 8-bit levels.
    pub estimated_codes: Option<f64>,
    /// The error against the reference.
    pub errors: Errors,
}

/// End of an error curve.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// Error at which the curve ends, in 8-bit levels.
    pub codes: f64,
    /// Seconds of tracing after which it ends in any case.
    pub seconds: f64,
    /// Compares the estimated error instead of the true one, for biased variants.
    pub use_estimate: bool,
}

/// Factor by which the estimated error falls between two points of the curve.
const POINT_RATIO: f64 = 0.84;

/// Share of the processors' time that other programs used while `threads` threads ran for `seconds`
/// since `before`; `None` if it is unknown, or if these threads wait for each other.
fn stolen_share(before: Option<&RunQueueDelay>, threads: usize, seconds: f64) -> Option<f64> {
    if seconds <= 0.0 || threads > std::thread::available_parallelism().map_or(1, usize::from) {
        return None;
    }
    let waited = RunQueueDelay::now()?.seconds_since(before?);
    Some((waited / (threads as f64 * seconds)).min(1.0))
}

/// Renders `variant` until `end`. Returns the points, the share of the processors that other programs
/// used meanwhile, and the render.
///
/// # Errors
/// Returns the error of the system that refuses to start a thread.
pub fn follow(
    variant: &Variant,
    reference: &Reference,
    end: End,
) -> io::Result<(Vec<Point>, Option<f64>, SyncRender)> {
    let mut render = variant.start()?;
    let before = RunQueueDelay::now();
    let mut points: Vec<Point> = Vec::new();
    let mut last_estimate = f64::INFINITY;
    for step in 1.. {
        let done = render.step().is_some();
        let estimate = render.noise_codes();
        let timed_out = render.seconds() >= end.seconds;
        let changed = estimate.is_some_and(|t| t <= POINT_RATIO * last_estimate);
        // A picture without noise is final at once.
        let noiseless = estimate == Some(0.0);
        if changed || done || timed_out {
            last_estimate = estimate.unwrap_or(last_estimate);
            let rendering = render.rendering();
            let errors = reference.errors(&rendering.film, &rendering.mix);
            if points.last().is_none_or(|last| last.samples < render.samples()) {
                points.push(Point {
                    step,
                    samples: render.samples(),
                    spp: render.spp().mean,
                    seconds: vec![render.seconds()],
                    estimated_codes: estimate,
                    errors,
                });
            }
            let reached = if end.use_estimate { estimate } else { Some(errors.rmse_codes) };
            if reached.is_some_and(|codes| codes <= end.codes) || done || timed_out || noiseless {
                break;
            }
        }
    }
    let stolen = stolen_share(before.as_ref(), variant.threads, render.seconds());
    Ok((points, stolen, render))
}

/// Renders `variant` again and adds the seconds to each point. Returns the share of the processors that
/// other programs used meanwhile.
///
/// # Errors
/// Returns the error of the system that refuses to start a thread.
pub fn repeat(variant: &Variant, points: &mut [Point]) -> io::Result<Option<f64>> {
    let mut render = variant.start()?;
    let before = RunQueueDelay::now();
    let mut step = 0;
    for point in points {
        while step < point.step {
            render.step();
            step += 1;
        }
        point.seconds.push(render.seconds());
    }
    Ok(stolen_share(before.as_ref(), variant.threads, render.seconds()))
}
