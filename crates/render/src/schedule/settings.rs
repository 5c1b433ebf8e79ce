//! Settings of the schedule: error measure, stop criteria, cap.

use crate::error_parts::ErrorTarget;
use crate::film::ByMeasure;

/// Error that adaptive sampling minimises.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Criterion {
    /// RMSE of the displayed picture, in 8-bit levels.
    #[default]
    Levels,
    /// RMSE of the picture in linear radiance.
    Linear,
}

impl Criterion {
    pub(super) fn of(self, error: ByMeasure) -> f64 {
        match self {
            Self::Levels => error.levels,
            Self::Linear => error.linear,
        }
    }
}

/// Stop criteria, of which the first that is reached ends the render. Without any, the render ends
/// when no tile can get more samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Mean number of samples per pixel over both replicates, rounded up to an even number.
    pub spp: Option<u32>,
    /// Estimated RMSE of the displayed picture, in 8-bit levels.
    pub noise_levels: Option<f64>,
    /// Estimated RMSE of the picture in linear radiance.
    pub rmse_linear: Option<f64>,
    /// Error of the displayed picture with all its parts.
    pub error: Option<ErrorTarget>,
    /// Time limit in seconds, tested between waves.
    pub seconds: Option<f64>,
}

/// Reason for which a render has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoppedBy {
    Spp,
    Noise,
    Rmse,
    /// The error meets its target, or the noise is as small as the target requires, while another
    /// part of the error exceeds it.
    Error,
    Time,
    /// Tiles have reached their cap ([`Settings::rays_per_pixel`]), and the other tiles, if there
    /// are any, meet the error target.
    RaysPerPixel,
    /// All tiles hold [`MAX_SAMPLES`](crate::schedule::MAX_SAMPLES).
    Full,
}

impl StoppedBy {
    /// Returns the name of the reason in printed statistics. It never changes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Spp => "spp",
            Self::Noise => "noise",
            Self::Rmse => "rmse",
            Self::Error => "error",
            Self::Time => "time",
            Self::RaysPerPixel => "rays_per_pixel",
            Self::Full => "full",
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Settings {
    /// `true` if tiles may get different numbers of samples according to their noise.
    pub adaptive: bool,
    pub criterion: Criterion,
    /// Largest number of samples per pixel in glossy tiles, over both replicates; rounded down to
    /// an even number, at least 2. 0 means no limit.
    pub rays_per_pixel: u32,
    pub stop: Stop,
}

impl Settings {
    /// Creates adaptive settings that minimise the displayed error. `rays_per_pixel` is 0; a
    /// renderer replaces it by the value of the scene.
    pub fn until(stop: Stop) -> Self {
        Self { adaptive: true, stop, ..Self::default() }
    }
}
