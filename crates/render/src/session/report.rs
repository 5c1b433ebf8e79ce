//! Progress report of a render session.

use crate::film::{Display, Film, LightWeights, Noise};
use crate::schedule::{Spp, StoppedBy};
use std::sync::Arc;

/// Noise targets that a user can choose: RMSE of the displayed picture in 8-bit levels. Each is
/// half of the previous one.
pub const QUALITIES: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, 0.125];

/// State of a render session.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum State {
    /// State before the first scene has been set.
    #[default]
    Idle,
    /// State in which samples of the newest scene are traced.
    Tracing,
    /// State after a stop criterion has ended the render.
    Finished(StoppedBy),
    /// State in which the client has paused the render.
    Paused,
    /// State in which the newest scene cannot be rendered; the text is the reason.
    Failed(String),
}

/// Progress of the render of one scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Version number of the scene, as returned by [`Session::set_scene`].
    ///
    /// [`Session::set_scene`]: crate::session::Session::set_scene
    pub generation: u64,
    /// State of the session that sends the report.
    pub state: State,
    /// Smallest, mean and largest number of samples per pixel in the picture. The samples of both
    /// replicates (the two halves of the samples) count.
    pub spp: Spp,
    /// Number of samples traced for the picture so far. It is the sum over all pixels and over both
    /// replicates (the two halves of the samples).
    pub samples: u64,
    /// Number of rays traced for the picture so far: camera, shadow, reflected and transmitted.
    pub rays: u64,
    /// Seconds spent on tracing this scene so far. Compilation and pauses are not included.
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
    /// Seconds left until the RMSE of the displayed picture falls to each of the [`QUALITIES`],
    /// whatever the stop criteria are. Each entry is `(lower estimate, upper estimate)`, or `None`
    /// before the first noise estimate.
    pub quality_seconds: [Option<(f64, f64)>; QUALITIES.len()],
    /// Share of the render that is done, 0..=1: elapsed time over expected total time, or the share
    /// of samples if a plan divides the render among processes. `None` if it cannot be estimated.
    pub progress: Option<f64>,
    /// Number of samples that were NaN or negative and were replaced by black.
    pub bad_samples: u64,
    /// Number of samples that were brighter than the largest value that the film can store. The
    /// film has added the largest value in place of each of them.
    pub saturated_samples: u64,
    /// Number of pixels in which an integer sum of the film has reached its largest value. Further
    /// samples make these pixels too dark.
    pub saturated_pixels: u64,
    /// Throughput of about the latest second: samples traced per second, summed over all pixels. It
    /// is 0 before the first measurement.
    pub recent_samples_per_second: f64,
    /// Number of threads that trace rays.
    pub threads: usize,
    /// Name of the SIMD type with which rays are traced, such as `f32x8`; empty without a scene.
    pub lanes: &'static str,
    /// Features of the compiled scene, such as `2 point lights` or `thin lens`, in one line for the
    /// user; empty without a scene.
    pub inventory: Arc<str>,
}

impl Report {
    /// Creates the report of a film that no session renders, such as the sum of several films. The
    /// error of the film is estimated for the picture with the light weights `mix` and the display
    /// transform `display`.
    pub fn of_film(film: &Film, mix: &LightWeights, display: &Display) -> Self {
        Self { noise: film.noise(mix, display), ..Self::of_samples(film) }
    }

    /// Creates the report of a film, without an estimate of its error.
    pub(super) fn of_samples(film: &Film) -> Self {
        let counts = (0..film.tile_count()).map(|tile| {
            let [a, b] = film.counts(tile);
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
            ..Self::default()
        }
    }

    /// Returns the warnings to the user, such as `3 saturated samples`. Bad samples, saturated
    /// samples and saturated pixels each give one warning if their number is not 0.
    pub fn warnings(&self) -> Vec<String> {
        let counts = [
            (self.bad_samples, "bad sample", " left out"),
            (self.saturated_samples, "saturated sample", ""),
            (self.saturated_pixels, "saturated pixel", ""),
        ];
        let warning = |(n, one, end)| format!("{n} {one}{}{end}", if n == 1 { "" } else { "s" });
        counts.into_iter().filter(|(n, ..)| *n > 0).map(warning).collect()
    }

    /// Returns the number of samples of all pixels together per second of tracing: the mean since
    /// the start of the render.
    pub fn samples_per_second(&self) -> f64 {
        if self.seconds > 0.0 { self.samples as f64 / self.seconds } else { 0.0 }
    }
}
