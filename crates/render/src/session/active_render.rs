//! Active render of a session: traces one scene in pieces of a fraction of a second.

use crate::checkpoint::{Checkpoint, seconds_of};
use crate::film::{Film, TILE, Window};
use crate::first_hit_buffer::FirstHitBuffer;
use crate::schedule::{SAMPLE_ALIGNMENT, Schedule, Settings};
use crate::session::Shared;
use crate::session::report::{QUALITIES, Report, State};
use crate::session::snapshot::{Snapshot, View, ViewCache, tile_estimates};
use crate::wave::{JobReport, Wave};
use crate::{Options, RenderState};
use crossbeam_channel::{Receiver, Sender};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use zerkalo_scene::Scene;
use zerkalo_world::{self as world, Precision};

/// Target durations in seconds of a piece of a wave: while the client requests a picture or a
/// pixel, and while it requests neither.
const PIECE_SECONDS: [f64; 2] = [0.05, 0.25];
/// Time constant in seconds of the moving average of the tracing speed.
const SPEED_SECONDS: f64 = 1.0;
/// Target duration in seconds of a job. A running job cannot be cancelled.
const JOB_SECONDS: f64 = 0.005;
const TILE_PIXELS: f64 = crate::film::TILE_PIXELS as f64;
/// Longest expected duration, in seconds, of a first-hit buffer that is traced before the first
/// picture. Another buffer is traced after the picture.
const FIRST_HITS_SECONDS: f64 = 0.002;
/// Assumed seconds per ray of a first-hit buffer before the first measurement; typical of a small
/// scene.
const FIRST_HIT_RAY_SECONDS: f64 = 5e-8;

/// Resources that a session's thread uses.
pub(super) struct WorkContext {
    pub pool: rayon::ThreadPool,
    pub shared: Arc<Shared>,
    /// Sending end of the channel of the latest snapshot; `published` is the receiving end.
    pub publisher: Sender<Snapshot>,
    pub published: Receiver<Snapshot>,
    pub view: View,
    pub generation: u64,
}

impl WorkContext {
    /// Returns `true` if a snapshot should be published now. A picture takes time to create. It is
    /// therefore published only if the client has taken the previous one, or at the end of the
    /// render (`is_final`).
    fn snapshot_wanted(&self, is_final: bool) -> bool {
        is_final || self.view == View::default() || self.published.is_empty()
    }

    /// Publishes a snapshot, which replaces one that the client has not taken.
    pub fn put(&self, snapshot: Snapshot) {
        let _ = self.published.try_recv();
        // Only this thread sends, so that the channel is still empty.
        let _ = self.publisher.try_send(snapshot);
    }
}

/// Render of one scene that a session traces or has finished.
pub(super) struct ActiveRender {
    pub state: RenderState,
    pub schedule: Schedule,
    /// Start of the compilation.
    started: Instant,
    compiled_in: Duration,
    /// Total time of tracing.
    traced_for: Duration,
    /// Time from `started` to the first complete picture.
    pub first_picture_after: Option<Duration>,
    /// `true` if light weights or display transform have changed since the errors were estimated.
    pub estimates_stale: bool,
    /// Average of the samples traced per second, over about the latest second. `None` before the
    /// first measurement.
    speed: Option<f64>,
    inventory: Arc<str>,
    cache: ViewCache,
    first_hits: Option<Arc<FirstHitBuffer>>,
    /// Error of rounding because of which this render is in double precision.
    rounding_avoided: Option<f64>,
    /// Seconds per ray that the latest first-hit buffer took.
    first_hit_ray_seconds: f64,
}

impl ActiveRender {
    fn new(state: RenderState, schedule: Schedule, started: Instant) -> Self {
        Self {
            schedule,
            started,
            compiled_in: started.elapsed(),
            traced_for: Duration::ZERO,
            first_picture_after: None,
            estimates_stale: false,
            speed: None,
            inventory: Arc::from(&*state.world.info().inventory),
            cache: ViewCache::default(),
            first_hits: None,
            rounding_avoided: None,
            first_hit_ray_seconds: FIRST_HIT_RAY_SECONDS,
            state,
        }
    }

    /// Compiles `scene` and starts its render, which reuses the memory of `previous`. Fails with
    /// the first validation error of the scene, or if there is not enough memory.
    pub fn start(
        scene: &Arc<Scene>,
        options: &Options,
        settings: Settings,
        previous: Option<Self>,
    ) -> Result<Self, String> {
        let started = Instant::now();
        let (previous, measured) =
            previous.map(|previous| (previous.state, previous.first_hit_ray_seconds)).unzip();
        let state = RenderState::new(scene, options, previous)?;
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let schedule = state.schedule(settings);
        let first_hit_ray_seconds = measured.unwrap_or(FIRST_HIT_RAY_SECONDS);
        Ok(Self { first_hit_ray_seconds, ..Self::new(state, schedule, started) })
    }

    /// Shows `scene`, in which a material is rougher or as rough as before, with the samples of this
    /// render or an earlier one. Fails with one of them if `scene` needs other samples.
    pub fn turn(self, scene: &Arc<Scene>, options: &Options) -> Result<Self, Box<Self>> {
        let started = Instant::now();
        let Self { first_hit_ray_seconds, speed, first_picture_after, .. } = self;
        let (state, schedule) = match self.state.turn(scene, options, self.schedule) {
            Ok(turned) => turned,
            Err(render) => {
                let (state, schedule) = *render;
                return Err(Box::new(Self { state, schedule, ..self }));
            }
        };
        let is_base = schedule.samples > 0;
        let mut render = Self::new(state, schedule, started);
        (render.first_hit_ray_seconds, render.speed) = (first_hit_ray_seconds, speed);
        if is_base {
            render.first_picture_after = first_picture_after;
            render.invalidate_estimates();
        }
        Ok(render)
    }

    /// Continues the render of `checkpoint` with the lights of `scene`. Fails if the checkpoint
    /// cannot be used for this scene.
    pub fn resume(
        scene: &Arc<Scene>,
        options: &Options,
        settings: Settings,
        checkpoint: Checkpoint,
    ) -> Result<Self, String> {
        let started = Instant::now();
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let seconds = seconds_of(&checkpoint.header);
        let (weights, display) = (checkpoint.header.weights.clone(), checkpoint.header.display);
        let resumed = checkpoint.resume(scene, options, settings);
        let (state, schedule) = resumed.map_err(|error| error.to_string())?;
        let mut render = Self {
            traced_for: Duration::from_secs_f64(seconds),
            first_picture_after: Some(started.elapsed()),
            ..Self::new(state, schedule, started)
        };
        if render.state.weights != weights || render.state.display() != display {
            render.invalidate_estimates();
        }
        Ok(render)
    }

    pub fn seconds(&self) -> f64 {
        self.traced_for.as_secs_f64()
    }

    /// Shows `scene` by a change of light weights and returns `true`. Returns `false`, without a
    /// change, if `scene` has faults or needs new samples.
    pub fn try_reuse(&mut self, scene: &Arc<Scene>) -> bool {
        let weights = self.state.weights.clone();
        if !self.state.try_reuse(scene) {
            return false;
        }
        self.schedule.settings.rays_per_pixel = scene.film.rays_per_pixel;
        if self.state.weights != weights {
            self.invalidate_estimates();
        }
        true
    }

    /// Discards the noise estimates after a change of light weights or display transform.
    pub fn invalidate_estimates(&mut self) {
        self.schedule.forget_estimates();
        self.estimates_stale = true;
    }

    /// Records the report of a wave that took the time `traced_for`.
    fn complete(&mut self, wave: &Wave, reports: &[Option<JobReport>], traced_for: Duration) {
        let before = self.schedule.samples;
        self.schedule.complete(wave, reports);
        self.traced_for += traced_for;
        let (samples, seconds) = (self.schedule.samples - before, traced_for.as_secs_f64());
        // All jobs of a cancelled wave may be missing.
        if samples > 0 {
            let speed = samples as f64 / seconds.max(1e-9);
            let weight = 1.0 - (-seconds / SPEED_SECONDS).exp();
            self.speed = Some(self.speed.map_or(speed, |mean| mean + weight * (speed - mean)));
        }
    }

    /// Estimates the errors of all tiles again and returns `true`. Returns `false`, without a
    /// change, if `cancel_wave` becomes `true` before the end.
    pub fn reestimate(&mut self, pool: &rayon::ThreadPool, cancel_wave: &AtomicBool) -> bool {
        let RenderState { film, .. } = &self.state;
        let estimates = tile_estimates(film, self.state.estimator(), pool, cancel_wave);
        if let Some(estimates) = &estimates {
            self.schedule.set_estimates(estimates);
            self.estimates_stale = false;
        }
        estimates.is_some()
    }

    /// Traces `wave`, or only a piece of it, and adds the samples to the film. Before the first
    /// picture, traces the first pass and publishes a snapshot after each stage.
    pub fn trace(&mut self, wave: Wave, context: &WorkContext) {
        let flags = &context.shared;
        if self.first_picture_after.is_some() || self.state.mix.is_some() {
            let wave = self.piece(wave, context);
            let start = Instant::now();
            let report = self.state.trace_wave(&wave, &context.pool, &flags.cancel_wave);
            self.complete(&wave, &report, start.elapsed());
            if let Some(mix) = &self.state.mix {
                mix.continue_tiles(&wave, &mut self.schedule);
                if self.schedule.spp().min > 0 {
                    self.first_picture_after.get_or_insert_with(|| self.started.elapsed());
                }
            }
            self.probe_errors(context);
            return;
        }
        self.update_first_hits(context, FIRST_HITS_SECONDS);
        let coarse = self.snapshot(context, State::Tracing);
        let (display, cache) = (self.state.display(), &mut self.cache);
        let start = Instant::now();
        let mut first = true;
        let mut publish = |film: &Film| {
            if std::mem::take(&mut first) || context.snapshot_wanted(false) {
                let snapshot = coarse.clone();
                context.put(snapshot.with_view(film, &display, &[], context, cache));
            }
        };
        let report = self.state.trace_first_pass(
            &wave,
            &context.pool,
            &flags.cancel_first_pass,
            &mut publish,
        );
        let traced_for = start.elapsed();
        match report {
            Some(report) => {
                self.complete(&wave, &report, traced_for);
                self.first_picture_after.get_or_insert_with(|| self.started.elapsed());
            }
            // The pass was cancelled: a newer command is waiting, or the client raised the flag for
            // this scene only after the worker had lowered it.
            None => {
                self.traced_for += traced_for;
                self.state.film.restart();
            }
        }
    }

    /// Probes the errors of rounding and of cut paths, if a probe is due.
    fn probe_errors(&mut self, context: &WorkContext) {
        let Some(packets) = self.schedule.due_probe() else { return };
        let cancel = &context.shared.cancel_wave;
        if let Some(sums) = self.state.probe_errors(packets, &context.pool, cancel) {
            self.schedule.record_probe(&sums);
        }
    }

    /// Starts the render again in double precision, if `options` leave the choice of precision to
    /// the program and the error of rounding is too large. Fails if there is not enough memory.
    pub fn avoid_rounding(self, options: &Options) -> Result<Self, String> {
        let rounding = self.schedule.excessive_rounding();
        if options.world.precision != Precision::Auto || rounding.is_none() {
            return Ok(self);
        }
        let double = world::Options { precision: Precision::Double, ..options.world.clone() };
        let options = Options { world: double, ..options.clone() };
        let (scene, settings) = (Arc::clone(self.state.scene()), self.schedule.settings);
        let traced_for = self.traced_for;
        let started = Self::start(&scene, &options, settings, Some(self))?;
        Ok(Self { rounding_avoided: rounding, traced_for, ..started })
    }

    /// Cuts `wave` to a piece of about [`PIECE_SECONDS`], with jobs of about [`JOB_SECONDS`].
    fn piece(&self, wave: Wave, context: &WorkContext) -> Wave {
        let seconds = PIECE_SECONDS[usize::from(context.view == View::default())];
        let Some(speed) = self.speed else { return wave };
        let samples_per_thread_second = speed / context.pool.current_num_threads() as f64;
        let longest = (JOB_SECONDS * samples_per_thread_second / TILE_PIXELS) as u32
            / SAMPLE_ALIGNMENT
            * SAMPLE_ALIGNMENT;
        wave.cut((speed * seconds) as u64, longest.max(SAMPLE_ALIGNMENT))
    }

    /// Gives samples only to the tiles of `region`, or to all without one.
    pub fn set_region(&mut self, region: Option<Window>) {
        let columns = self.state.film.tile_columns();
        let is_in = |Window { origin, size }: Window, tile: usize| {
            let start = [tile % columns * TILE, tile / columns * TILE];
            (0..2).all(|i| start[i] < origin[i] + size[i] && start[i] + TILE > origin[i])
        };
        self.schedule.set_resting(|tile| region.is_some_and(|region| !is_in(region, tile)));
    }

    /// Traces the first-hit buffer that the client has requested, unless it exists already or is
    /// expected to take longer than `limit` seconds.
    fn update_first_hits(&mut self, context: &WorkContext, limit: f64) {
        let View { raster, hits, .. } = context.view;
        let Some([columns, rows]) = hits.or(raster) else { return };
        let RenderState { world, film, .. } = &self.state;
        let window = context.view.window_of([film.header.width, film.header.height]);
        let wanted = (window, [columns, rows]);
        if self.first_hits.as_ref().is_some_and(|f| (f.window, [f.columns, f.rows]) == wanted) {
            return;
        }
        self.first_hits = None;
        let rays = (columns * rows) as f64;
        if rays * self.first_hit_ray_seconds > limit {
            return;
        }
        let start = Instant::now();
        let trace = |points: &[[f64; 2]], hits: &mut [_]| world.first_hit(points, hits);
        let first_hits = FirstHitBuffer::new(window, [columns, rows], trace, &context.pool);
        self.first_hits = Some(Arc::new(first_hits));
        self.first_hit_ray_seconds = start.elapsed().as_secs_f64() / rays.max(1.0);
    }

    /// Creates a snapshot without the parts that [`Snapshot::with_view`] adds.
    fn snapshot(&self, context: &WorkContext, state: State) -> Snapshot {
        Snapshot {
            report: self.report(context, state),
            weights: self.state.weights.clone(),
            lighting: Some(Arc::clone(&self.state.lighting)),
            first_hits: self.first_hits.clone(),
            ..Snapshot::default()
        }
    }

    /// Publishes a snapshot if one is wanted. `is_final` is `true` after the last wave.
    pub fn publish(&mut self, context: &WorkContext, state: State, is_final: bool) {
        // A cancelled first pass leaves an empty film; its coarse picture has been published
        // already.
        let has_picture = self.first_picture_after.is_some() || self.state.mix.is_some();
        if !context.snapshot_wanted(is_final) || !has_picture {
            return;
        }
        self.update_first_hits(context, f64::INFINITY);
        let snapshot = self.snapshot(context, state);
        let estimates: Vec<_> = match snapshot.report.noise {
            Some(_) => self.schedule.tile_estimates().collect(),
            None => Vec::new(),
        };
        let (film, display) = (&self.state.film, self.state.display());
        let cache = &mut self.cache;
        context.put(snapshot.with_view(film, &display, &estimates, context, cache));
    }

    pub fn report(&self, context: &WorkContext, state: State) -> Report {
        let seconds = self.seconds();
        Report {
            generation: context.generation,
            state,
            spp: self.schedule.spp(),
            samples: self.schedule.samples,
            rays: self.schedule.rays,
            seconds,
            compile_seconds: self.compiled_in.as_secs_f64(),
            first_picture_seconds: self.first_picture_after.map(|time| time.as_secs_f64()),
            noise: self.schedule.noise,
            error: self.schedule.error_parts(&self.state.world.info().left_out),
            probe_seconds: self.state.probe_seconds(),
            rounding_avoided: self.rounding_avoided,
            mixed: self.state.mix.is_some(),
            eta_seconds: self.schedule.eta_seconds(seconds),
            quality_seconds: QUALITIES
                .map(|levels| self.schedule.seconds_to_noise(levels, seconds)),
            progress: self.schedule.progress(seconds),
            bad_samples: self.state.film.bad_samples(),
            saturated_samples: self.state.film.saturated_samples(),
            saturated_pixels: self.state.film.saturated_pixels(),
            recent_samples_per_second: self.speed.unwrap_or(0.0),
            threads: context.pool.current_num_threads(),
            precision: Some(self.state.world.info().precision),
            lanes: self.state.world.info().lanes,
            inventory: Arc::clone(&self.inventory),
        }
    }
}
