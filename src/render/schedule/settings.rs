//! What the scheduler is asked for, and why it ended.

use crate::film::{Mse, Noise};

/// What "noise" means when tiles compete for samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Criterion {
    /// The error as displayed, in 8-bit codes.
    Codes,
    /// The error of the linear mix.
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

/// When to stop; whichever comes first. Nothing set: never.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stop {
    /// Mean samples per pixel, A and B together; rounds up to even.
    pub spp: Option<u32>,
    /// Estimated RMSE of the whole picture as displayed, in 8-bit codes.
    pub noise_codes: Option<f64>,
    /// Estimated linear RMSE of the whole picture.
    pub rmse_linear: Option<f64>,
    /// Seconds of rendering; tested between waves.
    pub seconds: Option<f64>,
}

/// Why the work ended.
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
    /// Every glossy tile has its cap of rays per pixel, and the others meet the target.
    RaysPerPixel,
    /// Every tile holds as many samples as can be counted.
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

/// How to schedule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Whether tiles may get different counts (else only the cap makes a difference).
    pub adaptive: bool,
    /// The error that the tiles' order minimises.
    pub criterion: Criterion,
    /// The most samples per pixel, A and B together, of tiles that met a glossy lobe (rounds down to
    /// even, at least 2); 0: no cap.
    pub rays_per_pixel: u32,
    /// When to stop.
    pub stop: Stop,
}
