//! Error curve: the error of a variant at increasing numbers of samples, until it reaches the
//! target noise.

use crate::measure::experiment::Variant;
use crate::measure::reference_image::{Errors, Reference};
use std::io;
use zerkalo_render::{ErrorParts, SyncRender};

/// Point of an error curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Number of calls of [`SyncRender::step`] up to this point.
    pub step: usize,
    /// Number of samples up to this point, over all pixels.
    pub samples: u64,
    /// Mean number of samples per pixel.
    pub spp: f64,
    /// Seconds of tracing up to this point, in each repetition.
    pub seconds: Vec<f64>,
    /// Error in 8-bit levels as the render estimates it from its replicates. `None` before the
    /// first estimate.
    pub estimated_levels: Option<f64>,
    pub errors: Errors,
    /// Parts of the estimated error. `None` before the first estimate.
    pub parts: Option<ErrorParts>,
}

/// Ratio to which the estimated error falls from one point to the next: about 2^(-1/4), so that a
/// curve has four points for each halving of the error.
const POINT_RATIO: f64 = 0.84;

/// Renders with the settings of `variant`. Ends when the error is at most `levels` 8-bit levels,
/// `seconds` of tracing have passed, or further samples cannot change the picture. For biased
/// settings, whose true error does not converge to 0, the error is the estimated one. Also ends,
/// without a last point, when `goes_on`, which is called after each step, returns `false`. Returns the error curve and the
/// render. Fails if a thread cannot be started.
pub fn follow(
    variant: &Variant,
    reference: &Reference,
    levels: f64,
    seconds: f64,
    goes_on: &mut dyn FnMut() -> bool,
) -> io::Result<(Vec<Point>, SyncRender)> {
    let mut render = variant.start()?;
    let mut points: Vec<Point> = Vec::new();
    let mut last_estimate = f64::INFINITY;
    for step in 1.. {
        let done = render.step().is_some();
        let estimate = render.noise_levels();
        if !goes_on() {
            break;
        }
        let timed_out = render.seconds >= seconds;
        let changed = estimate.is_some_and(|t| t <= POINT_RATIO * last_estimate);
        // Further samples do not change a picture without noise.
        let noiseless = estimate == Some(0.0);
        if changed || done || timed_out {
            last_estimate = estimate.unwrap_or(last_estimate);
            let errors = reference.errors(&render.state.film, &render.state.weights);
            if points.last().is_none_or(|last| last.samples < render.schedule.samples) {
                points.push(Point {
                    step,
                    samples: render.schedule.samples,
                    spp: render.schedule.spp().mean,
                    seconds: vec![render.seconds],
                    estimated_levels: estimate,
                    errors,
                    parts: render.error_parts(),
                });
            }
            let is_unbiased = variant.experiment.is_unbiased;
            let error = if is_unbiased { Some(errors.rmse_levels) } else { estimate };
            if error.is_some_and(|error| error <= levels) || done || timed_out || noiseless {
                break;
            }
        }
    }
    Ok((points, render))
}

/// Repeats the render of `variant`, and appends its seconds of tracing to each point of the error
/// curve, until `goes_on` returns `false`.
pub fn repeat(
    variant: &Variant,
    points: &mut [Point],
    goes_on: &mut dyn FnMut() -> bool,
) -> io::Result<()> {
    let mut render = variant.start()?;
    let mut step = 0;
    for point in points {
        while step < point.step {
            render.step();
            step += 1;
            if !goes_on() {
                return Ok(());
            }
        }
        point.seconds.push(render.seconds);
    }
    Ok(())
}
