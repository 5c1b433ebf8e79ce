//! Waves: sets of jobs that are traced concurrently. An allocation round (one decision of the
//! schedule on the next samples of all tiles) is traced as two or more waves. Each replicate (half
//! of the samples) has at least one of them.

use crate::film::{TILE_PIXELS, TileNoise};

/// Tracing job: the samples `first..first + count` of one replicate (half of the samples), in every
/// pixel of one tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// Number of the tile that the job samples; tiles are numbered row by row.
    pub tile: u32,
    /// Index of the job's first sample in the sample sequence of each pixel.
    pub first: u32,
    /// Number of samples per pixel, at least 1.
    pub count: u32,
}

/// Set of jobs that are traced concurrently. All jobs of a wave end before the next wave starts. A
/// wave has at most one job for each tile.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wave {
    /// Replicate (half of the samples) to which the samples are added: 0 for A, 1 for B.
    pub replicate: usize,
    /// Tracing jobs of the wave, in any order.
    pub jobs: Vec<Job>,
    /// `true` if each job ends with an estimate of its tile's error. Only waves of replicate B (the
    /// second half of the samples) set it. The estimate needs equally many samples in both
    /// replicates, and B is traced after A.
    pub estimate: bool,
}

impl Wave {
    /// Cuts a piece from the wave (a set of concurrent jobs). Each job is shortened to at most
    /// `longest` samples per pixel. The piece has only the first of these jobs: just enough to
    /// trace `pixel_samples` samples, summed over all pixels, and at least one job.
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

/// Report on a finished job, which traced samples of one tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JobReport {
    /// Number of rays of every kind (camera, shadow, reflected, transmitted). It is the cost of the
    /// job, independent of the machine.
    pub rays: u64,
    /// `true` if a path of the job has made a random choice: it has sampled a glossy lobe or a
    /// point of an emitter, or has chosen among lights or between reflection and transmission.
    pub glossy: bool,
    /// Estimated error of the job's tile. `None` unless [`Wave::estimate`] is set.
    pub error: Option<TileNoise>,
}

/// Results of the jobs of a wave, a set of jobs that run concurrently.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveReport {
    /// Reports on the jobs of the wave, in the order of its jobs. `None` for a job that was
    /// cancelled before it started and therefore has added no samples.
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
