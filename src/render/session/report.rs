//! What a session tells its guests.

use crate::film::{Noise, Thumbnail};
use crate::render::schedule::{Spp, StoppedBy};
use std::sync::Mutex;

/// What the session is doing.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// It has no scene yet.
    Idle,
    /// Samples are being added.
    Tracing,
    /// The work is done.
    Resting(StoppedBy),
    /// A guest asked for a pause.
    Paused,
    /// The newest scene cannot be rendered, and why.
    Failed(String),
}

/// Where the work stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Which scene this is about: what [`Session::set_scene`](super::Session::set_scene) returned.
    pub generation: u64,
    /// What the session is doing.
    pub state: State,
    /// Samples per pixel.
    pub spp: Spp,
    /// Samples over all pixels.
    pub samples: u64,
    /// Rays of every kind.
    pub rays: u64,
    /// Seconds spent on tracing this scene, without compilation and pauses.
    pub seconds: f64,
    /// Seconds that the compilation of the scene took.
    pub compile_seconds: f64,
    /// Seconds from taking up the scene to its first complete picture.
    pub first_picture_seconds: Option<f64>,
    /// Estimated error.
    pub noise: Option<Noise>,
    /// A lower and an upper guess of the seconds left.
    pub eta_seconds: Option<(f64, f64)>,
    /// Share of the work that is done, 0..=1.
    pub progress: Option<f64>,
    /// Samples that were lost because they were not finite or negative.
    pub bad_samples: u64,
}

impl Report {
    /// About no scene.
    pub(super) fn idle() -> Self {
        Self {
            generation: 0,
            state: State::Idle,
            spp: Spp { min: 0, mean: 0.0, max: 0 },
            samples: 0,
            rays: 0,
            seconds: 0.0,
            compile_seconds: 0.0,
            first_picture_seconds: None,
            noise: None,
            eta_seconds: None,
            progress: None,
            bad_samples: 0,
        }
    }

    /// Mean speed of tracing, samples per second.
    pub fn samples_per_second(&self) -> f64 {
        if self.seconds > 0.0 { self.samples as f64 / self.seconds } else { 0.0 }
    }
}

/// The latest state of the work, with a small picture if the guest has asked for one.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Where the work stands.
    pub report: Report,
    /// Means per light group over the cells of the guest's raster; the guest mixes the lights.
    pub picture: Option<Thumbnail>,
    /// Estimated RMSE of each tile in codes, row by row; empty before the first estimate.
    pub tile_noise: Vec<f32>,
}

/// A place for one snapshot: a newer one replaces what has not been taken.
#[derive(Debug, Default)]
pub(super) struct Slot(Mutex<Option<Snapshot>>);

impl Slot {
    pub fn put(&self, snapshot: Snapshot) {
        *self.lock() = Some(snapshot);
    }

    pub fn take(&self) -> Option<Snapshot> {
        self.lock().take()
    }

    pub fn is_empty(&self) -> bool {
        self.lock().is_none()
    }

    /// A guest that panicked while it held the lock leaves a whole snapshot behind.
    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Snapshot>> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}
