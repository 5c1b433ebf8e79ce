//! Results of a measurement.

use crate::measure::convergence_order::Slope;
use crate::measure::error_curve::Point;
use crate::measure::experiment::{Experiment, Variant};
use crate::measure::reference_image::{Bias, Reference};
use serde::Serialize;

/// Time at which a render reached a noise target. The fields are keys of JSON files.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TimeToTarget {
    /// Noise target in 8-bit levels.
    pub levels: f64,
    /// Median seconds of tracing over the repetitions.
    pub seconds: f64,
    /// Value of [`spread`] over the repetitions.
    pub spread: f64,
    /// Mean number of samples per pixel.
    pub spp: f64,
}

/// Extrapolated time to a noise target that the default settings did not reach. The fields are keys
/// of JSON files.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Expected {
    pub levels: f64,
    /// Lower estimate of the seconds.
    pub seconds_low: f64,
    /// Upper estimate of the seconds.
    pub seconds_high: f64,
}

/// Median over the repetitions of a render, with its relative [`spread`].
#[derive(Clone, Copy, Debug)]
pub struct Median {
    pub value: f64,
    pub spread: f64,
}

/// Results of one variant of the settings.
#[derive(Clone, Debug)]
pub struct Measured {
    pub variant: Variant,
    /// Error curve, in ascending order of sample count.
    pub points: Vec<Point>,
    /// Bias at the end of the error curve. `None` for unbiased experiments.
    pub bias: Option<Bias>,
}

/// Results of all variants of the settings on one scene.
pub struct Measurement {
    pub size: [u32; 2],
    /// Name of the SIMD type, such as `f32x8`.
    pub lanes: &'static str,
    pub reference: Reference,
    /// Noise at which all settings are compared, in 8-bit levels. The default settings reached it.
    pub compared_at: f64,
    /// Noise targets in 8-bit levels, in descending order.
    pub targets: Vec<f64>,
    /// Extrapolated times to the noise targets that the default settings did not reach.
    pub expected: Vec<Expected>,
    /// Experiments without a variant that differs from the default settings in this scene.
    pub idle: Vec<&'static Experiment>,
    /// Results of the variants, the default first.
    pub measured: Vec<Measured>,
}

/// Largest relative uncertainty of a measured error, caused by the error of the reference. Points
/// with a larger uncertainty are ignored.
const MAX_SPREAD: f64 = 0.05;

/// Half-width of the confidence interval of a median of n values by the sign test, in standard
/// deviations of the rank. One standard deviation is sqrt(n) / 2 ranks. The factor 1.4 covers 84 %;
/// sqrt 2 widens the interval to that of the difference of two medians.
const CERTAINTY: f64 = 1.4 * std::f64::consts::SQRT_2;

/// Returns the median of `values`, or NaN if there are none.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        n if n % 2 == 1 => sorted[n / 2],
        n => sorted[n / 2 - 1] + 0.5 * (sorted[n / 2] - sorted[n / 2 - 1]),
    }
}

/// Returns the relative spread of the median of `values`. The median of another measurement on the
/// same machine differs by at most this fraction in about four of five cases.
///
/// It is half the width of the confidence interval of the median by the sign test (Conover,
/// *Practical Nonparametric Statistics*), divided by the median. The interval is widened by sqrt 2
/// for the comparison of two medians. For fewer than five values the spread is their range divided
/// by the median; for fewer than two, or if the median is 0, it is 0.
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

impl Measured {
    /// Returns the time at which the true error fell to `levels` 8-bit levels. Returns `None` if it
    /// stayed larger. Points with an uncertain error are ignored.
    pub fn time_to(&self, levels: f64) -> Option<TimeToTarget> {
        self.interpolated_time(levels, |p| {
            let certain = p.errors.spread <= MAX_SPREAD;
            if certain { p.errors.rmse_levels } else { f64::INFINITY }
        })
    }

    /// Returns the time at which the error fell to `levels` 8-bit levels. For biased variants,
    /// whose true error does not converge to 0, it is the error that the render estimates.
    pub fn true_time_to(&self, levels: f64) -> Option<TimeToTarget> {
        match self.bias {
            Some(_) => {
                self.interpolated_time(levels, |p| p.estimated_levels.unwrap_or(f64::INFINITY))
            }
            None => self.time_to(levels),
        }
    }

    /// Returns the time at which `error` fell to `levels`, interpolated in log-log coordinates. If
    /// the first point is below `levels` already, returns its time.
    fn interpolated_time(
        &self,
        levels: f64,
        error: impl Fn(&Point) -> f64,
    ) -> Option<TimeToTarget> {
        let after = self.points.iter().position(|p| error(p) <= levels)?;
        let to = &self.points[after];
        let from = after.checked_sub(1).map(|i| &self.points[i]);
        let (weight, from) = match from {
            // The interpolation takes the logarithms of both errors.
            Some(from) if error(to) > 0.0 && error(from).is_finite() => {
                ((error(from) / levels).ln() / (error(from) / error(to)).ln(), from)
            }
            _ => (1.0, to),
        };
        let between = |a: f64, b: f64| a * (b / a).powf(weight);
        let both = from.seconds.iter().zip(&to.seconds);
        let seconds: Vec<f64> = both.map(|(a, b)| between(*a, *b)).collect();
        Some(TimeToTarget {
            levels,
            seconds: median(&seconds),
            spread: spread(&seconds),
            spp: between(from.spp, to.spp),
        })
    }

    /// Returns the samples traced per second until the last point of the error curve. Returns `None`
    /// without points.
    pub fn samples_per_second(&self) -> Option<Median> {
        let last = self.points.last()?;
        let speeds: Vec<f64> = last.seconds.iter().map(|s| last.samples as f64 / s).collect();
        Some(Median { value: median(&speeds), spread: spread(&speeds) })
    }

    /// Returns the order of convergence of the linear RMSE. The first quarter of the points is left
    /// out, because so few samples follow no power law. Returns `None` if too few points remain.
    pub fn slope(&self) -> Option<Slope> {
        let from = self.points.len() / 4;
        let points: Vec<_> =
            self.points[from..].iter().map(|p| (p.samples as f64, p.errors.rmse_linear)).collect();
        Slope::fit(&points)
    }
}

impl Measurement {
    /// Returns the results of the default settings, which are always measured.
    pub fn default(&self) -> &Measured {
        &self.measured[0]
    }

    /// Returns the smallest number of renders over which a reported median was taken.
    pub fn repetitions(&self) -> usize {
        let points = self.measured.iter().filter_map(|measured| measured.points.first());
        points.map(|point| point.seconds.len()).min().unwrap_or(0)
    }

    /// Returns the largest relative uncertainty that the error of the reference causes in the
    /// reported errors.
    pub fn reference_uncertainty(&self) -> f64 {
        let points = self.measured.iter().flat_map(|m| &m.points);
        let reported = points.map(|p| p.errors.spread).filter(|spread| *spread <= MAX_SPREAD);
        reported.fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::Plan;
    use crate::measure::reference_image::Errors;
    use std::sync::Arc;
    use zerkalo_render::film::testing::Rng;

    fn measured(points: &[(f64, f64)]) -> Measured {
        let point = |(step, (spp, levels)): (usize, &(f64, f64))| Point {
            step: step + 1,
            samples: *spp as u64,
            spp: *spp,
            seconds: vec![*spp * 1e-3, *spp * 3e-3, *spp * 2e-3],
            estimated_levels: Some(2.0 * levels),
            errors: Errors { rmse_linear: levels / 255.0, rmse_levels: *levels, spread: 0.0 },
            parts: None,
        };
        let points = points.iter().enumerate().map(point).collect();
        Measured {
            variant: Plan::default().variants(&Arc::default()).remove(0),
            points,
            bias: None,
        }
    }

    #[test]
    fn times_are_interpolated_on_the_power_law() {
        // The error of the curve is 8 / sqrt(spp).
        let curve = measured(&[(16.0, 2.0), (64.0, 1.0), (256.0, 0.5)]);
        let target = curve.time_to(2f64.sqrt()).unwrap();
        assert!(
            (target.spp - 32.0).abs() < 1e-9 && (target.seconds - 0.064).abs() < 1e-12,
            "{target:?}"
        );
        assert!((target.spread - 1.0).abs() < 1e-12);
        assert_eq!(curve.time_to(3.0).unwrap().spp, 16.0, "no earlier picture");
        assert_eq!(curve.time_to(0.4), None);
        let bias = Some(Bias { z: 0.0, levels: 0.0, least_levels: 0.0 });
        let biased = Measured { bias, ..curve.clone() };
        assert!((biased.true_time_to(2.0).unwrap().spp - 64.0).abs() < 1e-9);
        assert!((curve.slope().unwrap().value + 0.5).abs() < 1e-12);
        assert!((curve.samples_per_second().unwrap().value - 500.0).abs() < 1e-9);
    }

    #[test]
    fn medians_and_spreads_of_known_values() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[1.0, 2.0]), 1.5);
        assert_eq!(spread(&[1.0, 2.0, 3.0]), 1.0);
        assert_eq!(spread(&[1.0, 2.0, 2.0, 2.0, 3.0]), 0.5);
        assert_eq!(spread(&[1.0, 9.0, 10.0, 10.0, 10.0, 10.0, 10.0, 11.0, 90.0]), 0.1);
        assert_eq!(spread(&[5.0]), 0.0);
        assert!(median(&[]).is_nan());
    }

    /// Checks the predicted spread of measured times with simulated, normally distributed times.
    /// The median of a second measurement is within the spread of the first in about four of five
    /// cases.
    #[test]
    fn spread_predicts_the_median_of_another_measurement() {
        let mut rng = Rng(5);
        let mut time = || 1.0 + 0.03 * rng.normal();
        for n in [3, 4, 5, 6, 8, 9, 15, 31] {
            let mut times = || (0..n).map(|_| time()).collect::<Vec<f64>>();
            let near = |(a, b): &(Vec<f64>, Vec<f64>)| {
                (median(a) - median(b)).abs() <= spread(a) * median(a)
            };
            let near = (0..2000).map(|_| (times(), times())).filter(near).count();
            assert!(near > 1560, "{n} repetitions: {near} of 2000");
        }
    }

    /// Checks that a measured error never counts as having reached a target if the reference
    /// picture makes it too uncertain.
    #[test]
    fn uncertain_error_reaches_no_target() {
        let mut curve = measured(&[(16.0, 2.0), (64.0, 1.0), (256.0, 0.5)]);
        curve.points[2].errors.spread = 0.3;
        assert!(curve.time_to(1.0).is_some());
        assert_eq!(curve.time_to(0.5), None);
    }
}
