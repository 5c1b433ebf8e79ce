//! Progress report of a render session.

use crate::error_parts::ErrorParts;
use crate::film::{Display, Film, LightWeights, Noise};
use crate::schedule::{Interval, Spp, StoppedBy};
use std::sync::Arc;
use zerkalo_world::Precision;

/// Noise targets that a user can choose, in 8-bit levels.
pub const QUALITIES: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125];

/// State of a render session.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum State {
    #[default]
    Idle,
    Tracing,
    Finished(StoppedBy),
    Paused,
    /// The newest scene cannot be rendered, for the given reason.
    Failed(String),
}

/// Progress of the render of one scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    pub generation: u64,
    pub state: State,
    pub spp: Spp,
    /// Number of samples over all pixels and both replicates.
    pub samples: u64,
    /// Number of rays of every kind.
    pub rays: u64,
    /// Seconds of tracing, without compilation and pauses.
    pub seconds: f64,
    pub compile_seconds: f64,
    /// Seconds from the start of the compilation to the first complete picture.
    pub first_picture_seconds: Option<f64>,
    pub noise: Option<Noise>,
    /// Parts of the error, with the noise. `None` before the first estimate of the noise, and for
    /// films.
    pub error: Option<ErrorParts>,
    /// Seconds of error probes, and of compiling the scene for them.
    pub probe_seconds: [f64; 2],
    /// Error of rounding in single precision for which the render has changed to double precision.
    pub rounding_avoided: Option<f64>,
    /// `true` if the picture contains samples of a smaller roughness.
    pub mixed: bool,
    /// Estimated seconds left until the render ends.
    pub eta_seconds: Option<Interval>,
    /// Estimated seconds left until each of the [`QUALITIES`] is reached, whatever the stop criteria
    /// are.
    pub quality_seconds: [Option<Interval>; QUALITIES.len()],
    /// Share of the render that is done, 0..=1: of the expected time or, for watched films, of the
    /// samples of their plan.
    pub progress: Option<f64>,
    /// Number of samples that were NaN or negative and count as black.
    pub bad_samples: u64,
    /// Number of samples that were reduced to the largest value that the film can store.
    pub saturated_samples: u64,
    /// Number of pixels with a full integer sum, which further samples make too dark.
    pub saturated_pixels: u64,
    /// Average of the samples traced per second over about the latest second; 0 before the first
    /// measurement.
    pub recent_samples_per_second: f64,
    pub threads: usize,
    /// Precision in reports of sessions that render, otherwise `None`.
    pub precision: Option<Precision>,
    /// Name of the SIMD type, such as `f32x8`; empty without a scene.
    pub lanes: &'static str,
    /// Features of the compiled scene, such as `2 point lights`, in one line; empty without a
    /// scene.
    pub inventory: Arc<str>,
}

impl Report {
    /// Creates the report of a film that no session renders, with its noise under `weights` and
    /// `display`.
    pub fn of_film(film: &Film, weights: &LightWeights, display: &Display) -> Self {
        Self { noise: film.noise(weights, display), ..Self::of_samples(film) }
    }

    /// Creates the report of a film without its noise.
    pub(super) fn of_samples(film: &Film) -> Self {
        let counts = (0..film.tile_count()).map(|tile| film.spp(tile));
        let (min, max) = counts.fold((u32::MAX, 0), |(min, max), n| (min.min(n), max.max(n)));
        let samples = film.samples();
        let pixels = film.header.width * film.header.height;
        Self {
            spp: Spp { min, mean: samples as f64 / pixels as f64, max },
            samples,
            bad_samples: film.bad_samples(),
            saturated_samples: film.saturated_samples(),
            saturated_pixels: film.saturated_pixels(),
            ..Self::default()
        }
    }

    /// Returns the warnings to the user, such as `3 saturated samples`.
    pub fn warnings(&self) -> Vec<String> {
        let counts = [
            (self.bad_samples, "bad sample", " left out"),
            (self.saturated_samples, "saturated sample", ""),
            (self.saturated_pixels, "saturated pixel", ""),
        ];
        let warning = |(n, one, end)| format!("{n} {one}{}{end}", if n == 1 { "" } else { "s" });
        let avoided = self.rounding_avoided.iter();
        let avoided = avoided.map(|levels| format!("double: rounding {levels:.2} in single"));
        counts.into_iter().filter(|(n, ..)| *n > 0).map(warning).chain(avoided).collect()
    }

    /// Returns the mean number of samples traced per second since the start of the render.
    pub fn samples_per_second(&self) -> f64 {
        if self.seconds > 0.0 { self.samples as f64 / self.seconds } else { 0.0 }
    }
}
