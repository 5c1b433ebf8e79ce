//! Synchronous progressive render in the caller's thread, for measurements that must not depend on the
//! times of snapshots.

use crate::render::schedule::{Schedule, Settings, Spp, Step, StoppedBy};

use crate::render::{Options, RenderState};
use crate::scene::Scene;
use std::io;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Synchronous progressive render.
pub struct SyncRender {
    rendering: RenderState,
    schedule: Schedule,
    pool: rayon::ThreadPool,
    seconds: f64,
}

impl SyncRender {
    /// Compiles `scene`, which has no faults, for `threads` threads.
    ///
    /// # Errors
    /// Returns the error of the system that refuses to start a thread.
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
        let rendering = RenderState::new(scene, options, None);
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let schedule = rendering.schedule(settings);
        Ok(Self { rendering, schedule, pool, seconds: 0.0 })
    }

    /// Traces the next decision of the schedule in both replicates, so that the picture's error is known
    /// afterwards. Returns the reason if nothing is left to do.
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

    /// Seconds of tracing so far, without compilation.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Number of samples so far, over all pixels.
    pub fn samples(&self) -> u64 {
        self.schedule.samples()
    }

    /// Samples per pixel.
    pub fn spp(&self) -> Spp {
        self.schedule.spp()
    }

    /// Estimated RMSE as displayed, in 8-bit levels.
    pub fn noise_codes(&self) -> Option<f64> {
        self.schedule.noise().map(|noise| noise.rmse_codes)
    }

    /// Lower and upper estimate of the total seconds of tracing at which that error falls to `codes` 8-bit
    /// levels; `None` before an error is known.
    pub fn seconds_to_noise(&self, codes: f64) -> Option<(f64, f64)> {
        let (low, high) = self.schedule.seconds_to_noise(codes, self.seconds)?;
        Some((self.seconds + low, self.seconds + high))
    }

    /// The world and the film.
    pub fn rendering(&self) -> &RenderState {
        &self.rendering
    }
}
