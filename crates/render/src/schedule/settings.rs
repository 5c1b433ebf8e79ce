//! Settings of the schedule: stop criteria, and the reasons for which a render ends.

use crate::film::{Mse, Noise};

/// Measure of the error that adaptive sampling minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// RMSE of the displayed picture, in 8-bit levels.
    Levels,
    /// RMSE of the picture in linear radiance.
    Linear,
}

impl Criterion {
    pub(super) fn of(self, error: Mse) -> f64 {
        match self {
            Self::Levels => error.levels,
            Self::Linear => error.linear,
        }
    }

    pub(super) fn of_picture(self, noise: Noise) -> f64 {
        match self {
            Self::Levels => noise.rmse_levels,
            Self::Linear => noise.rmse_linear,
        }
    }
}

/// Stop criteria. The first one that is reached ends the render. A render without stop criteria
/// does not end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Target for the mean number of samples per pixel, over both replicates (halves of the
    /// samples); rounded up to an even number. `None` for no target.
    pub spp: Option<u32>,
    /// Target for the estimated RMSE of the whole picture as displayed, in 8-bit levels. `None` for
    /// no target.
    pub noise_levels: Option<f64>,
    /// Target for the estimated RMSE of the whole picture in linear radiance. `None` for no target.
    pub rmse_linear: Option<f64>,
    /// Time limit of the render in seconds. It is tested between waves, sets of jobs that run
    /// concurrently. `None` for no limit.
    pub seconds: Option<f64>,
}

/// Reason for which a render has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoppedBy {
    /// The mean number of samples per pixel reached its target.
    Spp,
    /// The RMSE of the displayed picture fell to its target.
    Noise,
    /// The RMSE of the picture in linear radiance fell to its target.
    Rmse,
    /// The time limit of the render was reached.
    Time,
    /// At least one tile has reached its largest number of samples ([`Settings::rays_per_pixel`]).
    /// The tiles that may still get samples together meet the error target, or there are no such
    /// tiles.
    RaysPerPixel,
    /// All tiles hold the largest number of samples that a tile of the film can hold.
    Full,
}

impl StoppedBy {
    /// Returns the name of the reason in printed statistics. It never changes between versions of
    /// the program.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spp => "spp",
            Self::Noise => "noise",
            Self::Rmse => "rmse",
            Self::Time => "time",
            Self::RaysPerPixel => "rays_per_pixel",
            Self::Full => "full",
        }
    }
}

/// Settings of the schedule, which allocates samples to tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// `true` if tiles may get different numbers of samples according to their noise. Otherwise all
    /// tiles get the same number, except those that [`Settings::rays_per_pixel`] limits.
    pub adaptive: bool,
    /// Measure of the error that adaptive sampling minimises.
    pub criterion: Criterion,
    /// Largest number of samples per pixel in tiles in which a path has made a random choice, such
    /// as a direction of a glossy lobe. It is for the whole render and both replicates (halves of
    /// the samples) together, and is rounded down to an even number, at least 2. 0 means no limit.
    pub rays_per_pixel: u32,
    /// Stop criteria of the render.
    pub stop: Stop,
}

impl Settings {
    /// Creates settings that minimise the error of the displayed picture. `rays_per_pixel` is 0; a
    /// renderer replaces it by that of the scene.
    pub fn new(adaptive: bool, stop: Stop) -> Self {
        Self { adaptive, criterion: Criterion::Levels, rays_per_pixel: 0, stop }
    }
}
