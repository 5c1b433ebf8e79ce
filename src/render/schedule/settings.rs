//! Settings of the schedule, stop criteria, and reasons for its end.

use crate::film::{Mse, Noise};

/// Error that adaptive sampling minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// The error as displayed, in 8-bit levels.
    Codes,
    /// The error in linear radiance.
    Linear,
}

impl Criterion {
    pub(super) fn of(self, error: Mse) -> f64 {
        match self {
            Self::Codes => error.codes,
            Self::Linear => error.linear,
        }
    }

    pub(super) fn of_picture(self, noise: Noise) -> f64 {
        match self {
            Self::Codes => noise.rmse_codes,
            Self::Linear => noise.rmse_linear,
        }
    }

    pub(super) fn effective_pixels(self, noise: Noise) -> f64 {
        match self {
            Self::Codes => noise.effective_pixels.codes,
            Self::Linear => noise.effective_pixels.linear,
        }
    }
}

/// Stop criteria; the first one that is reached ends the work. Without any it does not end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Mean samples per pixel, A and B together; rounds up to even.
    pub spp: Option<u32>,
    /// Estimated RMSE of the whole picture as displayed, in 8-bit levels.
    pub noise_codes: Option<f64>,
    /// Estimated linear RMSE of the whole picture.
    pub rmse_linear: Option<f64>,
    /// Seconds of rendering, tested between waves.
    pub seconds: Option<f64>,
}

/// Reason for the end of the work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoppedBy {
    /// The sample count was reached.
    Spp,
    /// The noise as displayed was reached.
    Noise,
    /// The linear RMSE was reached.
    Rmse,
    /// The time was over.
    Time,
    /// Every glossy tile has reached its cap of samples per pixel, and the others have reached the target.
    RaysPerPixel,
    /// Every tile holds the largest number of samples.
    Full,
}

impl StoppedBy {
    /// Stable name for statistics.
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

/// Settings of the schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Adaptive sampling: tiles may get different counts. Otherwise counts differ only by the cap.
    pub adaptive: bool,
    /// The error that adaptive sampling minimises.
    pub criterion: Criterion,
    /// Largest number of samples per pixel, A and B together, of tiles with a glossy lobe (rounds down to even,
    /// at least 2); 0 for no cap.
    pub rays_per_pixel: u32,
    /// Stop criteria.
    pub stop: Stop,
}
