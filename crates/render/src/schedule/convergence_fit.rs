//! Convergence fit: the RMSE of the whole picture over the number of rays, extrapolated to an error
//! target.

use crate::schedule::tile::{FLATTEST, STEEPEST, clamp_slope};

/// Largest number of points of the fit. From one point to the next, except to the latest one, the
/// rays grow by a factor of at least sqrt(2). Seven points therefore span three doublings or more.
const POINTS: usize = 7;

/// Relative uncertainty of the extrapolated rays, even if the slope is well fitted. The slope
/// decreases a little during a render, because exploration reduces the error less and less. Two
/// doublings at a slope of 0.75 need 4 to 10 % more rays than extrapolated.
const SPREAD: f64 = 0.15;

/// Interval estimate of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    /// Creates the interval that holds only `number`.
    pub fn exact(number: f64) -> Self {
        Self { low: number, high: number }
    }

    /// Returns the expected number.
    pub fn mean(self) -> f64 {
        0.5 * (self.low + self.high)
    }

    /// Applies `f`, which must be increasing, to both ends.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self { low: f(self.low), high: f(self.high) }
    }
}

#[derive(Clone, Debug, Default)]
pub(super) struct ConvergenceFit {
    /// Points (number of rays, RMSE of the picture), oldest first.
    pub points: Vec<(f64, f64)>,
}

impl ConvergenceFit {
    /// Adds a point, or replaces the latest one. Ignores a point without rays or noise.
    pub fn record(&mut self, rays: f64, noise: f64) {
        if !(rays > 0.0 && noise > 0.0) {
            return;
        }
        // The latest point is replaced until its rays exceed those of the point before by a factor
        // of sqrt(2).
        if let [.., (before, _), (latest, _)] = self.points.as_slice()
            && *latest < before * std::f64::consts::SQRT_2
        {
            self.points.pop();
        }
        self.points.push((rays, noise));
        if self.points.len() > POINTS {
            self.points.remove(0);
        }
    }

    /// Estimates the total number of rays at which the RMSE falls to `target`. Three slopes are
    /// fitted, over the latest two, four and six intervals between points. The steepest slope gives
    /// the lower end, the flattest slope the upper one. Before there are two intervals,
    /// [`STEEPEST`] and [`FLATTEST`] are used. Returns `None` before the first point.
    pub fn rays_needed(&self, target: f64) -> Option<Interval> {
        let (rays, noise) = *self.points.last()?;
        if noise <= target {
            return Some(Interval::exact(rays));
        }
        let slopes = [2, 4, 6].into_iter().filter_map(|back| {
            let (rays0, noise0) = *self.points.get(self.points.len().checked_sub(back + 1)?)?;
            Some(clamp_slope((noise0 / noise).ln() / (rays / rays0).ln()))
        });
        let slopes = slopes
            .map(Interval::exact)
            .reduce(|all, p| Interval { low: all.low.min(p.low), high: all.high.max(p.high) });
        let slopes = slopes.unwrap_or(Interval { low: FLATTEST, high: STEEPEST });
        let additional = |p: f64| rays * ((noise / target).powf(1.0 / p) - 1.0);
        Some(Interval {
            low: rays + additional(slopes.high) * (1.0 - SPREAD),
            high: rays + additional(slopes.low) * (1.0 + SPREAD),
        })
    }

    /// Returns the slope p of the fit RMSE ~ rays^-p, through the first and the last point. Returns
    /// `None` before there are two points.
    pub fn fitted_slope(&self) -> Option<f64> {
        let (r0, n0) = *self.points.first()?;
        let (r1, n1) = *self.points.last()?;
        (r1 > r0).then(|| clamp_slope((n0 / n1).ln() / (r1 / r0).ln()))
    }
}
