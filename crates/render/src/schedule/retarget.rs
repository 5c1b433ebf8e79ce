//! Changes of a schedule during the render: stop criteria, cap, noise estimates.

use crate::film::TileNoise;
use crate::schedule::tile::Tile;
use crate::schedule::{ConvergenceFit, Schedule, Stop};

impl Schedule {
    /// Sets the stop criteria. A finished render resumes if the new ones are not reached.
    pub fn set_stop(&mut self, stop: Stop) {
        self.settings.stop = stop;
    }

    /// Sets [`Settings::rays_per_pixel`](crate::schedule::Settings::rays_per_pixel).
    pub fn set_rays_per_pixel(&mut self, cap: u32) {
        self.settings.rays_per_pixel = cap;
    }

    /// Discards all noise estimates after a change of light weights or display transform. The
    /// samples stay valid; the noise is unknown until [`Schedule::set_estimates`].
    pub fn forget_estimates(&mut self) {
        self.tiles.iter_mut().for_each(Tile::forget_estimates);
        self.noise = None;
        self.convergence = ConvergenceFit::default();
    }

    /// Sets the noise estimates of all tiles, in row order, between two waves. `None` means that a
    /// tile has too few samples.
    pub fn set_estimates(&mut self, estimates: &[Option<TileNoise>]) {
        for (tile, estimate) in self.tiles.iter_mut().zip(estimates) {
            tile.set_estimate(*estimate);
        }
        // A round that began before the first estimates would end without new ones.
        self.estimate |= self.tiles.iter().all(|t| t.error.is_some());
        self.update_noise();
    }
}
