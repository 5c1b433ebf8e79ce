//! What a session tells its guests.

use crate::film::Noise;
use crate::render::schedule::{Spp, StoppedBy};
use std::sync::Arc;

/// The noise, in codes, of the qualities that a user chooses from: halves of one another.
pub const QUALITIES: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125];

/// What the session is doing.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// It has no scene yet.
    Idle,
    /// Samples are being added.
    Tracing,
    /// The work is done.
    Finished(StoppedBy),
    /// A guest asked for a pause.
    Paused,
    /// The newest scene cannot be rendered, and why.
    Failed(String),
}

/// Where the work stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Which scene this is about: what [`Session::set_scene`](crate::render::session::Session::set_scene) returned.
    pub generation: u64,
    /// What the session is doing.
    pub state: State,
    /// Samples per pixel that both replicates have.
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
    /// The same for each of the [`QUALITIES`], whatever the targets are.
    pub quality_seconds: [Option<(f64, f64)>; QUALITIES.len()],
    /// Share of the work that is done, 0..=1.
    pub progress: Option<f64>,
    /// Samples that were lost because they were no numbers or negative.
    pub bad_samples: u64,
    /// Samples that were brighter than the film holds, and so have the largest value that it does.
    pub saturated_samples: u64,
    /// Pixels whose sum of samples is full, and so lower than it should be.
    pub saturated_pixels: u64,
    /// Speed of the last second of tracing, samples per second; 0 before it is known.
    pub recent_samples_per_second: f64,
    /// Threads that trace.
    pub threads: usize,
    /// Name of the lane type, such as `f32x8`; empty without a scene.
    pub lanes: &'static str,
    /// What the compiled scene contains, in one line; empty without a scene.
    pub inventory: Arc<str>,
}

impl Report {
    /// About no scene.
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

    /// What was changed of the samples, in words; nothing, if nothing was.
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
