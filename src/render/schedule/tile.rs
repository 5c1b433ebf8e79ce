//! What the schedule remembers of one tile.

use crate::film::TileNoise;
use crate::render::schedule::Criterion;
use crate::render::wave::JobReport;

/// The most doublings of the sample count over which a slope is fitted.
const DOUBLINGS: u32 = 3;

/// One tile.
#[derive(Clone, Debug)]
pub(super) struct Tile {
    /// Pixels (fewer in the tiles at the right and lower edge).
    pub pixels: u32,
    /// Samples per pixel of each replicate; the same for A and B whenever something is decided.
    pub done: u32,
    /// Rays spent.
    pub rays: u64,
    /// Whether a path met a glossy lobe.
    pub glossy: bool,
    /// Latest estimate of the mean squared error, and for how many samples per replicate it holds.
    pub error: Option<(u32, TileNoise)>,
    /// Estimates at counts that at least doubled from one to the next, oldest first.
    history: Vec<(u32, TileNoise)>,
}

impl Tile {
    pub fn new(pixels: u32) -> Self {
        Self { pixels, done: 0, rays: 0, glossy: false, error: None, history: Vec::new() }
    }

    /// Takes in a report that came when the replicates held `count` samples per pixel each.
    pub fn note(&mut self, report: &JobReport, count: u32) {
        self.rays += report.rays;
        self.glossy |= report.glossy;
        if let Some(error) = report.error {
            self.note_error(error, count);
        }
    }

    /// Forgets all estimates.
    pub fn forget_estimates(&mut self) {
        self.error = None;
        self.history.clear();
    }

    /// Takes in the first estimate after they were forgotten.
    pub fn set_estimate(&mut self, estimate: Option<(u32, TileNoise)>) {
        self.forget_estimates();
        if let Some((count, error)) = estimate {
            self.note_error(error, count);
        }
    }

    fn note_error(&mut self, error: TileNoise, count: u32) {
        self.error = Some((count, error));
        if self.history.last().is_none_or(|(before, _)| count / 2 >= *before) {
            self.history.push((count, error));
            if self.history.len() > DOUBLINGS as usize + 1 {
                self.history.remove(0);
            }
        }
    }

    /// Rays per sample of one pixel; at least one, the camera's.
    pub fn rays_per_sample(&self) -> f64 {
        let samples = 2.0 * f64::from(self.done) * f64::from(self.pixels);
        (self.rays as f64 / samples.max(1.0)).max(1.0)
    }

    /// Latest mean squared error, as it is told; 0 before the first estimate.
    pub fn mse(&self, criterion: Criterion) -> f64 {
        self.error.map_or(0.0, |(_, e)| criterion.of(e.reported))
    }

    /// The estimates on record and the latest: counts, and mean squared errors of the pixels for allocation and of those
    /// for validation.
    pub fn estimates(&self, criterion: Criterion) -> impl Iterator<Item = (f64, [f64; 2])> {
        let latest = self.error.filter(|e| self.history.last() != Some(e));
        let all = self.history.iter().copied().chain(latest);
        all.map(move |(n, e)| {
            (f64::from(n), [e.allocation, e.reported].map(|mse| criterion.of(mse)))
        })
    }

    /// The last doubling on record: counts and errors before and after.
    pub fn last_doubling(&self, criterion: Criterion) -> Option<[(f64, f64); 2]> {
        let [.., before, after] = self.history.as_slice() else { return None };
        Some([before, after].map(|(n, e)| (f64::from(*n), criterion.of(e.allocation))))
    }

    /// The slope p of RMSE ~ n^-p.
    ///
    /// Fitted through the first and the last estimate on record and drawn towards `pooled`, the slope
    /// of all tiles like this one, which weighs as much as two doublings: the estimate of one tile
    /// is uncertain by 5 to 35 per cent, so that a slope over one doubling is by 0.05 to 0.4.
    pub fn slope(&self, criterion: Criterion, pooled: f64) -> f64 {
        const PRIOR_DOUBLINGS: f64 = 2.0;
        let [(n0, first), .., (n1, last)] = self.history.as_slice() else { return pooled };
        let (before, after) = (criterion.of(first.allocation), criterion.of(last.allocation));
        if !(before > 0.0 && after > 0.0) {
            return pooled;
        }
        let doublings = (f64::from(*n1) / f64::from(*n0)).log2();
        let fitted = 0.5 * (before / after).log2() / doublings;
        clamp_slope((doublings * fitted + PRIOR_DOUBLINGS * pooled) / (doublings + PRIOR_DOUBLINGS))
    }
}

/// The slope of independent samples; a flatter one is chance.
pub(super) const FLATTEST: f64 = 0.5;
/// A steeper slope is chance.
pub(super) const STEEPEST: f64 = 1.0;

/// A slope as it can be.
pub(super) fn clamp_slope(p: f64) -> f64 {
    if p.is_nan() { FLATTEST } else { p.clamp(FLATTEST, STEEPEST) }
}
