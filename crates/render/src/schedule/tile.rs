//! State of one tile in the schedule: sample counts and noise estimates.

use crate::film::{ByMeasure, TileNoise};
use crate::schedule::{Criterion, USUAL_SLOPE};
use crate::wave::JobReport;

/// Largest number of doublings of the sample count over which a tile's slope is fitted.
pub(super) const DOUBLINGS: u32 = 3;

#[derive(Clone, Debug, Default)]
pub(super) struct Tile {
    /// Number of the tile's pixels inside the picture.
    pub pixels: u32,
    /// Samples per pixel in replicate B. Between two rounds, replicate A has equally many.
    pub done: u32,
    pub rays: u64,
    /// `true` if a path in the tile has made a random choice.
    pub glossy: bool,
    /// `true` if the tile gets only the samples that the first noise estimate needs.
    pub rests: bool,
    /// Latest noise estimate.
    pub error: Option<TileNoise>,
    /// Noise estimates from which the slope is fitted, oldest first. From one estimate to the next
    /// the sample count at least doubles. The last one may be equal to `error`.
    pub history: Vec<TileNoise>,
}

impl Tile {
    /// Records the report of a job. An estimate from at least `light_period` samples discards the
    /// estimates from fewer samples.
    pub fn record(&mut self, report: &JobReport, light_period: u32) {
        self.rays += report.rays;
        self.glossy |= report.glossy;
        if let Some(error) = report.error {
            if error.samples >= light_period {
                self.history.retain(|estimate| estimate.samples >= light_period);
            }
            self.record_error(error);
        }
    }

    pub fn forget_estimates(&mut self) {
        self.error = None;
        self.history.clear();
    }

    /// Replaces all noise estimates by `estimate`; `None` if the tile has too few samples for one.
    pub fn set_estimate(&mut self, estimate: Option<TileNoise>) {
        self.forget_estimates();
        if let Some(error) = estimate {
            self.record_error(error);
        }
    }

    pub fn record_error(&mut self, error: TileNoise) {
        self.error = Some(error);
        if self.history.last().is_none_or(|before| error.samples / 2 >= before.samples) {
            self.history.push(error);
            if self.history.len() > DOUBLINGS as usize + 1 {
                self.history.remove(0);
            }
        }
    }

    /// Returns the mean number of rays per sample; at least 1, for the camera ray.
    pub fn rays_per_sample(&self) -> f64 {
        let samples = 2.0 * f64::from(self.done) * f64::from(self.pixels);
        (self.rays as f64 / samples.max(1.0)).max(1.0)
    }

    /// Returns the latest validation estimate of the mean squared error; 0 before the first.
    pub fn mse(&self, criterion: Criterion) -> f64 {
        self.error.map_or(0.0, |e| criterion.of(e.reported))
    }

    /// Iterates over the estimates: sample count, then the mean squared errors of the allocation
    /// and the validation estimate.
    pub fn estimates(&self, criterion: Criterion) -> impl Iterator<Item = (f64, [f64; 2])> {
        let latest = self.error.filter(|e| self.history.last() != Some(e));
        let all = self.history.iter().copied().chain(latest);
        all.map(move |e| {
            (f64::from(e.samples), [e.allocation, e.reported].map(|mse| criterion.of(mse)))
        })
    }

    /// Returns the estimate before the latest `doublings` doublings of the sample count, or the
    /// oldest estimate if there were fewer. It is scaled to the present count as [`USUAL_SLOPE`]
    /// predicts. Returns `None` before the first estimate.
    pub fn earlier_estimate(&self, doublings: usize) -> Option<TileNoise> {
        let latest = self.error?;
        let earlier = self.history.iter().rev().nth(doublings).or(self.history.first())?;
        let growth = f64::from(latest.samples) / f64::from(earlier.samples);
        let factor = growth.powf(-2.0 * USUAL_SLOPE);
        let scaled =
            |mse: ByMeasure| ByMeasure { linear: factor * mse.linear, levels: factor * mse.levels };
        let (reported, allocation) = (scaled(earlier.reported), scaled(earlier.allocation));
        Some(TileNoise { reported, allocation, ..latest })
    }

    /// Returns (sample count, allocation estimate) before and after the latest doubling. Returns
    /// `None` before the first doubling.
    pub fn last_doubling(&self, criterion: Criterion) -> Option<[(f64, f64); 2]> {
        let [.., before, after] = self.history.as_slice() else { return None };
        Some([before, after].map(|e| (f64::from(e.samples), criterion.of(e.allocation))))
    }

    /// Returns the slope of the tile's error, a weighted mean of two slopes. The slope between the
    /// tile's first and last estimate has the number of doublings between them as weight. `pooled`,
    /// the slope over all similar tiles, has the weight of two doublings. The estimate of one tile
    /// is uncertain by 5 to 35 %, a slope over one doubling therefore by 0.05 to 0.4. Returns
    /// `pooled` before the first doubling, or if an error is 0.
    pub fn slope(&self, criterion: Criterion, pooled: f64) -> f64 {
        const PRIOR_DOUBLINGS: f64 = 2.0;
        let [first, .., last] = self.history.as_slice() else { return pooled };
        let (before, after) = (criterion.of(first.allocation), criterion.of(last.allocation));
        if !(before > 0.0 && after > 0.0) {
            return pooled;
        }
        let doublings = (f64::from(last.samples) / f64::from(first.samples)).log2();
        let fitted = 0.5 * (before / after).log2() / doublings;
        clamp_slope((doublings * fitted + PRIOR_DOUBLINGS * pooled) / (doublings + PRIOR_DOUBLINGS))
    }
}

/// Slope of independent samples. A smaller fitted slope is chance.
pub(super) const FLATTEST: f64 = 0.5;
/// Largest plausible slope. A larger fitted slope is chance.
pub(super) const STEEPEST: f64 = 1.0;

/// Clamps a slope to [`FLATTEST`]..=[`STEEPEST`]; NaN becomes [`FLATTEST`].
pub(super) fn clamp_slope(p: f64) -> f64 {
    if p.is_nan() { FLATTEST } else { p.clamp(FLATTEST, STEEPEST) }
}
