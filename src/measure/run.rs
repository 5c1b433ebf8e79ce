//! The measurement itself.

use super::curve::{End, repeat, walk};
use super::picture::Reference;
use super::plan::{Plan, Topic, Variation};
use super::result::{Bias, Measured, Measurement};
use crate::scene::Scene;
use std::io;
use std::sync::Arc;
use std::time::Instant;

/// How far a measurement is.
pub struct Progress<'a> {
    /// What is being done.
    pub what: &'a str,
    /// Steps done and steps in all, as far as known.
    pub done: usize,
    /// Steps in all.
    pub of: usize,
}

/// Seconds of tracing before anything is measured: clocks and caches settle.
const WARM_UP_SECONDS: f64 = 0.3;
/// The reference's noise is this part of the smallest target.
const REFERENCE_SHARE: f64 = 0.3;
/// The most of the time that the reference may take.
const REFERENCE_TIME: f64 = 0.4;
/// The most of the time that one way may take the first time.
const WAY_TIME: f64 = 0.12;
/// Settings are compared at this noise, in codes, if the default gets there in time.
const COMPARED_AT: f64 = 0.5;

/// Measures `scene`, which has no faults. `reference`: a picture to compare with; else one is made
/// with another seed. `tell` hears how far it is; `false` from it ends the measurement early, with
/// what there is so far.
///
/// # Errors
/// Threads are not to be had.
pub fn measure(
    scene: &Arc<Scene>,
    plan: &Plan,
    reference: Option<Reference>,
    tell: &mut dyn FnMut(Progress) -> bool,
) -> io::Result<Measurement> {
    let begun = Instant::now();
    let variations = plan.variations(scene);
    let default = &variations[0];
    let of = 1 + variations.len() * plan.repetitions.max(1);
    let mut go_on = tell(Progress { what: "reference", done: 0, of });

    warm_up(default)?;
    let least = plan.targets.iter().copied().fold(COMPARED_AT, f64::min);
    let made = match reference {
        Some(given) => Made { reference: given, spp: 0.0, seconds: 0.0 },
        None => make_reference(default, REFERENCE_SHARE * least, REFERENCE_TIME * plan.seconds)?,
    };
    let reference = &made.reference;

    let mut measured: Vec<Measured> = Vec::new();
    let mut compared_at = COMPARED_AT;
    for (i, variation) in variations.iter().enumerate() {
        if i > 0 && !go_on {
            break;
        }
        go_on &= tell(Progress { what: &variation.name, done: 1 + i, of });
        let codes = if variation.topic == Topic::Default { least } else { compared_at };
        let end =
            End { codes, seconds: WAY_TIME * plan.seconds, told: !variation.topic.unbiased() };
        let (points, course) = walk(variation, reference, end)?;
        let rendering = course.rendering();
        let bias = (!variation.topic.unbiased()).then(|| {
            let (z, codes) = reference.bias(&rendering.film, &rendering.mix);
            Bias { z, codes }
        });
        let result = Measured::new(variation, points, bias);
        if variation.topic == Topic::Default {
            // The finest of the targets that the default met, but no finer than is needed.
            let met = |codes: &f64| result.crossing(*codes).is_some();
            let mut levels: Vec<f64> = plan.targets.iter().copied().chain([COMPARED_AT]).collect();
            levels.sort_by(f64::total_cmp);
            let enough = levels.iter().copied().filter(|c| *c >= COMPARED_AT);
            compared_at = enough.into_iter().find(met).unwrap_or(f64::INFINITY);
            if compared_at.is_infinite() {
                compared_at = result.points.last().map_or(COMPARED_AT, |p| p.errors.rmse_codes);
            }
        }
        measured.push(result);
    }

    // In turns; every way at least as often as asked for, then as long as there is time.
    let mut round = 1;
    while go_on && (round < plan.repetitions || time_for_another(begun, plan.seconds, round)) {
        for (i, (variation, result)) in variations.iter().zip(&mut measured).enumerate() {
            let done = (1 + variations.len() * round + i).min(of);
            go_on &= tell(Progress { what: &variation.name, done, of });
            if !go_on {
                break;
            }
            repeat(variation, &mut result.points)?;
        }
        round += 1;
    }
    Ok(Measurement {
        size: scene.film.size,
        reference_spp: made.spp,
        reference_codes: reference.noise_codes(),
        reference_linear: reference.noise_linear(),
        reference_seconds: made.seconds,
        compared_at,
        targets: plan.targets.clone(),
        measured,
    })
}

/// Whether a round like those before would end in time.
fn time_for_another(begun: Instant, seconds: f64, rounds: usize) -> bool {
    /// More repetitions than this tell nothing new.
    const ENOUGH: usize = 9;
    let passed = begun.elapsed().as_secs_f64();
    rounds < ENOUGH && passed + passed * (1.0 - REFERENCE_TIME) / rounds as f64 <= seconds
}

fn warm_up(variation: &Variation) -> io::Result<()> {
    let mut course = variation.course()?;
    while course.seconds() < WARM_UP_SECONDS && course.step().is_none() {}
    Ok(())
}

struct Made {
    reference: Reference,
    spp: f64,
    seconds: f64,
}

/// A picture far quieter than what is compared with it, by another seed.
fn make_reference(default: &Variation, codes: f64, seconds: f64) -> io::Result<Made> {
    let mut other = default.clone();
    other.options.sampling.seed = other.options.sampling.seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut course = other.course()?;
    while course.seconds() < seconds && course.noise_codes().is_none_or(|noise| noise > codes) {
        if course.step().is_some() {
            break;
        }
    }
    let rendering = course.rendering();
    let display = &other.options.display;
    Ok(Made {
        reference: Reference::of_film(&rendering.film, &rendering.mix, display),
        spp: course.spp().mean,
        seconds: course.seconds(),
    })
}
