//! Synchronous progressive render, which returns to the caller after each allocation round.
//! Measurements use it, because its samples do not depend on the moments at which a session would
//! publish snapshots.

use crate::schedule::{Schedule, Settings, Step, StoppedBy};

use crate::{Options, RenderState, threads};
use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use zerkalo_scene::Scene;

/// Progressive render that blocks the calling thread, without a background session.
pub struct SyncRender {
    /// Compiled scene and its film.
    pub state: RenderState,
    /// Schedule of the render, with its latest noise estimates.
    pub schedule: Schedule,
    /// Seconds that the render has spent on tracing rays, without scene compilation.
    pub seconds: f64,
    pool: rayon::ThreadPool,
}

impl SyncRender {
    /// Compiles `scene`, which must be valid, and prepares a render with `threads` threads.
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
        let pool = threads::pool(threads, 0)?;
        let state = RenderState::checked(&Arc::new(scene.clone()), options, None)
            .map_err(io::Error::other)?;
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let schedule = state.schedule(settings);
        Ok(Self { state, schedule, pool, seconds: 0.0 })
    }

    /// Traces the next allocation round: the samples that the schedule adds next, in both
    /// replicates (halves of the samples). Estimates the error of the picture if the schedule
    /// requests an estimate at the end of this round. Returns the stop criterion that ended the
    /// render, or `None` if it continues.
    pub fn step(&mut self) -> Option<StoppedBy> {
        loop {
            let wave = match self.schedule.next(self.seconds) {
                Step::Finished(reason) => return Some(reason),
                Step::Trace(wave) => wave,
            };
            let start = Instant::now();
            let report = self.state.trace_wave(&wave, &self.pool, &AtomicBool::new(false));
            self.seconds += start.elapsed().as_secs_f64();
            self.schedule.complete(&wave, &report);
            if wave.replicate == 1 {
                return None;
            }
        }
    }

    /// Returns the estimated RMSE of the displayed picture, in 8-bit levels. Returns `None` before
    /// the first estimate.
    pub fn noise_levels(&self) -> Option<f64> {
        self.schedule.noise().map(|noise| noise.rmse_levels)
    }

    /// Returns a lower and an upper estimate of the total seconds of tracing until the RMSE of the
    /// displayed picture falls to `levels` 8-bit levels. Returns `None` before the first estimate.
    pub fn seconds_to_noise(&self, levels: f64) -> Option<(f64, f64)> {
        let (low, high) = self.schedule.seconds_to_noise(levels, self.seconds)?;
        Some((self.seconds + low, self.seconds + high))
    }
}
