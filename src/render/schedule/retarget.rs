//! What may change while the work goes on: the aims, and what the samples at hand are worth.

use crate::film::TileNoise;
use crate::render::schedule::tile::Tile;
use crate::render::schedule::{ConvergenceFit, Schedule, Stop};

impl Schedule {
    /// When to stop from now on. Work that was done goes on if that is not reached.
    pub fn set_stop(&mut self, stop: Stop) {
        self.settings.stop = stop;
    }

    /// The cap on samples per pixel of glossy tiles from now on; see
    /// [`Settings::rays_per_pixel`](crate::render::schedule::Settings::rays_per_pixel).
    pub fn set_rays_per_pixel(&mut self, cap: u32) {
        self.settings.rays_per_pixel = cap;
    }

    /// Forgets every estimate: the picture's samples are the same, but they are mixed or displayed in
    /// another way now. Until [`Schedule::set_estimates`] the noise is not known.
    pub fn forget_estimates(&mut self) {
        self.tiles.iter_mut().for_each(Tile::forget_estimates);
        self.noise = None;
        // How the noise fell in the old picture says nothing about this one.
        self.trend = ConvergenceFit::default();
    }

    /// Takes in estimates of all tiles, row by row, made anew between two waves: `(count, error)` for
    /// `count` samples per replicate; `None`: too few samples.
    pub fn set_estimates(&mut self, estimates: &[Option<(u32, TileNoise)>]) {
        for (tile, estimate) in self.tiles.iter_mut().zip(estimates) {
            tile.set_estimate(*estimate);
        }
        // A decision that is still being carried out may not have meant to end with estimates.
        self.estimate |= self.tiles.iter().all(|t| t.error.is_some());
        self.judge();
    }
}
