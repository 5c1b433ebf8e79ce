//! Settings of the schedule: stop criteria, and the reasons for which a render ends.

use crate::film::{Mse, Noise};

/// Measure of the error that adaptive sampling minimises.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// Error of the displayed picture, in 8-bit levels.
    Codes,
    /// Error in linear radiance.
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

/// Stop criteria. The first one that is reached ends the render. A render without stop criteria
/// does not end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Mean number of samples per pixel, A and B together; rounded up to an even number.
    pub spp: Option<u32>,
    /// Estimated RMSE of the whole picture as displayed, in 8-bit levels.
    pub noise_codes: Option<f64>,
    /// Estimated linear RMSE of the whole picture.
    pub rmse_linear: Option<f64>,
    /// Seconds of rendering. The limit is tested between waves.
    pub seconds: Option<f64>,
}

/// Reason for which a render has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoppedBy {
    /// The mean number of samples per pixel was reached.
    Spp,
    /// The displayed noise fell to its target.
    Noise,
    /// The linear RMSE fell to its target.
    Rmse,
    /// The time limit was reached.
    Time,
    /// All glossy tiles have reached their cap on samples per pixel, and the error of the other
    /// tiles is at the target.
    RaysPerPixel,
    /// All tiles hold the largest number of samples.
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
    /// `true` if tiles may get different numbers of samples. Otherwise numbers differ only by the
    /// cap.
    pub adaptive: bool,
    /// Measure of the error that adaptive sampling minimises.
    pub criterion: Criterion,
    /// Largest number of samples per pixel, A and B together, in tiles with a glossy lobe. It is
    /// rounded down to an even number, at least 2. 0 means no cap.
    pub rays_per_pixel: u32,
    /// Stop criteria.
    pub stop: Stop,
}
