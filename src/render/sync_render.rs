//! A render in the caller's thread, one decision of the schedule after the other: for measurements,
//! where nothing may depend on when somebody looks.

use crate::render::schedule::{Schedule, Settings, Spp, Step, StoppedBy};

use crate::render::{Options, RenderState};
use crate::scene::Scene;
use std::io;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A render that is taken step by step.
pub struct SyncRender {
    rendering: RenderState,
    schedule: Schedule,
    pool: rayon::ThreadPool,
    seconds: f64,
}

impl SyncRender {
    /// Compiles `scene`, which has no faults, to be traced by `threads` threads. `Err`: they are not
    /// to be had.
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

    /// Traces what the schedule decides next, in both replicates, so that the picture's error is
    /// known afterwards. `Some`: there was nothing left to do, and why.
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

    /// Samples so far, over all pixels.
    pub fn samples(&self) -> u64 {
        self.schedule.samples()
    }

    /// Samples per pixel.
    pub fn spp(&self) -> Spp {
        self.schedule.spp()
    }

    /// The RMSE as displayed that the program itself would tell in codes.
    pub fn noise_codes(&self) -> Option<f64> {
        self.schedule.noise().map(|noise| noise.rmse_codes)
    }

    /// A lower and an upper guess of the seconds of tracing, in all, at which that error will have fallen
    /// to `codes`; `None` before an error is known.
    pub fn seconds_to_noise(&self, codes: f64) -> Option<(f64, f64)> {
        let (low, high) = self.schedule.seconds_to_noise(codes, self.seconds)?;
        Some((self.seconds + low, self.seconds + high))
    }

    /// The world and the film.
    pub fn rendering(&self) -> &RenderState {
        &self.rendering
    }
}
