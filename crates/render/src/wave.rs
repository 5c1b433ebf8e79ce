//! Waves of tracing jobs, and the reports on them.

use crate::film::{TILE_PIXELS, TileNoise};
use crate::schedule::SAMPLE_ALIGNMENT;

/// Tracing job: the samples `first..first + count` of one replicate, in every pixel of one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    pub tile: u32,
    /// Index of the first sample in the sequence of each pixel.
    pub first: u32,
    /// Samples per pixel, at least 1.
    pub count: u32,
}

impl Job {
    /// Returns the index after the last sample.
    pub fn end(&self) -> u32 {
        self.first + self.count
    }
}

/// Jobs that are traced concurrently, at most one for each tile. All jobs of a wave end before the
/// next wave starts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wave {
    /// Replicate of the samples: 0 for A, 1 for B.
    pub replicate: usize,
    pub jobs: Vec<Job>,
    /// `true` if each job ends with an estimate of its tile's error. Only waves of replicate B set
    /// it: an estimate needs equally many samples of both replicates, and B is traced after A.
    pub estimate: bool,
}

impl Wave {
    /// Shortens each job to at most `longest` samples per pixel; `longest` is at least
    /// [`SAMPLE_ALIGNMENT`]. A shortened job ends at a multiple of [`SAMPLE_ALIGNMENT`], so that
    /// the packets of the rest are full. Keeps the fewest first jobs, at least one, that together
    /// reach `pixel_samples` samples over all pixels.
    pub fn cut(mut self, pixel_samples: u64, longest: u32) -> Self {
        let mut sum = 0;
        let mut jobs = 0;
        while jobs < self.jobs.len() && (jobs == 0 || sum < pixel_samples) {
            let job = &mut self.jobs[jobs];
            let end = job.first.saturating_add(longest) / SAMPLE_ALIGNMENT * SAMPLE_ALIGNMENT;
            job.count = job.count.min(end - job.first);
            sum += u64::from(job.count) * TILE_PIXELS as u64;
            jobs += 1;
        }
        self.jobs.truncate(jobs);
        self
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JobReport {
    /// Number of rays of every kind: the cost of the job, independent of the machine.
    pub rays: u64,
    /// `true` if a path has made a random choice: a direction of a glossy lobe, a point of an
    /// emitter, a light, or whether to reflect or to transmit.
    pub glossy: bool,
    /// Estimated error of the tile, if [`Wave::estimate`] is set.
    pub error: Option<TileNoise>,
}

/// Reports in the order of the jobs. `None` for a job that was cancelled before it started.
pub type WaveReport = Vec<Option<JobReport>>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wave_is_cut_to_short_jobs() {
        let jobs: Vec<Job> = (0..4).map(|tile| Job { tile, first: 8, count: 24 }).collect();
        let wave = Wave { replicate: 1, jobs, estimate: true };
        assert_eq!(wave.clone().cut(u64::MAX, 24), wave);
        let one = wave.clone().cut(0, 16);
        assert_eq!(one.jobs, [Job { tile: 0, first: 8, count: 8 }]);
        assert_eq!((one.replicate, one.estimate), (1, true));
        let counts = |samples, longest| -> Vec<u32> {
            wave.clone().cut(samples, longest).jobs.iter().map(|job| job.count).collect()
        };
        assert_eq!(counts(256 * 48, 24), [24, 24]);
        assert_eq!(counts(256 * 48 + 1, 24), [24, 24, 24]);
        assert_eq!(counts(256 * 16, 16), [8, 8]);
    }
}
