//! Changes during the work: stop criteria, cap, and new estimates for the samples at hand.

use crate::film::TileNoise;
use crate::render::schedule::tile::Tile;
use crate::render::schedule::{ConvergenceFit, Schedule, Stop};

impl Schedule {
    /// Sets the stop criteria. Finished work resumes if they are not reached.
    pub fn set_stop(&mut self, stop: Stop) {
        self.settings.stop = stop;
    }

    /// Sets the cap on samples per pixel of glossy tiles; see
    /// [`Settings::rays_per_pixel`](crate::render::schedule::Settings::rays_per_pixel).
    pub fn set_rays_per_pixel(&mut self, cap: u32) {
        self.settings.rays_per_pixel = cap;
    }

    /// Discards every estimate: the samples stay, but their light weights or their display have changed. The
    /// noise is unknown until [`Schedule::set_estimates`].
    pub fn forget_estimates(&mut self) {
        self.tiles.iter_mut().for_each(Tile::forget_estimates);
        self.noise = None;
        // The convergence of the old picture does not apply to the new one.
        self.convergence = ConvergenceFit::default();
    }

    /// Sets the estimates of all tiles, row by row, made between two waves: `(count, error)` for `count` samples
    /// per replicate, or `None` for too few samples.
    pub fn set_estimates(&mut self, estimates: &[Option<(u32, TileNoise)>]) {
        for (tile, estimate) in self.tiles.iter_mut().zip(estimates) {
            tile.set_estimate(*estimate);
        }
        // The current decision may have been made without a final estimate.
        self.estimate |= self.tiles.iter().all(|t| t.error.is_some());
        self.update_noise();
    }
}
