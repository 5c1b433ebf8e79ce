//! Course of a measurement: renders the reference, follows the error curve of every variant, and
//! repeats the renders for the medians of the times.

use crate::measure::error_curve::{follow, repeat};
use crate::measure::experiment::{Experiment, Plan, Variant};
use crate::measure::reference_image::Reference;
use crate::measure::result::{Expected, Measured, Measurement};
use std::io;
use std::sync::Arc;
use std::time::Instant;
use zerkalo_render::SyncRender;
use zerkalo_render::schedule::Interval;
use zerkalo_scene::Scene;

/// Observer of a measurement. It gets the name of the render in progress (a variant, or
/// `reference`), the number of renders that have ended, and the number that is expected. If it
/// returns `false`, the measurement ends with the results so far.
pub type Observer<'a> = &'a mut dyn FnMut(&str, usize, usize) -> bool;

/// Seconds of tracing before the measurement, until clock rates and caches are steady.
const WARM_UP_SECONDS: f64 = 0.3;
/// Noise of the reference, as a share of the smallest noise to be measured, which is a target or
/// [`COMPARED_AT`]. The squared error of the reference is then 9 % of that noise squared.
const REFERENCE_SHARE: f64 = 0.3;
/// Largest duration of the reference, as a share of the whole measurement.
const REFERENCE_TIME: f64 = 0.3;
/// Largest duration of the first render with default settings, as a share of the whole measurement.
const DEFAULT_TIME: f64 = 0.12;
/// Smallest noise at which settings are compared, in 8-bit levels.
const COMPARED_AT: f64 = 0.5;
/// Longest duration of a render with a changed setting, in units of the time that the default
/// settings take to reach the noise at which settings are compared.
const MAX_SLOWDOWN: f64 = 5.0;
/// Largest number of rounds, unless the plan requests more. A round repeats the render of each
/// variant once.
const MAX_ROUNDS: usize = 15;

/// Measures `scene`, which must be valid. If no `reference` is given, one is rendered with another
/// random seed. Fails if a thread cannot be started.
pub fn measure(
    scene: &Arc<Scene>,
    plan: &Plan,
    reference: Option<Reference>,
    report: Observer,
) -> io::Result<Measurement> {
    let (variants, started) = (plan.variants(scene), Instant::now());
    let mut course = Course { plan, variants: variants.len(), started, report, keep_going: true };
    let default = &variants[0];
    let mut warm_up = default.start()?;
    while warm_up.seconds < WARM_UP_SECONDS && warm_up.step().is_none() {}
    let lanes = warm_up.state.world.info().lanes;
    drop(warm_up);
    let least = plan.targets.iter().copied().fold(COMPARED_AT, f64::min);
    let reference = match reference {
        Some(given) => given,
        None => course.render_reference(default, REFERENCE_SHARE * least)?,
    };
    let idle = |experiment: &&'static Experiment| {
        !variants.iter().any(|variant| variant.experiment == *experiment)
    };
    let mut measurement = Measurement {
        size: scene.film.size,
        lanes,
        reference,
        compared_at: COMPARED_AT,
        targets: plan.targets.clone(),
        expected: Vec::new(),
        idle: plan.experiments.iter().copied().filter(idle).collect(),
        measured: Vec::new(),
    };
    course.follow_all(variants, least, &mut measurement)?;
    course.repeat_all(&mut measurement)?;
    Ok(measurement)
}

/// Measurement in progress.
struct Course<'a> {
    plan: &'a Plan,
    /// Number of variants to measure.
    variants: usize,
    started: Instant,
    report: Observer<'a>,
    keep_going: bool,
}

impl Course<'_> {
    /// Reports the progress. Returns `false` if the measurement is to end.
    fn goes_on(&mut self, step: &str, done: usize) -> bool {
        let total = 1 + self.variants * self.plan.repetitions;
        self.keep_going &= (self.report)(step, done.min(total), total);
        self.keep_going
    }

    /// Renders a reference with another random seed, until its noise is at most `levels` 8-bit
    /// levels or its time has passed.
    fn render_reference(&mut self, default: &Variant, levels: f64) -> io::Result<Reference> {
        let seconds = REFERENCE_TIME * self.plan.seconds;
        let mut other = default.clone();
        let seed = &mut other.options.sampling.seed;
        *seed = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut render = other.start()?;
        while render.seconds < seconds && render.noise_levels().is_none_or(|noise| noise > levels) {
            if render.step().is_some() || !self.goes_on("reference", 0) {
                break;
            }
        }
        let (state, display) = (&render.state, &other.options.display);
        let mut reference = Reference::of_film(&state.film, &state.weights, display);
        (reference.spp, reference.seconds) = (render.schedule.spp().mean, render.seconds);
        Ok(reference)
    }

    /// Follows the error curves of all variants: that of the default settings to the noise `least`,
    /// and the others to the noise at which settings are compared.
    fn follow_all(
        &mut self,
        variants: Vec<Variant>,
        least: f64,
        measurement: &mut Measurement,
    ) -> io::Result<()> {
        let plan = self.plan;
        let mut longest = DEFAULT_TIME * plan.seconds;
        for (i, variant) in variants.into_iter().enumerate() {
            if i > 0 && !self.keep_going {
                break;
            }
            let levels = if i == 0 { least } else { measurement.compared_at };
            let reference = &measurement.reference;
            let (points, render) = follow(&variant, reference, levels, longest, &mut || {
                self.goes_on(&variant.name, 1 + i)
            })?;
            if points.is_empty() {
                break;
            }
            let bias = || reference.bias(&render.state.film, &render.state.weights);
            let bias = (!variant.experiment.is_unbiased).then(bias);
            let result = Measured { variant, points, bias };
            if i == 0 {
                let missed =
                    plan.targets.iter().filter(|levels| result.time_to(**levels).is_none());
                measurement.expected =
                    missed.filter_map(|levels| extrapolate(&render, *levels)).collect();
                let seconds_left = plan.seconds - self.started.elapsed().as_secs_f64();
                let runs = plan.repetitions * (self.variants - 1);
                let default_seconds = (plan.repetitions - 1) as f64 * render.seconds;
                let seconds_per_run = (seconds_left - default_seconds) / (2 * runs.max(1)) as f64;
                let compared_at = comparison_noise(&result, &plan.targets, seconds_per_run);
                longest = MAX_SLOWDOWN * result.time_to(compared_at).map_or(longest, |c| c.seconds);
                measurement.compared_at = compared_at;
            }
            measurement.measured.push(result);
        }
        Ok(())
    }

    /// Repeats the renders of all variants in rounds: at least `plan.repetitions`, and further ones
    /// until time is up.
    fn repeat_all(&mut self, measurement: &mut Measurement) -> io::Result<()> {
        let (mut round, mut round_seconds) = (1, 0.0);
        while self.keep_going {
            let passed = self.started.elapsed().as_secs_f64();
            let fits = round == 1 || passed + round_seconds <= self.plan.seconds;
            if round >= self.plan.repetitions && !(fits && round < MAX_ROUNDS) {
                break;
            }
            for (i, measured) in measurement.measured.iter_mut().enumerate() {
                let done = 1 + self.variants * round + i;
                let Measured { variant, points, .. } = measured;
                repeat(variant, points, &mut || self.goes_on(&variant.name, done))?;
            }
            round_seconds = self.started.elapsed().as_secs_f64() - passed;
            round += 1;
        }
        Ok(())
    }
}

/// Returns the extrapolated time to `levels` 8-bit levels. Returns `None` if it cannot be
/// extrapolated.
fn extrapolate(render: &SyncRender, levels: f64) -> Option<Expected> {
    let Interval { low, high } = render.schedule.seconds_to_noise(levels, render.seconds)?;
    let seconds = render.seconds;
    Some(Expected { levels, seconds_low: seconds + low, seconds_high: seconds + high })
}

/// Returns the noise in 8-bit levels at which settings are compared: the smallest candidate that
/// the default settings reached within `seconds`, or else the largest that they reached, or else
/// their final error. Candidates are the powers of two from 0.5 to 8, and the targets that are at
/// least [`COMPARED_AT`].
fn comparison_noise(default: &Measured, targets: &[f64], seconds: f64) -> f64 {
    let mut levels: Vec<f64> = targets.iter().copied().chain([0.5, 1.0, 2.0, 4.0, 8.0]).collect();
    levels.retain(|level| *level >= COMPARED_AT);
    levels.sort_by(f64::total_cmp);
    let reached: Vec<_> = levels.iter().filter_map(|level| default.time_to(*level)).collect();
    let in_time = reached.iter().find(|c| c.seconds <= seconds);
    let end = || default.points.last().map_or(COMPARED_AT, |p| p.errors.rmse_levels);
    in_time.or(reached.last()).map_or_else(end, |c| c.levels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::error_curve::Point;
    use crate::measure::reference_image::Errors;

    /// Returns the results of a render. `points` are the points of its error curve, each as
    /// (seconds, error in 8-bit levels).
    fn results(points: &[(f64, f64)]) -> Measured {
        let point = |(seconds, levels): &(f64, f64)| Point {
            step: 1,
            samples: 1,
            spp: *seconds,
            seconds: vec![*seconds; 3],
            estimated_levels: Some(*levels),
            errors: Errors { rmse_linear: 0.0, rmse_levels: *levels, spread: 0.0 },
            parts: None,
        };
        let points = points.iter().map(point).collect();
        Measured {
            variant: Plan::default().variants(&Arc::default()).remove(0),
            points,
            bias: None,
        }
    }

    #[test]
    fn comparison_noise_fits_the_time() {
        let default = results(&[(0.1, 5.0), (1.0, 1.6), (2.0, 0.8), (5.0, 0.3)]);
        let targets = [2.0, 1.0, 0.5, 0.25];
        assert_eq!(comparison_noise(&default, &targets, 9.0), 0.5, "at least COMPARED_AT");
        assert_eq!(comparison_noise(&default, &targets, 2.0), 1.0);
        assert_eq!(comparison_noise(&default, &targets, 0.3), 4.0, "coarser than the targets");
        assert_eq!(comparison_noise(&default, &targets, 0.01), 8.0, "the largest");
        assert_eq!(
            comparison_noise(&results(&[(1.0, 0.2)]), &targets, 9.0),
            0.5,
            "reached by the only point"
        );
        assert_eq!(
            comparison_noise(&results(&[(1.0, 30.0), (2.0, 20.0)]), &targets, 9.0),
            20.0,
            "the last noise"
        );
    }
}
