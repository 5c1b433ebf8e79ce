//! Deadline of `zerkalo render --time`: the picture is written by then. Forecast of its noise.

use crate::command::args::RenderArgs;
use std::path::Path;
use std::time::{Duration, Instant};
use zerkalo_render::export::{Provenance, film_header};
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_render::session::{QUALITIES, Report, Session};
use zerkalo_scene::disk::{Existing, TEMPORARY};

/// Share of the time after which the noise is forecast.
const FORECAST_AT: f64 = 0.05;
/// Time to write the picture, as a multiple of the time that a trial took.
const WRITING: f64 = 1.5;
/// Time to stop the tracing and to end the program.
const STOPPING: Duration = Duration::from_millis(50);

/// Deadline of a render.
pub struct Deadline {
    seconds: f64,
    /// Latest end of the tracing.
    end: Instant,
    /// Picture to be written as a trial; `None` after the trial.
    trial: Option<(ImageOutput, Depth, Provenance)>,
    is_forecast: bool,
}

impl Deadline {
    /// Returns the deadline of a program that began at `started`; `None` without `--time`.
    pub fn new(
        args: &RenderArgs,
        output: &ImageOutput,
        provenance: &Provenance,
        started: Instant,
    ) -> Option<Self> {
        let seconds = args.time?;
        let end = started.checked_add(Duration::try_from_secs_f64(seconds).ok()?)?;
        let trial = Some((output.clone(), args.bits, provenance.clone()));
        Some(Self { seconds, end, trial, is_forecast: false })
    }

    /// Returns the time until the tracing has to stop; zero from then on.
    pub fn left(&self) -> Duration {
        self.end.saturating_duration_since(Instant::now())
    }

    /// Reserves the time to write the picture, once there is one: that of a trial, which writes it
    /// to a temporary file.
    pub fn reserve(&mut self, session: &Session) {
        let trial = self.trial.take().filter(|_| !self.left().is_zero());
        let Some((mut output, depth, provenance)) = trial else { return };
        let start = Instant::now();
        let folder = output.path.parent().filter(|folder| !folder.as_os_str().is_empty());
        let mut builder = tempfile::Builder::new();
        builder.prefix(TEMPORARY[0]).suffix(TEMPORARY[1]);
        let Ok(temporary) = builder.tempfile_in(folder.unwrap_or(Path::new("."))) else { return };
        (output.path, output.existing) = (temporary.path().to_path_buf(), Existing::Replace);
        let written = session.with(move |state, report| {
            let header = film_header(state, report, &provenance);
            output.write(&header, depth, &mut &state.film).map(drop)
        });
        if let Some(Ok(())) = written {
            self.end -= start.elapsed().mul_f64(WRITING) + STOPPING;
        }
    }

    /// Returns a line with the noise that the render is expected to reach, once it can be estimated.
    pub fn forecast(&mut self, report: &Report) -> Option<String> {
        if self.is_forecast || report.seconds < FORECAST_AT * self.seconds {
            return None;
        }
        let left = self.left().as_secs_f64();
        let [low, high] = noise_at(report, report.seconds + left)?;
        self.is_forecast = true;
        Some(format!("--time {}: noise {low:.2} to {high:.2} 8-bit levels expected", self.seconds))
    }
}

/// Returns the interval in which the noise is expected after `seconds` of tracing. The power law
/// between the noise targets with their estimated times gives both ends.
fn noise_at(report: &Report, seconds: f64) -> Option<[f64; 2]> {
    let noise = report.noise?.rmse.levels;
    let targets = || QUALITIES.into_iter().zip(report.quality_seconds).filter(|(n, _)| *n < noise);
    let at = |times: &mut dyn Iterator<Item = Option<f64>>| {
        let later = targets()
            .zip(times)
            .filter_map(|((levels, _), left)| Some((report.seconds + left?, levels)));
        let points: Vec<_> = std::iter::once((report.seconds, noise)).chain(later).collect();
        let next = points.iter().position(|(time, _)| *time >= seconds);
        let next = next.unwrap_or(points.len() - 1).max(1);
        let ((t0, n0), (t1, n1)) = (*points.get(next - 1)?, *points.get(next)?);
        Some(n0 * (t0 / seconds).powf((n0 / n1).ln() / (t1 / t0).ln()))
    };
    let low = at(&mut targets().map(|(_, left)| Some(left?.low)))?;
    let high = at(&mut targets().map(|(_, left)| Some(left?.high)))?;
    Some([low, high])
}
