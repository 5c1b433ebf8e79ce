//! State of one tile in the schedule: sample counts and noise estimates.

use crate::film::{Mse, TileNoise};
use crate::schedule::{Criterion, USUAL_SLOPE};
use crate::wave::JobReport;

/// Largest number of doublings of a tile's sample count over which the slope of its error is
/// fitted.
pub(super) const DOUBLINGS: u32 = 3;

/// Sample counts and noise estimates of one tile.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    /// Number of the tile's pixels that are inside the picture, fewer at the right and lower edge.
    pub pixels: u32,
    /// Number of samples per pixel in each replicate of the tile. The replicates A and B are the
    /// two halves of the samples; between two allocation rounds they have equal numbers.
    pub done: u32,
    /// Number of rays traced in the tile so far.
    pub rays: u64,
    /// `true` if a path in the tile has made a random choice, such as a direction of a glossy lobe.
    pub glossy: bool,
    /// Latest noise estimate of the tile. `None` before the first estimate.
    pub error: Option<TileNoise>,
    /// Noise estimates of the tile from which its error over the sample count is fitted, oldest
    /// first. From one entry to the next the sample count at least doubles. The last entry may be
    /// the latest estimate.
    pub history: Vec<TileNoise>,
}

impl Tile {
    pub fn new(pixels: u32) -> Self {
        Self { pixels, done: 0, rays: 0, glossy: false, error: None, history: Vec::new() }
    }

    /// Records the report of a job of this tile. If the report has an estimate from at least
    /// `light_period` samples per replicate (half of the samples), earlier estimates from fewer
    /// samples are discarded.
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

    /// Discards all noise estimates of the tile.
    pub fn forget_estimates(&mut self) {
        self.error = None;
        self.history.clear();
    }

    /// Replaces all noise estimates of the tile by `estimate`; `None` if the tile has too few
    /// samples for an estimate.
    pub fn set_estimate(&mut self, estimate: Option<TileNoise>) {
        self.forget_estimates();
        if let Some(error) = estimate {
            self.record_error(error);
        }
    }

    fn record_error(&mut self, error: TileNoise) {
        self.error = Some(error);
        if self.history.last().is_none_or(|before| error.samples / 2 >= before.samples) {
            self.history.push(error);
            if self.history.len() > DOUBLINGS as usize + 1 {
                self.history.remove(0);
            }
        }
    }

    /// Returns the mean number of rays per sample in the tile; at least 1, for the camera ray.
    pub fn rays_per_sample(&self) -> f64 {
        let samples = 2.0 * f64::from(self.done) * f64::from(self.pixels);
        (self.rays as f64 / samples.max(1.0)).max(1.0)
    }

    /// Returns the latest validation estimate of the tile's mean squared error, from the pixels
    /// that do not select tiles for more samples. It is the reported error; 0 before the first
    /// estimate.
    pub fn mse(&self, criterion: Criterion) -> f64 {
        self.error.map_or(0.0, |e| criterion.of(e.reported))
    }

    /// Iterates over all noise estimates of the tile. Each item is `(sample count, [MSE of
    /// allocation pixels, MSE of validation pixels])`. MSE is the mean squared error. Allocation
    /// pixels select tiles for more samples; the error of validation pixels is reported.
    pub fn estimates(&self, criterion: Criterion) -> impl Iterator<Item = (f64, [f64; 2])> {
        let latest = self.error.filter(|e| self.history.last() != Some(e));
        let all = self.history.iter().copied().chain(latest);
        all.map(move |e| {
            (f64::from(e.samples), [e.allocation, e.reported].map(|mse| criterion.of(mse)))
        })
    }

    /// Returns the noise estimate that the tile had before its latest `doublings` doublings of the
    /// sample count, scaled to the present sample count as [`USUAL_SLOPE`] predicts. Returns the
    /// oldest estimate, scaled, if there were fewer doublings, and `None` if there is no estimate.
    pub fn earlier_estimate(&self, doublings: usize) -> Option<TileNoise> {
        let latest = self.error?;
        let earlier = self.history.iter().rev().nth(doublings).or(self.history.first())?;
        let growth = f64::from(latest.samples) / f64::from(earlier.samples);
        let factor = growth.powf(-2.0 * USUAL_SLOPE);
        let scaled = |mse: Mse| Mse { linear: factor * mse.linear, levels: factor * mse.levels };
        let (reported, allocation) = (scaled(earlier.reported), scaled(earlier.allocation));
        Some(TileNoise { reported, allocation, ..latest })
    }

    /// Returns two noise estimates: the one before and the one after the latest doubling of the
    /// tile's sample count. Each estimate is `(sample count, mean squared error of allocation
    /// pixels)`. Allocation pixels select tiles for more samples. Returns `None` before the first
    /// doubling.
    pub fn last_doubling(&self, criterion: Criterion) -> Option<[(f64, f64); 2]> {
        let [.., before, after] = self.history.as_slice() else { return None };
        Some([before, after].map(|e| (f64::from(e.samples), criterion.of(e.allocation))))
    }

    /// Returns the slope p with which the tile's RMSE falls with the sample count n: RMSE ~ n^-p.
    ///
    /// It is the weighted mean of two slopes. One is fitted through the tile's first and last
    /// estimate; its weight is the number of doublings of the sample count between them. The other
    /// is `pooled`, the slope over all similar tiles, with the weight of two doublings. The
    /// estimate of one tile is uncertain by 5 to 35 per cent; a slope over one doubling is
    /// therefore uncertain by 0.05 to 0.4. Returns `pooled` before the first doubling, or if an
    /// error is 0.
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

/// Convergence slope p of independent samples, RMSE ~ n^-p. A smaller fitted slope is regarded as
/// chance.
pub(super) const FLATTEST: f64 = 0.5;
/// Largest plausible convergence slope p, RMSE ~ n^-p. A larger fitted slope is regarded as chance.
pub(super) const STEEPEST: f64 = 1.0;

/// Clamps a convergence slope to [`FLATTEST`]..=[`STEEPEST`]; NaN becomes [`FLATTEST`].
pub(super) fn clamp_slope(p: f64) -> f64 {
    if p.is_nan() { FLATTEST } else { p.clamp(FLATTEST, STEEPEST) }
}
