//! Synchronous progressive render in the caller's thread. Measurements use it, because its
//! decisions do not depend on the times of snapshots.

use crate::render::schedule::{Schedule, Settings, Spp, Step, StoppedBy};

use crate::render::{Options, RenderState};
use crate::scene::Scene;
use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Progressive render on the calling thread, without a session.
pub struct SyncRender {
    rendering: RenderState,
    schedule: Schedule,
    pool: rayon::ThreadPool,
    seconds: f64,
}

impl SyncRender {
    /// Compiles `scene`, which has no validation errors, for `threads` threads.
    ///
    /// # Errors
    /// Returns the operating system's error if a thread cannot be started, or an error if there is
    /// not enough memory for the film.
    pub fn new(
        scene: &Scene,
        options: &Options,
        settings: Settings,
        threads: usize,
    ) -> io::Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(io::Error::other)?;
        let rendering = RenderState::checked(&Arc::new(scene.clone()), options, None)
            .map_err(io::Error::other)?;
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let schedule = rendering.schedule(settings);
        Ok(Self { rendering, schedule, pool, seconds: 0.0 })
    }

    /// Traces the next decision of the schedule in both replicates and estimates the error of the
    /// picture. Returns the stop criterion that ended the render, or `None` if it continues.
    pub fn step(&mut self) -> Option<StoppedBy> {
        loop {
            let wave = match self.schedule.next(self.seconds) {
                Step::Finished(reason) => return Some(reason),
                Step::Trace(wave) => wave,
            };
            let start = Instant::now();
            let report = self.rendering.trace_wave(&wave, &self.pool, &AtomicBool::new(false));
            self.seconds += start.elapsed().as_secs_f64();
            self.schedule.complete(&wave, &report);
            if wave.replicate == 1 {
                return None;
            }
        }
    }

    /// Seconds spent on tracing so far, without compilation.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Number of samples traced so far, over all pixels.
    pub fn samples(&self) -> u64 {
        self.schedule.samples()
    }

    /// Samples per pixel so far.
    pub fn spp(&self) -> Spp {
        self.schedule.spp()
    }

    /// Estimated RMSE of the displayed picture, in 8-bit levels. `None` before the first estimate.
    pub fn noise_codes(&self) -> Option<f64> {
        self.schedule.noise().map(|noise| noise.rmse_codes)
    }

    /// Lower and upper estimate of the total seconds of tracing until the displayed RMSE is `codes`
    /// 8-bit levels. `None` before the first estimate.
    pub fn seconds_to_noise(&self, codes: f64) -> Option<(f64, f64)> {
        let (low, high) = self.schedule.seconds_to_noise(codes, self.seconds)?;
        Some((self.seconds + low, self.seconds + high))
    }

    /// The schedule, with its latest noise estimates.
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// The compiled scene and its film.
    pub fn rendering(&self) -> &RenderState {
        &self.rendering
    }
}
