//! Active render of a session (a handle of a background rendering thread). It traces one scene in
//! pieces of a fraction of a second, estimates the noise of the picture, and publishes snapshots of
//! the render.

use crate::checkpoint::{Checkpoint, EncodedCheckpoint};
use crate::export::Provenance;
use crate::film::{Film, IncrementalDownsample, TileNoise};
use crate::first_hit_buffer::FirstHitBuffer;
use crate::schedule::{SAMPLE_ALIGNMENT, Schedule, Settings};
use crate::session::Shared;
use crate::session::report::{QUALITIES, Report, State};
use crate::session::snapshot::{Frame, Snapshot, View};
use crate::session::throughput::Throughput;
use crate::wave::Wave;
use crate::{Options, RenderState};
use crossbeam_channel::Sender;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use zerkalo_scene::Scene;

/// Target durations in seconds of a piece of a wave (a set of jobs that run concurrently). The
/// first applies while the client requests a picture or a pixel, the second while it requests
/// neither.
const PIECE_SECONDS: [f64; 2] = [0.05, 0.25];
/// Target duration in seconds of one tracing job. It is short, because a running job cannot be
/// cancelled.
const JOB_SECONDS: f64 = 0.005;
/// Number of pixels of a film tile.
const TILE_PIXELS: f64 = crate::film::TILE_PIXELS as f64;
/// Longest expected tracing time, in seconds, of a first-hit buffer that is traced before the first
/// picture. A first-hit buffer holds the first hit of a camera ray in each cell of the dashboard's
/// picture. A buffer with a longer tracing time is traced after the first picture.
const FIRST_HITS_SECONDS: f64 = 0.002;
/// Assumed seconds per ray of a first-hit buffer (first hits of camera rays) until one has been
/// measured. It is the value of a small scene.
const FIRST_HIT_RAY_SECONDS: f64 = 5e-8;

/// Resources that a render uses: the thread pool, the slot for its newest snapshot (state of the
/// render at one moment), the channel that announces this snapshot, and the optional contents of
/// snapshots that the client has requested.
pub(super) struct WorkContext {
    pub pool: rayon::ThreadPool,
    pub shared: Arc<Shared>,
    pub notify: Sender<()>,
    pub view: View,
    /// Generation of the scene (the number of its version).
    pub generation: u64,
}

impl WorkContext {
    /// Returns `true` if a snapshot of the render should be published now. A snapshot with a
    /// picture takes time. It is therefore published only if the client has taken the previous one,
    /// or at the end of the render (`is_final`).
    fn snapshot_wanted(&self, is_final: bool) -> bool {
        is_final || self.view == View::default() || self.shared.slot.is_empty()
    }

    /// Publishes a `snapshot` of the render and wakes the client.
    pub fn put(&self, snapshot: Snapshot) {
        self.shared.slot.put(snapshot);
        // The channel holds one wake-up; a full channel means that one is pending.
        let _ = self.notify.try_send(());
    }
}

/// Render of one scene that a session is tracing or has finished: film, schedule and times.
pub(super) struct ActiveRender {
    pub state: RenderState,
    pub schedule: Schedule,
    /// Time at which the compilation of the scene started.
    started: Instant,
    compiled_in: Duration,
    /// Total time that the render has spent on tracing rays.
    traced_for: Duration,
    /// Time from `started` to the first complete picture. `None` before that picture.
    pub first_picture_after: Option<Duration>,
    /// `true` if the errors of the tiles must be estimated again, because the light weights or the
    /// display transform have changed.
    pub estimates_stale: bool,
    throughput: Throughput,
    inventory: Arc<str>,
    downsample: Option<IncrementalDownsample>,
    first_hits: Option<Arc<FirstHitBuffer>>,
    /// Measured seconds per ray of the latest first-hit buffer; [`FIRST_HIT_RAY_SECONDS`] before
    /// the first.
    first_hit_ray_seconds: f64,
}

impl ActiveRender {
    /// Creates a render that has not traced yet. Its compilation began at `started`.
    fn new(state: RenderState, schedule: Schedule, started: Instant) -> Self {
        Self {
            schedule,
            started,
            compiled_in: started.elapsed(),
            traced_for: Duration::ZERO,
            first_picture_after: None,
            estimates_stale: false,
            throughput: Throughput::default(),
            inventory: Arc::from(state.world.inventory()),
            downsample: None,
            first_hits: None,
            first_hit_ray_seconds: FIRST_HIT_RAY_SECONDS,
            state,
        }
    }

    /// Compiles `scene` and starts its render. The memory of the film of `previous` is reused.
    ///
    /// # Errors
    /// Returns the first validation error of the scene.
    pub fn start(
        scene: &Arc<Scene>,
        options: &Options,
        settings: Settings,
        previous: Option<Self>,
    ) -> Result<Self, String> {
        let started = Instant::now();
        let (previous, measured) =
            previous.map(|previous| (previous.state, previous.first_hit_ray_seconds)).unzip();
        let state = RenderState::checked(scene, options, previous)?;
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let schedule = state.schedule(settings);
        let first_hit_ray_seconds = measured.unwrap_or(FIRST_HIT_RAY_SECONDS);
        Ok(Self { first_hit_ray_seconds, ..Self::new(state, schedule, started) })
    }

    /// Continues the render of `checkpoint` for `scene`. The scene may differ from that of the
    /// checkpoint in ways that need no new samples, such as colours of lights. The picture is then
    /// relit.
    ///
    /// # Errors
    /// Returns the reason why the checkpoint cannot be used for this scene.
    pub fn resume(
        scene: &Arc<Scene>,
        options: &Options,
        settings: Settings,
        checkpoint: Checkpoint,
    ) -> Result<Self, String> {
        let started = Instant::now();
        let resumed = checkpoint.resume(scene, options).map_err(|error| error.to_string())?;
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let schedule = resumed.schedule(settings).map_err(|error| error.to_string())?;
        let mut render = Self {
            traced_for: Duration::from_secs_f64(resumed.seconds),
            first_picture_after: Some(started.elapsed()),
            ..Self::new(resumed.state, schedule, started)
        };
        if resumed.is_relit {
            render.invalidate_estimates();
        }
        Ok(render)
    }

    /// Encodes the render as a checkpoint. Returns `None` before the first picture.
    pub fn checkpoint(
        &self,
        provenance: &Provenance,
        context: &WorkContext,
        state: State,
    ) -> Option<EncodedCheckpoint> {
        self.first_picture_after?;
        let report = self.report(context, state);
        let Self { state, schedule, .. } = self;
        Some(EncodedCheckpoint::new(state, schedule, &report, provenance, &context.pool))
    }

    /// Returns the seconds that the render has spent on tracing rays.
    pub fn seconds(&self) -> f64 {
        self.traced_for.as_secs_f64()
    }

    /// Shows the samples of the film as a picture of `scene` from now on, if they are valid for it.
    /// Returns `true` if they are valid; otherwise `false`.
    pub fn try_reuse(&mut self, scene: &Arc<Scene>) -> bool {
        let weights = self.state.mix.clone();
        if !self.state.try_reuse(scene) {
            return false;
        }
        self.schedule.set_rays_per_pixel(scene.film.rays_per_pixel);
        if self.state.mix != weights {
            self.invalidate_estimates();
        }
        true
    }

    /// Discards the noise estimates. They are no longer valid after a change of light weights or
    /// display transform.
    pub fn invalidate_estimates(&mut self) {
        self.schedule.forget_estimates();
        self.estimates_stale = true;
    }

    /// Discards the measured speed of tracing, for example after a change of the number of threads.
    pub fn reset_throughput(&mut self) {
        self.throughput = Throughput::default();
    }

    /// Estimates the errors of all tiles again. If `cancel_wave` becomes `true` before the end,
    /// returns `false` and changes nothing.
    pub fn reestimate(&mut self, pool: &rayon::ThreadPool, cancel_wave: &AtomicBool) -> bool {
        let (film, estimator) = (&self.state.film, self.state.estimator());
        let estimate =
            |tile: usize| -> Option<TileNoise> { estimator.tile_so_far(film.tile(tile)?) };
        let estimates: Option<Vec<_>> = pool.install(|| {
            let tiles = (0..film.tile_count()).into_par_iter().with_min_len(16);
            tiles
                .map(|tile| (!cancel_wave.load(Ordering::Relaxed)).then(|| estimate(tile)))
                .collect()
        });
        if let Some(estimates) = &estimates {
            self.schedule.set_estimates(estimates);
            self.estimates_stale = false;
        }
        estimates.is_some()
    }

    /// Traces `wave` (a set of jobs that run concurrently), or only a piece of it, and adds the
    /// samples to the film.
    pub fn trace(&mut self, wave: Wave, context: &WorkContext) {
        let flags = &context.shared;
        if self.first_picture_after.is_some() {
            let wave = self.piece(wave, context);
            let start = Instant::now();
            let report = self.state.trace_wave(&wave, &context.pool, &flags.cancel_wave);
            self.traced_for += start.elapsed();
            self.schedule.complete(&wave, &report);
            self.throughput.record(self.seconds(), self.schedule.samples());
            return;
        }
        self.update_first_hits(context, FIRST_HITS_SECONDS);
        let coarse = self.report(context, State::Tracing);
        let (frame, downsample) = (self.frame(context), &mut self.downsample);
        let start = Instant::now();
        let mut first = true;
        let mut publish = |film: &Film| {
            if !std::mem::take(&mut first) && !context.snapshot_wanted(false) {
                return;
            }
            let report = coarse.clone();
            context.put(frame.snapshot(film, Vec::new(), report, downsample, &context.pool));
        };
        let report = self.state.trace_first_pass(
            &wave,
            &context.pool,
            &flags.cancel_first_pass,
            &mut publish,
        );
        self.traced_for += start.elapsed();
        match report {
            Some(report) => {
                self.schedule.complete(&wave, &report);
                self.throughput.record(self.seconds(), self.schedule.samples());
                self.first_picture_after.get_or_insert_with(|| self.started.elapsed());
            }
            // The first pass was cancelled. Either a newer command is waiting, or the client raised
            // the cancel flag for this scene only after the worker had lowered it.
            None => self.state.film.restart(),
        }
    }

    /// Cuts `wave` (a set of jobs that run concurrently) to a piece of about [`PIECE_SECONDS`],
    /// with jobs of about [`JOB_SECONDS`].
    fn piece(&self, wave: Wave, context: &WorkContext) -> Wave {
        let seconds = PIECE_SECONDS[usize::from(context.view == View::default())];
        let Some(speed) = self.speed() else { return wave };
        let samples_per_thread_second = speed / context.pool.current_num_threads() as f64;
        let longest = (JOB_SECONDS * samples_per_thread_second / TILE_PIXELS) as u32
            / SAMPLE_ALIGNMENT
            * SAMPLE_ALIGNMENT;
        wave.cut((speed * seconds) as u64, longest.max(SAMPLE_ALIGNMENT))
    }

    /// Returns the samples traced per second in the latest second, or else since the start of the
    /// render. Returns `None` before the first measurement.
    fn speed(&self) -> Option<f64> {
        let seconds = self.seconds();
        let mean = || (seconds > 0.0).then(|| self.schedule.samples() as f64 / seconds);
        self.throughput.samples_per_second().or_else(mean)
    }

    /// Traces the first-hit buffer (first hits of camera rays) of the size that the client has
    /// requested. Does nothing if it has been traced already, or if it would take longer than
    /// `limit` seconds.
    fn update_first_hits(&mut self, context: &WorkContext, limit: f64) {
        let Some([columns, rows]) = context.view.raster else { return };
        if self.first_hits.as_ref().is_some_and(|f| [f.columns, f.rows] == [columns, rows]) {
            return;
        }
        self.first_hits = None;
        let rays = (columns * rows) as f64;
        if rays * self.first_hit_ray_seconds > limit {
            return;
        }
        let start = Instant::now();
        let RenderState { world, film, .. } = &self.state;
        let size = [film.width(), film.height()];
        let trace = |points: &[[f64; 2]], hits: &mut [_]| world.first_hit(points, hits);
        let first_hits = FirstHitBuffer::new(size, [columns, rows], trace, &context.pool);
        self.first_hits = Some(Arc::new(first_hits));
        self.first_hit_ray_seconds = start.elapsed().as_secs_f64() / rays.max(1.0);
    }

    fn frame(&self, context: &WorkContext) -> Frame {
        Frame {
            view: context.view,
            mix: self.state.mix.clone(),
            display: self.state.display(),
            lighting: Some(Arc::clone(self.state.lighting())),
            first_hits: self.first_hits.clone(),
        }
    }

    /// Publishes a snapshot of the render if one is wanted (see [`WorkContext::snapshot_wanted`]).
    /// `state` is the state of the session. `is_final` is `true` after the last wave (set of
    /// concurrent jobs) of the render.
    pub fn publish(&mut self, context: &WorkContext, state: State, is_final: bool) {
        // After a cancelled first pass the film has been cleared and is empty. The coarse picture
        // of that pass has been published already.
        if !context.snapshot_wanted(is_final) || self.first_picture_after.is_none() {
            return;
        }
        self.update_first_hits(context, f64::INFINITY);
        let (frame, report) = (self.frame(context), self.report(context, state));
        let noise = match report.noise {
            Some(_) => self.schedule.tile_noise_levels(),
            None => Vec::new(),
        };
        let downsample = &mut self.downsample;
        context.put(frame.snapshot(&self.state.film, noise, report, downsample, &context.pool));
    }

    /// Returns the report on the progress of the render; `state` is the state of the session.
    pub fn report(&self, context: &WorkContext, state: State) -> Report {
        let seconds = self.seconds();
        Report {
            generation: context.generation,
            state,
            spp: self.schedule.spp(),
            samples: self.schedule.samples(),
            rays: self.schedule.rays(),
            seconds,
            compile_seconds: self.compiled_in.as_secs_f64(),
            first_picture_seconds: self.first_picture_after.map(|time| time.as_secs_f64()),
            noise: self.schedule.noise(),
            eta_seconds: self.schedule.eta_seconds(seconds),
            quality_seconds: QUALITIES
                .map(|levels| self.schedule.seconds_to_noise(levels, seconds)),
            progress: self.schedule.progress(seconds),
            bad_samples: self.state.film.bad_samples().count,
            saturated_samples: self.state.film.saturated_samples(),
            saturated_pixels: self.state.film.saturated_pixels(),
            recent_samples_per_second: self.speed().unwrap_or(0.0),
            threads: context.pool.current_num_threads(),
            lanes: self.state.world.lanes(),
            inventory: Arc::clone(&self.inventory),
        }
    }
}
