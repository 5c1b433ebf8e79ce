//! Changes of a schedule during the render: new stop criteria, a new limit on samples, and new
//! noise estimates for the samples so far.

use crate::film::TileNoise;
use crate::schedule::tile::Tile;
use crate::schedule::{ConvergenceFit, Schedule, Stop};

impl Schedule {
    /// Sets the stop criteria of the render. A finished render resumes if the new criteria are not
    /// reached.
    pub fn set_stop(&mut self, stop: Stop) {
        self.settings.stop = stop;
    }

    /// Sets the largest number of samples per pixel in tiles in which a path has made a random
    /// choice, such as a direction of a glossy lobe; 0 for no limit. See
    /// [`Settings::rays_per_pixel`](crate::schedule::Settings::rays_per_pixel).
    pub fn set_rays_per_pixel(&mut self, cap: u32) {
        self.settings.rays_per_pixel = cap;
    }

    /// Discards all noise estimates, because the light weights or the display transform have
    /// changed. The samples stay valid. The noise is unknown until the next call of
    /// [`Schedule::set_estimates`].
    pub fn forget_estimates(&mut self) {
        self.tiles.iter_mut().for_each(Tile::forget_estimates);
        self.noise = None;
        // The convergence of the old picture does not apply to the new one.
        self.convergence = ConvergenceFit::default();
    }

    /// Sets the noise estimates of all tiles, in row order. `None` means that the tile has too few
    /// samples for an estimate. Must be called between two waves (sets of concurrent jobs).
    pub fn set_estimates(&mut self, estimates: &[Option<TileNoise>]) {
        for (tile, estimate) in self.tiles.iter_mut().zip(estimates) {
            tile.set_estimate(*estimate);
        }
        // An allocation round that began before the first noise estimates would end without new
        // estimates. It now ends with new estimates if all tiles have one already.
        self.estimate |= self.tiles.iter().all(|t| t.error.is_some());
        self.update_noise();
    }
}
