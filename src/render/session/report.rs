//! Progress report of a session.

use crate::film::Noise;
use crate::render::schedule::{Spp, StoppedBy};
use std::sync::Arc;

/// Noise targets that a user chooses from, in 8-bit levels; each is half of the one before.
pub const QUALITIES: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125];

/// State of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// No scene yet.
    Idle,
    /// Samples are being added.
    Tracing,
    /// A stop criterion is reached.
    Finished(StoppedBy),
    /// Paused by the client.
    Paused,
    /// The newest scene cannot be rendered, for this reason.
    Failed(String),
}

/// Progress of the render of one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Generation of the scene, as returned by [`Session::set_scene`].
    ///
    /// [`Session::set_scene`]: crate::render::session::Session::set_scene
    pub generation: u64,
    /// State of the session.
    pub state: State,
    /// Samples per pixel that both replicates have.
    pub spp: Spp,
    /// Samples over all pixels.
    pub samples: u64,
    /// Rays of every kind.
    pub rays: u64,
    /// Seconds spent on tracing this scene, without compilation and pauses.
    pub seconds: f64,
    /// Duration of the scene's compilation.
    pub compile_seconds: f64,
    /// Seconds from the start of the compilation to the first complete picture.
    pub first_picture_seconds: Option<f64>,
    /// Estimated error.
    pub noise: Option<Noise>,
    /// Lower and upper estimate of the seconds left.
    pub eta_seconds: Option<(f64, f64)>,
    /// Lower and upper estimate of the seconds left until each of the [`QUALITIES`] is reached,
    /// whatever the stop criteria are.
    pub quality_seconds: [Option<(f64, f64)>; QUALITIES.len()],
    /// Share of the work that is done, 0..=1.
    pub progress: Option<f64>,
    /// Samples left out because they were NaN or negative.
    pub bad_samples: u64,
    /// Samples brighter than the film can hold; they are stored with its largest value.
    pub saturated_samples: u64,
    /// Pixels whose sum of samples has reached its limit and is too low.
    pub saturated_pixels: u64,
    /// Speed of the last second of tracing, samples per second; 0 before it is known.
    pub recent_samples_per_second: f64,
    /// Threads that trace.
    pub threads: usize,
    /// Name of the lane type, such as `f32x8`; empty without a scene.
    pub lanes: &'static str,
    /// Contents of the compiled scene, in one line; empty without a scene.
    pub inventory: Arc<str>,
}

impl Report {
    /// Report without a scene.
    pub(super) fn idle(threads: usize) -> Self {
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
            quality_seconds: [None; QUALITIES.len()],
            progress: None,
            bad_samples: 0,
            saturated_samples: 0,
            saturated_pixels: 0,
            recent_samples_per_second: 0.0,
            threads,
            lanes: "",
            inventory: Arc::from(""),
        }
    }

    /// One phrase for each kind of sample that was left out or clamped.
    pub fn warnings(&self) -> Vec<String> {
        let plural = |n: u64, one: &str| format!("{n} {one}{}", if n == 1 { "" } else { "s" });
        let mut out = Vec::new();
        if self.bad_samples > 0 {
            out.push(format!("{} left out", plural(self.bad_samples, "bad sample")));
        }
        if self.saturated_samples > 0 {
            out.push(plural(self.saturated_samples, "saturated sample"));
        }
        if self.saturated_pixels > 0 {
            out.push(plural(self.saturated_pixels, "saturated pixel"));
        }
        out
    }

    /// Mean speed of tracing, samples per second.
    pub fn samples_per_second(&self) -> f64 {
        if self.seconds > 0.0 { self.samples as f64 / self.seconds } else { 0.0 }
    }
}
