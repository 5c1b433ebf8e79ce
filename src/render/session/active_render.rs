//! A scene in work: tracing it piece by piece, judging it, showing it.

use crate::film::{IncrementalDownsample, TileNoise};
use crate::render::feature_buffer::FeatureBuffer;
use crate::render::schedule::{SAMPLE_ALIGNMENT, Schedule, Settings};
use crate::render::session::report::{QUALITIES, Report, State};
use crate::render::session::snapshot::{Frame, Snapshot, View};
use crate::render::session::throughput::Throughput;
use crate::render::session::{RenderBackend, Shared};
use crate::render::wave::Wave;
use crate::scene::Scene;
use crossbeam_channel::Sender;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Seconds that a piece of a wave should take: for a guest who looks, and for one who does not.
const PIECE_SECONDS: [f64; 2] = [0.05, 0.25];
/// Seconds that one job should take: it cannot be interrupted.
const JOB_SECONDS: f64 = 0.005;
/// Pixels of a tile.
const PIXELS: f64 = crate::film::TILE_PIXELS as f64;
/// The first picture waits for a guide that takes no longer than this.
const GUIDE_SECONDS: f64 = 0.002;
/// Seconds per ray of a guide before one has been made: that of a small scene.
const GUIDE_RAY_SECONDS: f64 = 5e-8;

/// What the work is done with, and where snapshots go.
pub(super) struct WorkContext<'a> {
    pub pool: &'a rayon::ThreadPool,
    pub shared: &'a Shared,
    pub notify: &'a Sender<()>,
    pub view: View,
    pub generation: u64,
}

impl WorkContext<'_> {
    /// Whether a snapshot is wanted. Between waves (`newest`: false) the guest first has to take the
    /// last picture: the new one would only be replaced before it is seen, and making it costs time.
    fn snapshot_wanted(&self, newest: bool) -> bool {
        newest || self.view == View::default() || self.shared.slot.is_empty()
    }

    pub fn put(&self, snapshot: Snapshot) {
        self.shared.slot.put(snapshot);
        // A bell that is ringing already will do.
        let _ = self.notify.try_send(());
    }
}

/// A scene in work.
pub(super) struct ActiveRender<T> {
    pub traced: T,
    pub schedule: Schedule,
    /// When the scene was taken up.
    begun: Instant,
    compiled_in: Duration,
    /// Time spent in waves.
    traced_for: Duration,
    pub first_picture: Option<Duration>,
    /// The tiles' errors have to be estimated anew.
    pub misjudged: bool,
    pace: Throughput,
    inventory: Arc<str>,
    raster: Option<IncrementalDownsample>,
    guide: Option<Arc<FeatureBuffer>>,
    /// Seconds per ray of the latest guide.
    guide_ray_seconds: f64,
}

impl<T: RenderBackend> ActiveRender<T> {
    /// Takes up a scene after another one. `Err`: why it cannot be rendered.
    pub fn begin(
        scene: &Arc<Scene>,
        options: &T::Options,
        settings: Settings,
        before: Option<Self>,
    ) -> Result<Self, String> {
        let begun = Instant::now();
        let guide_ray_seconds = before.as_ref().map_or(GUIDE_RAY_SECONDS, |b| b.guide_ray_seconds);
        let traced = T::begin(scene, options, before.map(|b| b.traced))?;
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        Ok(Self {
            schedule: traced.schedule(settings),
            begun,
            compiled_in: begun.elapsed(),
            traced_for: Duration::ZERO,
            first_picture: None,
            misjudged: false,
            pace: Throughput::default(),
            inventory: Arc::from(traced.inventory()),
            raster: None,
            guide: None,
            guide_ray_seconds,
            traced,
        })
    }

    /// Seconds spent on tracing.
    pub fn seconds(&self) -> f64 {
        self.traced_for.as_secs_f64()
    }

    /// Goes on with `scene` if the samples serve it, too.
    pub fn try_reuse(&mut self, scene: &Arc<Scene>) -> bool {
        let mix = self.traced.mix().clone();
        if !self.traced.try_reuse(scene) {
            return false;
        }
        self.schedule.set_rays_per_pixel(scene.film.rays_per_pixel);
        if *self.traced.mix() != mix {
            self.invalidate_estimates();
        }
        true
    }

    /// The same samples look otherwise now.
    pub fn invalidate_estimates(&mut self) {
        self.schedule.forget_estimates();
        self.misjudged = true;
    }

    /// The speed so far says nothing any more.
    pub fn forget_pace(&mut self) {
        self.pace = Throughput::default();
    }

    /// Estimates the errors of all tiles. False: it was interrupted, and nothing has changed.
    pub fn reestimate(&mut self, pool: &rayon::ThreadPool, cancel_wave: &AtomicBool) -> bool {
        let (film, estimator) = (self.traced.film(), self.traced.estimator());
        let estimate = |tile: usize| -> Option<(u32, TileNoise)> {
            let tile = film.tile(tile)?;
            let [a, b] = tile.counts();
            Some((a.midpoint(b), estimator.tile_so_far(tile)?))
        };
        let estimates: Option<Vec<_>> = pool.install(|| {
            let tiles = (0..film.tile_count()).into_par_iter().with_min_len(16);
            tiles.map(|t| (!cancel_wave.load(Ordering::Relaxed)).then(|| estimate(t))).collect()
        });
        if let Some(estimates) = &estimates {
            self.schedule.set_estimates(estimates);
            self.misjudged = false;
        }
        estimates.is_some()
    }

    /// Traces `wave` or a piece of it.
    pub fn trace(&mut self, wave: Wave, site: &WorkContext) {
        let marks = site.shared;
        if self.first_picture.is_some() {
            let wave = self.piece(wave, site);
            let start = Instant::now();
            let report = self.traced.run(&wave, site.pool, &marks.cancel_wave);
            self.traced_for += start.elapsed();
            self.schedule.complete(&wave, &report);
            self.pace.note(self.seconds(), self.schedule.samples());
            return;
        }
        self.look(site, GUIDE_SECONDS);
        let coarse = self.report(site, State::Tracing);
        let (frame, raster) = (self.frame(site), &mut self.raster);
        let start = Instant::now();
        let mut first = true;
        let report = self.traced.first(&wave, site.pool, &marks.cancel_first_pass, &mut |film| {
            if !std::mem::take(&mut first) && !site.snapshot_wanted(false) {
                return;
            }
            site.put(frame.snapshot(film, Vec::new(), coarse.clone(), raster, site.pool));
        });
        self.traced_for += start.elapsed();
        match report {
            Some(report) => {
                self.schedule.complete(&wave, &report);
                self.pace.note(self.seconds(), self.schedule.samples());
                self.first_picture.get_or_insert_with(|| self.begun.elapsed());
            }
            // Abandoned for a newer scene; or by a mark that was raised late, for this very scene.
            None => self.traced.restart(),
        }
    }

    /// As much of `wave` as takes a short time, in jobs that take a very short one.
    fn piece(&self, wave: Wave, site: &WorkContext) -> Wave {
        let seconds = PIECE_SECONDS[usize::from(site.view == View::default())];
        let Some(speed) = self.pace.samples_per_second().or_else(|| self.mean_speed()) else {
            return wave;
        };
        let of_thread = speed / site.pool.current_num_threads() as f64;
        let longest =
            (JOB_SECONDS * of_thread / PIXELS) as u32 / SAMPLE_ALIGNMENT * SAMPLE_ALIGNMENT;
        wave.cut((speed * seconds) as u64, longest.max(SAMPLE_ALIGNMENT))
    }

    fn mean_speed(&self) -> Option<f64> {
        let seconds = self.seconds();
        (seconds > 0.0).then(|| self.schedule.samples() as f64 / seconds)
    }

    /// Makes the guide for the guest's raster if there is none yet and it will take at most `limit`
    /// seconds.
    fn look(&mut self, site: &WorkContext, limit: f64) {
        let Some([columns, rows]) = site.view.raster else { return };
        if self.guide.as_ref().is_some_and(|g| [g.columns, g.rows] == [columns, rows]) {
            return;
        }
        self.guide = None;
        let rays = (columns * rows) as f64;
        if rays * self.guide_ray_seconds > limit {
            return;
        }
        let start = Instant::now();
        let film = self.traced.film();
        let size = [film.width(), film.height()];
        let look = |points: &[[f64; 2]], seen: &mut [_]| self.traced.look(points, seen);
        self.guide = Some(Arc::new(FeatureBuffer::new(size, [columns, rows], look, site.pool)));
        self.guide_ray_seconds = start.elapsed().as_secs_f64() / rays.max(1.0);
    }

    fn frame(&self, site: &WorkContext) -> Frame {
        Frame {
            view: site.view,
            mix: self.traced.mix().clone(),
            display: self.traced.display(),
            lighting: Arc::clone(self.traced.lighting()),
            guide: self.guide.clone(),
        }
    }

    /// Shows where the work stands; see [`WorkContext::snapshot_wanted`].
    pub fn publish(&mut self, site: &WorkContext, state: State, newest: bool) {
        // A film that was emptied for another start has nothing to show; its first picture was shown.
        if !site.snapshot_wanted(newest) || self.first_picture.is_none() {
            return;
        }
        self.look(site, f64::INFINITY);
        let (frame, report) = (self.frame(site), self.report(site, state));
        let noise = match report.noise {
            Some(_) => self.schedule.tile_noise_codes(),
            None => Vec::new(),
        };
        let raster = &mut self.raster;
        site.put(frame.snapshot(self.traced.film(), noise, report, raster, site.pool));
    }

    pub fn report(&self, site: &WorkContext, state: State) -> Report {
        let seconds = self.seconds();
        Report {
            generation: site.generation,
            state,
            spp: self.schedule.spp(),
            samples: self.schedule.samples(),
            rays: self.schedule.rays(),
            seconds,
            compile_seconds: self.compiled_in.as_secs_f64(),
            first_picture_seconds: self.first_picture.map(|t| t.as_secs_f64()),
            noise: self.schedule.noise(),
            eta_seconds: self.schedule.eta_seconds(seconds),
            quality_seconds: QUALITIES.map(|codes| self.schedule.seconds_to_noise(codes, seconds)),
            progress: self.schedule.progress(seconds),
            bad_samples: self.traced.film().bad_samples().count,
            saturated_samples: self.traced.film().saturated_samples(),
            saturated_pixels: self.traced.film().saturated_pixels(),
            recent_samples_per_second: self
                .pace
                .samples_per_second()
                .or_else(|| self.mean_speed())
                .unwrap_or(0.0),
            threads: site.pool.current_num_threads(),
            lanes: self.traced.lanes(),
            inventory: Arc::clone(&self.inventory),
        }
    }
}
