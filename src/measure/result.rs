//! What came out.

use crate::measure::convergence_order::Slope;
use crate::measure::error_curve::Point;
use crate::measure::experiment::{Experiment, Variant};
use crate::measure::reference::Bias;

/// When a way reached a given noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeToTarget {
    /// The true error, in codes.
    pub codes: f64,
    /// Seconds of tracing, median of the repetitions.
    pub seconds: f64,
    /// How far the repetitions are apart, see [`spread`].
    pub spread: f64,
    /// Samples per pixel, mean.
    pub spp: f64,
    /// The first picture was better already: it took at most this.
    pub at_most: bool,
}

/// When the default would reach a noise that it was not followed to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// The noise, in codes.
    pub codes: f64,
    /// A lower and an upper guess of the seconds, by how the noise fell last.
    pub seconds: (f64, f64),
}

/// One variation, measured.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Which setting.
    pub topic: Experiment,
    /// How it differs.
    pub name: String,
    /// Threads that traced.
    pub threads: usize,
    /// The way, first to last.
    pub points: Vec<Point>,
    /// Of each repetition, the share of the processors' time that other programs took meanwhile; `None`:
    /// nobody knows.
    pub stolen: Vec<Option<f64>>,
    /// Compared with the reference at the end, if its expectation may be another one.
    pub bias: Option<Bias>,
}

/// Everything about a scene.
pub struct Measurement {
    /// Film size in pixels.
    pub size: [u32; 2],
    /// The reference's samples per pixel; 0: it came from a file.
    pub reference_spp: f64,
    /// The reference's own error, in codes and in linear radiance.
    pub reference_codes: f64,
    /// The same in linear radiance.
    pub reference_linear: f64,
    /// Seconds that the reference took.
    pub reference_seconds: f64,
    /// The noise, in codes, at which settings are compared: a target that the default reached.
    pub compared_at: f64,
    /// The noise levels asked for, falling.
    pub targets: Vec<f64>,
    /// Those of them that the default did not reach in its time.
    pub expected: Vec<Expected>,
    /// Settings that were asked for and have nothing to compare in this scene.
    pub idle: Vec<Experiment>,
    /// The default first.
    pub measured: Vec<Measured>,
}

/// How far a measurement's times are to be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steadiness {
    /// The fewest repetitions that any of them is the median of.
    pub repetitions: usize,
    /// The greatest spread of those that are told.
    pub spread: f64,
    /// The greatest share of the processors that others took while those were taken; `None`: nobody
    /// knows.
    pub stolen: Option<f64>,
}

/// A repetition counts as undisturbed if others took no more than this share of the processors.
const CALM: f64 = 0.05;
/// So many repetitions count in any case, the calmest ones.
const LEAST: usize = 5;
/// An error that another reference could change by more than this share is not told.
const DOUBTFUL: f64 = 0.05;

/// Standard deviations within which a number of signs lies in about four of five cases, times the root
/// of two for the difference of two such numbers.
const CERTAINTY: f64 = 1.4 * std::f64::consts::SQRT_2;

/// The middle one; the mean of the two in the middle.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// How far the median of another measurement may be from this one's, as a share of it, on a machine that
/// stays as it is: it is that near in about four of five cases. With fewer than five values the
/// distance of the least and the greatest; else half the distance of the two values between which the
/// median of all that could be measured lies, so certainly that two such medians agree (by the signs test:
/// Conover, *Practical Nonparametric Statistics*, confidence interval for a quantile). 0 for fewer than
/// two values.
pub fn spread(values: &[f64]) -> f64 {
    let middle = median(values);
    if values.len() < 2 || middle == 0.0 {
        return 0.0;
    }
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let share = if values.len() < 5 { 1.0 } else { 0.5 };
    let left_out = (0.5 * (n - CERTAINTY * n.sqrt())).max(0.0) as usize;
    share * (sorted[values.len() - 1 - left_out] - sorted[left_out]) / middle
}

fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = q * last as f64;
    let (low, part) = (at as usize, at.fract());
    sorted[low] + part * (sorted[(low + 1).min(last)] - sorted[low])
}

impl Measured {
    /// An empty record of a variation whose way is `points`.
    pub fn new(
        variation: &Variant,
        points: Vec<Point>,
        stolen: Option<f64>,
        bias: Option<Bias>,
    ) -> Self {
        Self {
            topic: variation.topic,
            name: variation.name.clone(),
            threads: variation.threads,
            points,
            stolen: vec![stolen],
            bias,
        }
    }

    /// The repetitions that count: those in which nobody else took the processors; if they are too few,
    /// the calmest.
    fn counted(&self) -> Vec<usize> {
        let of = |i: &usize| self.stolen[*i].unwrap_or(0.0);
        let mut all: Vec<usize> = (0..self.stolen.len()).collect();
        all.sort_by(|a, b| of(a).total_cmp(&of(b)));
        let calm = all.iter().filter(|i| of(i) <= CALM).count();
        all.truncate(calm.max(LEAST));
        all
    }

    /// Seconds at a point of the way, of each repetition that counts.
    pub fn seconds(&self, point: &Point) -> Vec<f64> {
        self.counted().into_iter().filter_map(|i| point.seconds.get(i).copied()).collect()
    }

    /// The greatest share of the processors that others took in the repetitions that count.
    fn most_taken(&self) -> Option<f64> {
        self.counted().into_iter().filter_map(|i| self.stolen[i]).reduce(f64::max)
    }

    /// Where the true error came down to `codes`, between points on straight lines of the logarithms.
    pub fn time_to(&self, codes: f64) -> Option<TimeToTarget> {
        self.crossing_of(codes, |p| {
            let certain = p.errors.spread <= DOUBTFUL;
            if certain { p.errors.rmse_codes } else { f64::INFINITY }
        })
    }

    /// The same of the error that the program told, for what is never right.
    pub fn estimated_time_to(&self, codes: f64) -> Option<TimeToTarget> {
        self.crossing_of(codes, |p| p.told_codes.unwrap_or(f64::INFINITY))
    }

    /// The one of them that says when it is as quiet as it gets: of what is never right, what it told.
    pub fn true_time_to(&self, codes: f64) -> Option<TimeToTarget> {
        if self.bias.is_some() { self.estimated_time_to(codes) } else { self.time_to(codes) }
    }

    fn crossing_of(&self, codes: f64, of: impl Fn(&Point) -> f64) -> Option<TimeToTarget> {
        let after = self.points.iter().position(|p| of(p) <= codes)?;
        let to = &self.points[after];
        let from = after.checked_sub(1).map(|i| &self.points[i]);
        let (weight, from) = match from {
            // A picture without any error left has no logarithm.
            Some(from) if of(to) > 0.0 && of(from).is_finite() => {
                ((of(from) / codes).ln() / (of(from) / of(to)).ln(), from)
            }
            _ => (1.0, to),
        };
        let between = |a: f64, b: f64| a * (b / a).powf(weight);
        let (before, after_it) = (self.seconds(from), self.seconds(to));
        let seconds: Vec<f64> =
            before.iter().zip(&after_it).map(|(a, b)| between(*a, *b)).collect();
        Some(TimeToTarget {
            codes,
            seconds: median(&seconds),
            spread: spread(&seconds),
            spp: between(from.spp, to.spp),
            at_most: after == 0,
        })
    }

    /// Samples per second over the whole way: median and spread of the repetitions.
    pub fn samples_per_second(&self) -> Option<(f64, f64)> {
        let last = self.points.last()?;
        let speeds: Vec<f64> = self.seconds(last).iter().map(|s| last.samples as f64 / s).collect();
        Some((median(&speeds), spread(&speeds)))
    }

    /// The order of convergence in linear radiance, without the first quarter of the points, which
    /// have too few samples for a law.
    pub fn slope(&self) -> Option<Slope> {
        let from = self.points.len() / 4;
        let points: Vec<_> =
            self.points[from..].iter().map(|p| (p.samples as f64, p.errors.rmse_linear)).collect();
        Slope::fit(&points)
    }

    /// 1 / (MSE x seconds) at the end, linear: what a second is worth.
    pub fn efficiency(&self) -> Option<f64> {
        let last = self.points.last()?;
        let cost = last.errors.rmse_linear.powi(2) * median(&self.seconds(last));
        (cost > 0.0).then(|| 1.0 / cost)
    }
}

impl Measurement {
    /// Of the times that are told: those to the targets, and those that settings are compared by.
    pub fn steadiness(&self) -> Steadiness {
        let mut all = Steadiness { repetitions: usize::MAX, spread: 0.0, stolen: None };
        for (i, measured) in self.measured.iter().enumerate() {
            let targets = self.targets.iter().filter(|_| i == 0).copied();
            for codes in targets.chain([self.compared_at]) {
                let Some(time_to) = measured.true_time_to(codes) else { continue };
                all.spread = all.spread.max(time_to.spread);
                all.repetitions = all.repetitions.min(measured.counted().len());
            }
            all.stolen = [all.stolen, measured.most_taken()].into_iter().flatten().reduce(f64::max);
        }
        if all.repetitions == usize::MAX {
            all.repetitions = 0;
        }
        all
    }

    /// The largest share by which another reference could change the errors that are told.
    pub fn reference_uncertainty(&self) -> f64 {
        let points = self.measured.iter().flat_map(|m| &m.points);
        let told = points.map(|p| p.errors.spread).filter(|spread| *spread <= DOUBTFUL);
        told.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::reference::Errors;

    fn measured(points: &[(f64, f64)]) -> Measured {
        let point = |(step, (spp, codes)): (usize, &(f64, f64))| Point {
            step: step + 1,
            samples: *spp as u64,
            spp: *spp,
            seconds: vec![*spp * 1e-3, *spp * 3e-3, *spp * 2e-3],
            told_codes: Some(2.0 * codes),
            errors: Errors {
                rmse_linear: codes / 255.0,
                rmse_codes: *codes,
                rel_mse: 0.0,
                spread: 0.0,
            },
        };
        Measured {
            topic: Experiment::Default,
            name: String::new(),
            threads: 1,
            points: points.iter().enumerate().map(point).collect(),
            stolen: vec![None; 3],
            bias: None,
        }
    }

    #[test]
    fn crossings_lie_on_the_power_law() {
        // error = 8 / sqrt(spp)
        let way = measured(&[(16.0, 2.0), (64.0, 1.0), (256.0, 0.5)]);
        let at = way.time_to(2f64.sqrt()).unwrap();
        assert!((at.spp - 32.0).abs() < 1e-9 && (at.seconds - 0.064).abs() < 1e-12, "{at:?}");
        assert!(!at.at_most && (at.spread - 1.0).abs() < 1e-12);
        assert!(way.time_to(3.0).unwrap().at_most);
        assert_eq!(way.time_to(0.4), None);
        assert!((way.estimated_time_to(2.0).unwrap().spp - 64.0).abs() < 1e-9);
        assert!((way.slope().unwrap().value + 0.5).abs() < 1e-12);
        assert!((way.samples_per_second().unwrap().0 - 500.0).abs() < 1e-9);
    }

    #[test]
    fn medians_and_spreads() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[1.0, 2.0]), 1.5);
        assert_eq!(spread(&[1.0, 2.0, 3.0]), 1.0);
        assert_eq!(spread(&[1.0, 2.0, 2.0, 2.0, 3.0]), 0.5);
        assert_eq!(spread(&[1.0, 9.0, 10.0, 10.0, 10.0, 10.0, 10.0, 11.0, 90.0]), 0.1);
        assert_eq!(spread(&[5.0]), 0.0);
        assert!(median(&[]).is_nan());
    }

    /// Measurements of normally scattered times, again and again: how often the second is as near to the
    /// first as the first says.
    #[test]
    fn a_spread_tells_where_another_measurement_will_be() {
        let mut state = 5u64;
        let mut time = || {
            1.0 + 0.03
                * (0..12).fold(-6.0, |sum, _| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    sum + (state >> 11) as f64 / (1u64 << 53) as f64
                })
        };
        for n in [3, 4, 5, 6, 8, 9, 15, 31] {
            let mut times = || (0..n).map(|_| time()).collect::<Vec<f64>>();
            let near = |(a, b): &(Vec<f64>, Vec<f64>)| {
                (median(a) - median(b)).abs() <= spread(a) * median(a)
            };
            let near = (0..2000).map(|_| (times(), times())).filter(near).count();
            assert!(near > 1560, "{n} repetitions: {near} of 2000");
        }
    }

    /// Two repetitions of nine were disturbed: they do not count. Of nine disturbed ones the five
    /// calmest do, and it is said how disturbed they were.
    #[test]
    fn disturbed_repetitions_do_not_count() {
        let mut way = measured(&[(16.0, 2.0), (64.0, 1.0), (256.0, 0.5)]);
        for point in &mut way.points {
            let first = point.spp * 1e-3;
            point.seconds = (0..9).map(|i| first * [1.0, 3.0, 1.0, 1.1][i % 4]).collect();
        }
        way.stolen = [0.0, 0.4, 0.01, 0.0].into_iter().cycle().take(9).map(Some).collect();
        let at = way.time_to(1.0).unwrap();
        assert!((at.seconds - 0.064).abs() < 1e-12 && (at.spread - 0.05).abs() < 1e-9, "{at:?}");
        let mut measurement = Measurement {
            size: [1, 1],
            reference_spp: 0.0,
            reference_codes: 0.0,
            reference_linear: 0.0,
            reference_seconds: 0.0,
            compared_at: 0.5,
            targets: vec![1.0, 0.25],
            expected: Vec::new(),
            idle: Vec::new(),
            measured: vec![way],
        };
        let steady = measurement.steadiness();
        assert_eq!((steady.repetitions, steady.stolen), (7, Some(0.01)));
        measurement.measured[0].stolen = (0..9).map(|i| Some(0.1 + 0.1 * f64::from(i))).collect();
        let steady = measurement.steadiness();
        assert_eq!(steady.repetitions, 5);
        assert!((steady.stolen.unwrap() - 0.5).abs() < 1e-12);
        assert!((steady.spread - 1.0).abs() < 1e-9, "1, 3, 1, 1.1, 1: {steady:?}");
    }

    /// An error that the reference's own drowns is no answer.
    #[test]
    fn a_doubtful_error_reaches_no_target() {
        let mut way = measured(&[(16.0, 2.0), (64.0, 1.0), (256.0, 0.5)]);
        way.points[2].errors.spread = 0.3;
        assert!(way.time_to(1.0).is_some());
        assert_eq!(way.time_to(0.5), None);
    }
}
