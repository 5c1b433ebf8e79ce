//! Waves: sets of jobs that are traced concurrently. The schedule's decisions are traced as waves.

use crate::film::{TILE_PIXELS, TileNoise};

/// Job: the samples `first..first + count` of one replicate, in every pixel of one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// Number of the tile; tiles are numbered row by row.
    pub tile: u32,
    /// First sample index.
    pub first: u32,
    /// Number of samples, at least 1.
    pub count: u32,
}

/// Jobs that are traced concurrently. All jobs of a wave end before the next wave starts. A wave
/// has at most one job for each tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wave {
    /// Replicate to which the samples are added: 0 for A, 1 for B.
    pub replicate: usize,
    /// The jobs, in any order.
    pub jobs: Vec<Job>,
    /// `true` if each job ends with an estimate of its tile's error. Only waves of replicate B have
    /// it: after them both replicates of the tile hold equally many samples.
    pub estimate: bool,
}

impl Wave {
    /// Shortens the wave to its first jobs, at least one, with about `pixel_samples` samples over
    /// all pixels. Shortens each job to at most `longest` samples per pixel.
    pub fn cut(mut self, pixel_samples: u64, longest: u32) -> Self {
        let mut sum = 0;
        let mut jobs = 0;
        while jobs < self.jobs.len() && (jobs == 0 || sum < pixel_samples) {
            sum += u64::from(self.jobs[jobs].count.min(longest)) * TILE_PIXELS as u64;
            jobs += 1;
        }
        self.jobs.truncate(jobs);
        self.jobs.iter_mut().for_each(|job| job.count = job.count.min(longest));
        self
    }
}

/// Result of a finished job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JobReport {
    /// Number of rays of every kind (camera, shadow, reflected, transmitted). It is the cost of the
    /// job, independent of the machine.
    pub rays: u64,
    /// `true` if a path has sampled a glossy lobe.
    pub glossy: bool,
    /// Estimated error of the tile's pixels. `None` unless [`Wave::estimate`] is set.
    pub error: Option<TileNoise>,
}

/// Result of a wave.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveReport {
    /// One entry for each job, in the order of the wave. `None` for a job that was cancelled before
    /// it started and therefore has added no samples.
    pub reports: Vec<Option<JobReport>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wave_is_cut_to_short_jobs() {
        let jobs: Vec<Job> = (0..4).map(|tile| Job { tile, first: 8, count: 24 }).collect();
        let wave = Wave { replicate: 1, jobs, estimate: true };
        assert_eq!(wave.clone().cut(u64::MAX, 24), wave);
        let one = wave.clone().cut(0, 8);
        assert_eq!(one.jobs, [Job { tile: 0, first: 8, count: 8 }]);
        assert_eq!((one.replicate, one.estimate), (1, true));
        let counts = |samples, longest| -> Vec<u32> {
            wave.clone().cut(samples, longest).jobs.iter().map(|job| job.count).collect()
        };
        assert_eq!(counts(256 * 48, 24), [24, 24]);
        assert_eq!(counts(256 * 48 + 1, 24), [24, 24, 24]);
        assert_eq!(counts(256 * 48, 16), [16, 16, 16]);
    }
}
