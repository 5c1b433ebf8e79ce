//! Convergence fit: the RMSE of the whole picture as a function of the number of rays, extrapolated
//! to an error target.

use crate::schedule::tile::{FLATTEST, STEEPEST, clamp_slope};

/// Largest number of points of the convergence fit. A point is a number of rays and the picture's
/// RMSE after them. From one point to the next, except to the latest one, the rays grow by a factor
/// of at least sqrt(2). Seven points span three doublings if all factors are sqrt(2).
const POINTS: usize = 7;

/// Relative uncertainty of the extrapolated number of rays left until an error target, even if the
/// convergence slope is well fitted. The slope decreases a little during the render, because the
/// rays of exploration (samples for the tiles with the fewest samples) reduce the error less and
/// less. At a slope of 0.75, a render over two doublings of the rays therefore needs 4 to 10 % more
/// rays than the extrapolation predicts.
const SPREAD: f64 = 0.15;

/// Convergence fit: RMSE of the picture as a function of the number of rays, at up to seven numbers
/// of rays. They span about three doublings of the rays, or more if the rays grew in large steps.
#[derive(Clone, Debug, Default)]
pub(super) struct ConvergenceFit {
    /// Recorded points, oldest first, each as `(number of rays, RMSE of the picture)`.
    pub points: Vec<(f64, f64)>,
}

impl ConvergenceFit {
    /// Records that the picture's RMSE was `noise` after `rays` rays.
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

    /// Returns a lower and an upper estimate of the total number of rays at which the picture's
    /// RMSE falls to `target`. The RMSE is extrapolated with the steepest and with the flattest of
    /// three slopes: those over the latest two, four and six steps between recorded points, that
    /// is, over about one, two and three doublings of the rays. Before the first two steps, the
    /// largest and the smallest plausible slope are used instead. Returns `None` if nothing has
    /// been recorded.
    pub fn rays_needed(&self, target: f64) -> Option<(f64, f64)> {
        let (rays, noise) = *self.points.last()?;
        if noise <= target {
            return Some((rays, rays));
        }
        let slopes = [2, 4, 6].into_iter().filter_map(|back| {
            let (rays0, noise0) = *self.points.get(self.points.len().checked_sub(back + 1)?)?;
            Some(clamp_slope((noise0 / noise).ln() / (rays / rays0).ln()))
        });
        let (flat, steep) = slopes
            .map(|p| (p, p))
            .reduce(|(low, high), (p, _)| (low.min(p), high.max(p)))
            .unwrap_or((FLATTEST, STEEPEST));
        let additional = |p: f64| rays * ((noise / target).powf(1.0 / p) - 1.0);
        Some((rays + additional(steep) * (1.0 - SPREAD), rays + additional(flat) * (1.0 + SPREAD)))
    }

    /// Returns the slope p of the fit RMSE ~ rays^-p through the first and the last of the (up to
    /// seven) latest points. If there are fewer than two points, p is 0.5, the slope of independent
    /// samples.
    pub fn slope(&self) -> f64 {
        self.fitted_slope().unwrap_or(0.5)
    }

    /// Returns [`ConvergenceFit::slope`]. Returns `None` if there are fewer than two recorded
    /// points.
    pub fn fitted_slope(&self) -> Option<f64> {
        let (r0, n0) = *self.points.first()?;
        let (r1, n1) = *self.points.last()?;
        (r1 > r0).then(|| clamp_slope((n0 / n1).ln() / (r1 / r0).ln()))
    }
}
