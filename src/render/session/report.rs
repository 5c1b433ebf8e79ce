//! Progress report of a session.

use crate::film::{Display, Film, LightWeights, Noise};
use crate::render::schedule::{Spp, StoppedBy};
use std::sync::Arc;

/// Noise targets that a user can choose, in 8-bit levels. Each is half of the previous one.
pub const QUALITIES: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125];

/// State of a session.
#[derive(Clone, Debug, PartialEq)]
pub enum State {
    /// No scene has been set yet.
    Idle,
    /// Samples are being traced.
    Tracing,
    /// A stop criterion is reached.
    Finished(StoppedBy),
    /// The client has paused the render.
    Paused,
    /// The newest scene cannot be rendered; the text is the reason.
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
    /// Numbers of samples per pixel in the picture, over both replicates.
    pub spp: Spp,
    /// Number of traced samples, over all pixels.
    pub samples: u64,
    /// Number of traced rays of every kind.
    pub rays: u64,
    /// Seconds spent on tracing this scene. Compilation and pauses are not included.
    pub seconds: f64,
    /// Duration of the scene's compilation in seconds.
    pub compile_seconds: f64,
    /// Seconds from the start of the compilation to the first complete picture. `None` before that
    /// picture.
    pub first_picture_seconds: Option<f64>,
    /// Estimated error of the picture. `None` before the first estimate.
    pub noise: Option<Noise>,
    /// Lower and upper estimate of the seconds left until the render ends. `None` if the time
    /// cannot be estimated.
    pub eta_seconds: Option<(f64, f64)>,
    /// Lower and upper estimate of the seconds until the noise falls to each of the [`QUALITIES`],
    /// independent of the stop criteria. `None` before the first estimate.
    pub quality_seconds: [Option<(f64, f64)>; QUALITIES.len()],
    /// Share of the render that is done, 0..=1. `None` if it cannot be estimated.
    pub progress: Option<f64>,
    /// Number of samples that were NaN or negative and were replaced by black.
    pub bad_samples: u64,
    /// Number of samples above the film's limit, which were stored with the limit.
    pub saturated_samples: u64,
    /// Number of pixels with a sum that has reached its limit, which makes them too dark.
    pub saturated_pixels: u64,
    /// Samples per second during the last second of tracing; 0 before it is known.
    pub recent_samples_per_second: f64,
    /// Number of threads that trace.
    pub threads: usize,
    /// Name of the lane type, such as `f32x8`; empty without a scene.
    pub lanes: &'static str,
    /// Features of the compiled scene, in one line; empty without a scene.
    pub inventory: Arc<str>,
}

impl Report {
    /// Creates the report of a session without a scene.
    pub(in crate::render) fn idle(threads: usize) -> Self {
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

    /// Creates the report of a complete film, shown with `mix` and `display`.
    pub fn of_film(film: &Film, mix: &LightWeights, display: &Display) -> Self {
        Self { noise: film.noise(mix, display), ..Self::of_samples(film) }
    }

    /// Creates the report of a film, without an estimate of its error.
    pub(super) fn of_samples(film: &Film) -> Self {
        let counts = (0..film.tile_count()).map(|tile| {
            let [a, b] = film.tile(tile).map_or([0; 2], |tile| tile.counts());
            a.saturating_add(b)
        });
        let (min, max) = counts.fold((u32::MAX, 0), |(min, max), n| (min.min(n), max.max(n)));
        let samples = film.samples();
        let pixels = film.width() * film.height();
        Self {
            spp: Spp { min, mean: samples as f64 / pixels as f64, max },
            samples,
            bad_samples: film.bad_samples().count,
            saturated_samples: film.saturated_samples(),
            saturated_pixels: film.saturated_pixels(),
            ..Self::idle(0)
        }
    }

    /// Returns one phrase for each kind of sample that was replaced or limited.
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

    /// Mean number of samples per second of tracing.
    pub fn samples_per_second(&self) -> f64 {
        if self.seconds > 0.0 { self.samples as f64 / self.seconds } else { 0.0 }
    }
}
