//! Render of a picture that does not fit into memory, in regions: bands of rows, from top to
//! bottom, each with its own film and schedule.
//!
//! A sample is a function of seed, pixel, replicate and index; a uniform render in regions
//! therefore equals one of the whole picture, bit for bit. An adaptive render differs, because it
//! allocates samples within each region.

use crate::export::{Provenance, film_header, metadata};
use crate::film::file::FilmFileHeader;
use crate::film::{Film, Header, NoiseSums};
use crate::image_file::{Bands, Depth, ImageOutput};
use crate::schedule::{Interval, SAMPLE_ALIGNMENT, Schedule, Settings, Spp, Step, Stop, StoppedBy};
use crate::session::{Report, State};
use crate::{Options, RenderState, threads};
use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use zerkalo_scene::Scene;
use zerkalo_scene::disk::WriteError;

/// Target duration in seconds of the work between two calls of the observer.
const PIECE_SECONDS: f64 = 0.25;
/// Number of samples, over all pixels, of the first piece, which measures the speed.
const FIRST_PIECE_SAMPLES: u64 = 1 << 18;
/// Largest number of samples per pixel of a job. Jobs are short, so that all threads have work
/// until the end of a piece.
const LONGEST_JOB: u32 = 16 * SAMPLE_ALIGNMENT;

/// Callback that receives a report after each piece of work and before each row is written. An
/// error from it ends the render.
pub type Observer<'a> = &'a mut dyn FnMut(&Report) -> io::Result<()>;

/// Render of a picture in regions.
pub struct RegionRender {
    /// Compiled scene, with the film of the current region. `None` after a failed region.
    state: Option<RenderState>,
    settings: Settings,
    pool: rayon::ThreadPool,
    /// Number of rows of each region except the last, which may have fewer.
    rows: u32,
    finished_rows: u32,
    /// Estimated errors of the tiles of the finished regions.
    estimates: NoiseSums,
    report: Report,
    stopped_by: StoppedBy,
}

impl RegionRender {
    /// Compiles `scene`, which must be valid, for regions of `rows` rows, a multiple of
    /// [`TILE`](crate::film::TILE). Each region is rendered until a stop criterion is reached; a
    /// time limit is divided among the regions. Fails if a thread cannot be started, or if there is
    /// not enough memory for a region.
    pub fn new(
        scene: &Arc<Scene>,
        options: &Options,
        settings: Settings,
        rows: u32,
        threads: usize,
    ) -> Result<Self, String> {
        let start = Instant::now();
        let pool = threads::pool(threads).map_err(|error| error.to_string())?;
        let rows_at_once = 0..rows.min(scene.film.size[1]);
        let state = RenderState::compile(Arc::clone(scene), options, None, rows_at_once)?;
        let report = Report {
            compile_seconds: start.elapsed().as_secs_f64(),
            lanes: state.world.info().lanes,
            inventory: Arc::from(&*state.world.info().inventory),
            spp: Spp { min: u32::MAX, mean: 0.0, max: 0 },
            threads,
            ..Report::default()
        };
        Ok(Self {
            state: Some(state),
            settings: Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings },
            pool,
            rows,
            finished_rows: 0,
            estimates: NoiseSums::default(),
            report,
            stopped_by: StoppedBy::Full,
        })
    }

    /// Renders the picture and writes its rows as they finish. Returns the report on the whole
    /// picture and the stop criterion that ended it. After an error an existing file is unchanged.
    pub fn write(
        &mut self,
        provenance: &Provenance,
        depth: Depth,
        output: &ImageOutput,
        observer: Observer,
    ) -> Result<(Report, StoppedBy), WriteError> {
        let height = self.state().scene().film.size[1] as usize;
        let header = film_header(self.state(), &self.report, provenance);
        let header = FilmFileHeader { film: Header { height, ..header.film }, ..header };
        output.write(&header, depth, &mut Rows { render: self, provenance, observer })?;
        Ok((self.report.clone(), self.stopped_by))
    }

    /// Renders the regions down to row `y`, if necessary, and returns the film with this row.
    pub fn film_with_row(&mut self, y: usize, observer: Observer) -> io::Result<&Film> {
        if y < self.finished_rows as usize {
            observer(&self.report)?;
        }
        while y >= self.finished_rows as usize {
            self.render_region(observer)?;
        }
        Ok(&self.state().film)
    }

    pub fn state(&self) -> &RenderState {
        self.state.as_ref().expect("a region after a failed one is not rendered")
    }

    /// Renders the region whose first row is `self.finished_rows`.
    fn render_region(&mut self, observer: Observer) -> io::Result<()> {
        let height = self.state().scene().film.size[1];
        let rows = self.finished_rows..height.min(self.finished_rows + self.rows);
        let state = self.state.take().expect("a region after a failed one is not rendered");
        let mut state = state.into_band(rows.clone()).map_err(io::Error::other)?;
        let left = |seconds: f64| {
            let share = rows.len() as f64 / f64::from(height - rows.start);
            (seconds - self.report.seconds).max(0.0) * share
        };
        let stop = self.settings.stop;
        let stop = Stop { seconds: stop.seconds.map(left), ..stop };
        let mut schedule = state.schedule(Settings { stop, ..self.settings });
        let mut seconds = 0.0;
        let reason = loop {
            let wave = match schedule.next(seconds) {
                Step::Finished(reason) => break reason,
                Step::Trace(wave) => wave,
            };
            let (samples, spent) =
                (self.report.samples + schedule.samples, self.report.seconds + seconds);
            let piece = match spent > 0.0 {
                true => (PIECE_SECONDS * samples as f64 / spent) as u64,
                false => FIRST_PIECE_SAMPLES,
            };
            let wave = wave.cut(piece, LONGEST_JOB);
            let start = Instant::now();
            let report = state.trace_wave(&wave, &self.pool, &AtomicBool::new(false));
            seconds += start.elapsed().as_secs_f64();
            schedule.complete(&wave, &report);
            observer(&self.report_with(&state, &schedule, seconds, schedule.progress(seconds)))?;
        };
        self.report = self.report_with(&state, &schedule, seconds, Some(1.0));
        schedule.tile_estimates().for_each(|tile| self.estimates.add(tile));
        self.state = Some(state);
        self.finished_rows = rows.end;
        if self.stopped_by != StoppedBy::Time {
            self.stopped_by = reason;
        }
        if rows.end == height {
            self.report.noise = std::mem::take(&mut self.estimates).noise();
            if let (Some(error), Some(noise)) = (&mut self.report.error, self.report.noise) {
                error.noise = noise.rmse.levels;
            }
            self.report.state = State::Finished(self.stopped_by);
        }
        Ok(())
    }

    /// Returns the report on the finished regions and on the region of `state`. After `seconds`
    /// seconds, the fraction `share` of this region is done.
    fn report_with(
        &self,
        state: &RenderState,
        schedule: &Schedule,
        seconds: f64,
        share: Option<f64>,
    ) -> Report {
        let (finished, film) = (&self.report, &state.film);
        let [width, height] = state.scene().film.size;
        let (first, rows) = (f64::from(self.finished_rows), film.header.height as f64);
        let done = (first + share.unwrap_or(0.0) * rows) / f64::from(height);
        let seconds = finished.seconds + seconds;
        let left = seconds * (1.0 - done) / done;
        let samples = finished.samples + schedule.samples;
        let spp = schedule.spp();
        Report {
            state: State::Tracing,
            spp: Spp {
                min: spp.min.min(finished.spp.min),
                mean: samples as f64 / ((first + rows) * f64::from(width)),
                max: spp.max.max(finished.spp.max),
            },
            samples,
            rays: finished.rays + schedule.rays,
            seconds,
            noise: schedule.noise,
            error: schedule.error_parts(&state.world.info().left_out),
            eta_seconds: share.filter(|_| done > 0.0).map(|_| Interval::exact(left)),
            progress: Some(done),
            bad_samples: finished.bad_samples + film.bad_samples(),
            saturated_samples: finished.saturated_samples + film.saturated_samples(),
            saturated_pixels: finished.saturated_pixels + film.saturated_pixels(),
            ..finished.clone()
        }
    }
}

/// Source of rows for the writer of a picture, which renders the region of each requested row.
struct Rows<'a> {
    render: &'a mut RegionRender,
    provenance: &'a Provenance,
    observer: Observer<'a>,
}

impl Bands for Rows<'_> {
    fn film_with_row(&mut self, y: usize) -> io::Result<&Film> {
        self.render.film_with_row(y, self.observer)
    }

    fn final_metadata(&self) -> Option<Vec<(String, String)>> {
        Some(metadata(self.render.state(), &self.render.report, self.provenance))
    }
}
