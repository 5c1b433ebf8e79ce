//! The measurement itself.

use crate::measure::error_curve::{End, follow, repeat};
use crate::measure::experiment::{Experiment, Plan, Variant};
use crate::measure::reference::Reference;
use crate::measure::result::{Expected, Measured, Measurement, spread};
use crate::render::SyncRender;
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
/// The reference's noise is this part of the smallest target, if there is time for that.
const REFERENCE_SHARE: f64 = 0.3;
/// The most of the time that the reference may take.
const REFERENCE_TIME: f64 = 0.3;
/// The most of the time that the default's way may take the first time.
const DEFAULT_TIME: f64 = 0.12;
/// Settings are compared at this noise, in codes, or where there is time for that.
const COMPARED_AT: f64 = 0.5;
/// A setting that takes so many times as long as the default is not followed to the end.
const SLOWEST: f64 = 5.0;
/// Times that are apart by no more than this share are steady.
const STEADY: f64 = 0.05;
/// With steady times, more repetitions than this tell nothing new.
const ENOUGH: usize = 7;
/// More repetitions than this do not make times steady.
const MOST: usize = 31;

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
    let idle = |topic: &Experiment| !variations.iter().any(|v| v.topic == *topic);
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
    let mut expected = Vec::new();
    let mut compared_at = COMPARED_AT;
    let mut longest = DEFAULT_TIME * plan.seconds;
    for (i, variation) in variations.iter().enumerate() {
        if i > 0 && !go_on {
            break;
        }
        go_on &= tell(Progress { what: &variation.name, done: 1 + i, of });
        let codes = if i == 0 { least } else { compared_at };
        let end = End { codes, seconds: longest, told: !variation.topic.unbiased() };
        let (points, taken, course) = follow(variation, reference, end)?;
        let rendering = course.rendering();
        let bias =
            (!variation.topic.unbiased()).then(|| reference.bias(&rendering.film, &rendering.mix));
        let result = Measured::new(variation, points, taken, bias);
        if i == 0 {
            let missed = plan.targets.iter().filter(|codes| result.time_to(**codes).is_none());
            expected = missed.filter_map(|codes| expect(&course, *codes)).collect();
            let left = plan.seconds - begun.elapsed().as_secs_f64();
            let ways = plan.repetitions.max(1) * (variations.len() - 1);
            let own = (plan.repetitions.max(1) - 1) as f64 * course.seconds();
            compared_at = level(&result, &plan.targets, (left - own) / (2 * ways.max(1)) as f64);
            longest = SLOWEST * result.time_to(compared_at).map_or(longest, |c| c.seconds);
        }
        measured.push(result);
    }

    // In turns; every way at least as often as asked for, then until times are steady, while there is
    // time.
    let mut round = 1;
    let mut round_seconds = 0.0;
    while go_on {
        let passed = begun.elapsed().as_secs_f64();
        let steady = measured.iter().all(|m| is_steady(m, compared_at));
        let wanted = round < MOST && (round < ENOUGH || !steady);
        let fits = round == 1 || passed + round_seconds <= plan.seconds;
        if round >= plan.repetitions && !(wanted && fits) {
            break;
        }
        for (i, (variation, result)) in variations.iter().zip(&mut measured).enumerate() {
            let done = (1 + variations.len() * round + i).min(of);
            go_on &= tell(Progress { what: &variation.name, done, of });
            if !go_on {
                break;
            }
            let taken = repeat(variation, &mut result.points)?;
            result.stolen.push(taken);
        }
        round_seconds = begun.elapsed().as_secs_f64() - passed;
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
        expected,
        idle: plan.topics.iter().copied().filter(idle).collect(),
        measured,
    })
}

/// When the noise will have fallen to `codes`.
fn expect(course: &SyncRender, codes: f64) -> Option<Expected> {
    course.seconds_to_noise(codes).map(|seconds| Expected { codes, seconds })
}

/// The noise in codes at which settings are compared: the finest of the targets and their doubles that
/// the default reached within `seconds`, but no finer than is needed; else the coarsest that it reached;
/// else where it ended.
fn level(default: &Measured, targets: &[f64], seconds: f64) -> f64 {
    let mut levels: Vec<f64> = targets.iter().copied().chain([0.5, 1.0, 2.0, 4.0, 8.0]).collect();
    levels.retain(|codes| *codes >= COMPARED_AT);
    levels.sort_by(f64::total_cmp);
    let reached: Vec<_> = levels.iter().filter_map(|codes| default.time_to(*codes)).collect();
    let in_time = reached.iter().find(|c| c.seconds <= seconds && !c.at_most);
    let any = || reached.iter().rev().find(|c| !c.at_most).or(reached.first());
    let end = || default.points.last().map_or(COMPARED_AT, |p| p.errors.rmse_codes);
    in_time.or_else(any).map_or_else(end, |c| c.codes)
}

/// Whether a way's time to `codes`, or to its end, needs no more repetitions.
fn is_steady(measured: &Measured, codes: f64) -> bool {
    let end = || measured.points.last().map_or(0.0, |p| spread(&measured.seconds(p)));
    measured.true_time_to(codes).map_or_else(end, |c| c.spread) <= STEADY
}

fn warm_up(variation: &Variant) -> io::Result<()> {
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
fn make_reference(default: &Variant, codes: f64, seconds: f64) -> io::Result<Made> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::error_curve::Point;
    use crate::measure::reference::Errors;

    /// A way with these seconds and codes.
    fn way(points: &[(f64, f64)]) -> Measured {
        let point = |(seconds, codes): &(f64, f64)| Point {
            step: 1,
            samples: 1,
            spp: *seconds,
            seconds: vec![*seconds; 3],
            told_codes: Some(*codes),
            errors: Errors { rmse_linear: 0.0, rmse_codes: *codes, rel_mse: 0.0, spread: 0.0 },
        };
        Measured {
            topic: Experiment::Default,
            name: String::new(),
            threads: 1,
            points: points.iter().map(point).collect(),
            stolen: vec![None; 3],
            bias: None,
        }
    }

    #[test]
    fn settings_are_compared_where_there_is_time_for_it() {
        let default = way(&[(0.1, 5.0), (1.0, 1.6), (2.0, 0.8), (5.0, 0.3)]);
        let targets = [2.0, 1.0, 0.5, 0.25];
        assert_eq!(level(&default, &targets, 9.0), 0.5, "no finer than is needed");
        assert_eq!(level(&default, &targets, 2.0), 1.0);
        assert_eq!(level(&default, &targets, 0.3), 4.0, "coarser than asked for");
        assert_eq!(level(&default, &targets, 0.01), 4.0, "what was reached first, not at once");
        assert_eq!(
            level(&way(&[(1.0, 0.2)]), &targets, 9.0),
            0.5,
            "at once is better than nothing"
        );
        assert_eq!(level(&way(&[(1.0, 30.0), (2.0, 20.0)]), &targets, 9.0), 20.0, "where it ended");
    }

    #[test]
    fn ways_are_steady_when_their_repetitions_agree() {
        let mut way = way(&[(1.0, 1.0), (2.0, 0.5)]);
        assert!(is_steady(&way, 0.5) && is_steady(&way, 0.1));
        way.points[1].seconds = vec![2.0, 2.4, 2.0];
        assert!(!is_steady(&way, 0.5) && !is_steady(&way, 0.1) && is_steady(&way, 1.0));
    }
}
