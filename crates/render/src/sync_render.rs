//! Synchronous render, which returns after each round. Measurements use it, because its samples do
//! not depend on the moments at which a session would publish snapshots.

use crate::schedule::{Schedule, Settings, Step, StoppedBy};
use crate::{ErrorParts, Options, RenderState, threads};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use zerkalo_scene::Scene;

/// Progressive render that blocks the calling thread.
pub struct SyncRender {
    pub state: RenderState,
    pub schedule: Schedule,
    /// Seconds of tracing, without compilation.
    pub seconds: f64,
    /// Request to end [`SyncRender::step`] at once.
    pub cancel: Arc<AtomicBool>,
    pool: rayon::ThreadPool,
}

impl SyncRender {
    /// Compiles `scene`, which must be valid. Fails if a thread cannot be started, or if there is
    /// not enough memory.
    pub fn new(
        scene: &Scene,
        options: &Options,
        settings: Settings,
        threads: usize,
    ) -> io::Result<Self> {
        let pool = threads::pool(threads)?;
        let state =
            RenderState::new(&Arc::new(scene.clone()), options, None).map_err(io::Error::other)?;
        let settings = Settings { rays_per_pixel: scene.film.rays_per_pixel, ..settings };
        let schedule = state.schedule(settings);
        Ok(Self { state, schedule, pool, seconds: 0.0, cancel: Arc::default() })
    }

    /// Shows `scene` with the samples of this render, as `RenderState::turn` does. Returns `None` if
    /// `scene` needs other samples.
    pub fn turn(self, scene: &Scene, options: &Options) -> Option<Self> {
        let turned = self.state.turn(&Arc::new(scene.clone()), options, self.schedule).ok();
        let (state, schedule) = turned?;
        Some(Self { state, schedule, seconds: 0.0, ..self })
    }

    /// Traces the next round. Returns the stop criterion that ended the render, or `None` if it
    /// continues.
    pub fn step(&mut self) -> Option<StoppedBy> {
        loop {
            let wave = match self.schedule.next(self.seconds) {
                Step::Finished(reason) => return Some(reason),
                Step::Trace(wave) => wave,
            };
            let start = Instant::now();
            let report = self.state.trace_wave(&wave, &self.pool, &self.cancel);
            self.seconds += start.elapsed().as_secs_f64();
            self.schedule.complete(&wave, &report);
            if let Some(mix) = &self.state.mix {
                mix.continue_tiles(&wave, &mut self.schedule);
            }
            if let Some(packets) = self.schedule.due_probe() {
                let sums = self.state.probe_errors(packets, &self.pool, &self.cancel);
                sums.iter().for_each(|sums| self.schedule.record_probe(sums));
            }
            if wave.replicate == 1 || self.cancel.load(Ordering::Relaxed) {
                return None;
            }
        }
    }

    /// Returns the parts of the error. Returns `None` before the first estimate of the noise.
    pub fn error_parts(&self) -> Option<ErrorParts> {
        self.schedule.error_parts(&self.state.world.info().left_out)
    }

    /// Returns the estimated RMSE in 8-bit levels. Returns `None` before the first estimate.
    pub fn noise_levels(&self) -> Option<f64> {
        self.schedule.noise.map(|noise| noise.rmse.levels)
    }
}
