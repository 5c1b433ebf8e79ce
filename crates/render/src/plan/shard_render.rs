//! Render of the samples of one shard, in steps between which the film can be saved.

use crate::film::TILE_PIXELS;
use crate::schedule::{Interval, SAMPLE_ALIGNMENT, Spp};
use crate::session::{Report, State};
use crate::wave::{Job, Wave};
use crate::{RenderState, threads};
use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Target duration in seconds of a step.
const STEP_SECONDS: f64 = 0.25;
/// Target duration in seconds of a job. Jobs are short, so that all threads have work until the end
/// of a step.
const JOB_SECONDS: f64 = 0.01;
/// Largest number of samples per pixel of a job.
const LONGEST_JOB: u32 = 1 << 20;
/// Number of samples, over all pixels, of the first step, which measures the speed.
const FIRST_STEP_SAMPLES: u64 = 1 << 18;

/// Render of the samples of one shard. After each step, both replicates of every tile hold equally
/// many samples: the first ones of the shard's range. A film that was saved between two steps can
/// therefore be continued.
pub struct ShardRender {
    pub state: RenderState,
    pool: rayon::ThreadPool,
    /// Jobs that remain to be traced, in both replicates.
    remaining: Vec<Job>,
    /// Number of samples of the complete shard, and in the film so far, over all pixels and
    /// replicates.
    samples: [u64; 2],
    pub rays: u64,
    /// Number of samples traced in all steps so far, and the seconds that they took.
    measured: (u64, f64),
}

impl ShardRender {
    /// Creates the render of a shard with the sample indices `ranges` in each tile. The film of
    /// `state` may already hold the first samples, which took `rays` rays. Fails if the film's
    /// sample counts cannot come from an interrupted render of these ranges, or if a thread cannot
    /// be started.
    pub fn new(
        state: RenderState,
        ranges: &[Range<u32>],
        rays: u64,
        threads: usize,
    ) -> Result<Self, String> {
        let pool = threads::pool(threads).map_err(|error| error.to_string())?;
        let mut remaining = Vec::new();
        let mut samples = [0; 2];
        for (tile, range) in ranges.iter().enumerate() {
            let counts = state.film.counts(tile);
            let [done, total] = [counts[0], range.len() as u32];
            if counts[1] != done || done > total {
                let what = format!("{counts:?} samples in A and B of tile {tile}");
                return Err(format!("the film has {what}, which are not those of its shard"));
            }
            let pixels = state.film.tile_pixels(tile);
            samples[0] += 2 * u64::from(total) * pixels;
            samples[1] += 2 * u64::from(done) * pixels;
            if done < total {
                let job = Job { tile: tile as u32, first: range.start + done, count: total - done };
                remaining.push(job);
            }
        }
        Ok(Self { state, pool, remaining, samples, rays, measured: (0, 0.0) })
    }

    /// Traces samples for about a quarter of a second. Returns `false` if there were none to trace.
    pub fn step(&mut self) -> bool {
        let speed = match self.measured {
            (samples, seconds) if seconds > 0.0 => samples as f64 / seconds,
            _ => FIRST_STEP_SAMPLES as f64 / STEP_SECONDS,
        };
        let threads = self.pool.current_num_threads() as f64;
        // A job is traced twice, once for each replicate.
        let longest = (0.5 * JOB_SECONDS * speed / threads / TILE_PIXELS as f64) as u32;
        let longest =
            longest.min(LONGEST_JOB).next_multiple_of(SAMPLE_ALIGNMENT).max(SAMPLE_ALIGNMENT);
        let all = Wave { replicate: 0, jobs: self.remaining.clone(), estimate: false };
        let mut wave = all.cut((0.5 * STEP_SECONDS * speed) as u64, longest);
        if wave.jobs.is_empty() {
            return false;
        }
        let start = Instant::now();
        let mut traced = 0;
        for replicate in 0..2 {
            wave.replicate = replicate;
            let report = self.state.trace_wave(&wave, &self.pool, &AtomicBool::new(false));
            self.rays += report.iter().flatten().map(|report| report.rays).sum::<u64>();
        }
        // The rest of each cut job is traced next, while its tile is still in the cache.
        for (job, rest) in wave.jobs.iter().zip(&mut self.remaining) {
            rest.first += job.count;
            rest.count -= job.count;
            traced += 2 * u64::from(job.count) * self.state.film.tile_pixels(job.tile as usize);
        }
        self.samples[1] += traced;
        self.measured.0 += traced;
        self.measured.1 += start.elapsed().as_secs_f64();
        self.remaining.retain(|job| job.count > 0);
        true
    }

    /// Returns the share of the shard's samples that the film holds, 0..=1.
    pub fn progress(&self) -> f64 {
        let [total, done] = self.samples;
        if total == 0 { 1.0 } else { done as f64 / total as f64 }
    }

    pub fn report(&self) -> Report {
        let [total, done] = self.samples;
        let (traced, seconds) = self.measured;
        let speed = if seconds > 0.0 { traced as f64 / seconds } else { 0.0 };
        let left = (total - done) as f64 / speed.max(1.0);
        let film = &self.state.film;
        let pixels = (film.header.width * film.header.height) as f64;
        let spp = done as f64 / pixels;
        Report {
            state: State::Tracing,
            spp: Spp { min: 0, mean: spp, max: spp.ceil() as u32 },
            samples: traced,
            rays: self.rays,
            seconds,
            eta_seconds: Some(Interval::exact(left)),
            progress: Some(self.progress()),
            recent_samples_per_second: speed,
            lanes: self.state.world.info().lanes,
            threads: self.pool.current_num_threads(),
            ..Report::default()
        }
    }
}
