//! One setting's way from the first samples to a quiet picture.

use crate::measure::contention::RunQueueDelay;
use crate::measure::experiment::Variant;
use crate::measure::reference::{Errors, Reference};
use crate::render::SyncRender;
use std::io;

/// A place on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Decisions of the schedule before it.
    pub step: usize,
    /// Samples over all pixels.
    pub samples: u64,
    /// Samples per pixel, mean.
    pub spp: f64,
    /// Seconds of tracing, one entry for each repetition.
    pub seconds: Vec<f64>,
    /// The error that the program itself told, in codes.
    pub told_codes: Option<f64>,
    /// The error against the reference.
    pub errors: Errors,
}

/// When to end a way.
#[derive(Clone, Copy, Debug)]
pub struct End {
    /// The true error has come down to this, in codes.
    pub codes: f64,
    /// Or so many seconds of tracing have passed.
    pub seconds: f64,
    /// Not the true error counts but what the program tells: for what never becomes right.
    pub told: bool,
}

/// The error is looked at each time it has, by the program's own estimate, come down by this factor.
const EVERY: f64 = 0.84;

/// The share of the processors' time that others took while so many threads wanted them for so many
/// seconds since `before`; `None`: nobody knows, or these threads wait for each other.
fn taken(before: Option<&RunQueueDelay>, threads: usize, seconds: f64) -> Option<f64> {
    if seconds <= 0.0 || threads > std::thread::available_parallelism().map_or(1, usize::from) {
        return None;
    }
    let waited = RunQueueDelay::now()?.seconds_since(before?);
    Some((waited / (threads as f64 * seconds)).min(1.0))
}

/// The way of `variation`, with errors, the share of the processors that others took meanwhile, and the
/// picture at its end.
pub fn follow(
    variation: &Variant,
    reference: &Reference,
    end: End,
) -> io::Result<(Vec<Point>, Option<f64>, SyncRender)> {
    let mut course = variation.course()?;
    let before = RunQueueDelay::now();
    let mut points: Vec<Point> = Vec::new();
    let mut looked_at = f64::INFINITY;
    for step in 1.. {
        let done = course.step().is_some();
        let told = course.noise_codes();
        let over = course.seconds() >= end.seconds;
        let changed = told.is_some_and(|t| t <= EVERY * looked_at);
        // A picture without noise is right at once, and stays as it is.
        let quiet = told == Some(0.0);
        if changed || done || over {
            looked_at = told.unwrap_or(looked_at);
            let rendering = course.rendering();
            let errors = reference.errors(&rendering.film, &rendering.mix);
            if points.last().is_none_or(|last| last.samples < course.samples()) {
                points.push(Point {
                    step,
                    samples: course.samples(),
                    spp: course.spp().mean,
                    seconds: vec![course.seconds()],
                    told_codes: told,
                    errors,
                });
            }
            let reached = if end.told { told } else { Some(errors.rmse_codes) };
            if reached.is_some_and(|codes| codes <= end.codes) || done || over || quiet {
                break;
            }
        }
    }
    let taken = taken(before.as_ref(), variation.threads, course.seconds());
    Ok((points, taken, course))
}

/// Goes the same way again and notes the seconds; the share of the processors that others took meanwhile.
pub fn repeat(variation: &Variant, points: &mut [Point]) -> io::Result<Option<f64>> {
    let mut course = variation.course()?;
    let before = RunQueueDelay::now();
    let mut step = 0;
    for point in points {
        while step < point.step {
            course.step();
            step += 1;
        }
        point.seconds.push(course.seconds());
    }
    Ok(taken(before.as_ref(), variation.threads, course.seconds()))
}
