//! One setting's way from the first samples to a quiet picture.

use super::picture::{Errors, Reference};
use super::plan::Variation;
use crate::render::Course;
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

/// The way of `variation`, with errors, and the picture at its end.
pub fn walk(
    variation: &Variation,
    reference: &Reference,
    end: End,
) -> io::Result<(Vec<Point>, Course)> {
    let mut course = variation.course()?;
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
    Ok((points, course))
}

/// Goes the same way again and notes the seconds.
pub fn repeat(variation: &Variation, points: &mut [Point]) -> io::Result<()> {
    let mut course = variation.course()?;
    let mut step = 0;
    for point in points {
        while step < point.step {
            course.step();
            step += 1;
        }
        point.seconds.push(course.seconds());
    }
    Ok(())
}
