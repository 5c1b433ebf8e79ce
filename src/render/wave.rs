//! What the schedule decides and the pass carries out, as plain data.

use crate::film::{TILE_PIXELS, TileNoise};

/// Samples to trace in every pixel of one tile: indices `first..first + count` of one replicate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// Number of the tile, row by row.
    pub tile: u32,
    /// First sample index.
    pub first: u32,
    /// Number of samples, at least 1.
    pub count: u32,
}

/// Jobs between two barriers; a tile occurs at most once.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wave {
    /// 0: replicate A, 1: replicate B.
    pub replicate: usize,
    /// The jobs, in any order.
    pub jobs: Vec<Job>,
    /// Whether each job ends with an estimate of its tile's error. Only set where that makes sense:
    /// in waves of B, after which both replicates of the tile hold equally many samples.
    pub estimate: bool,
}

impl Wave {
    /// The first of its jobs, about `pixel_samples` samples of pixels together (but at least one
    /// job), none of them longer than `longest` samples per pixel: a piece that takes a short time.
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

/// What a finished job says about its tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JobReport {
    /// Rays of every kind (camera, shadow, reflected): the cost of the job, the same on every
    /// machine.
    pub rays: u64,
    /// Whether a path met a glossy lobe.
    pub glossy: bool,
    /// The error of the tile's pixels now, if the wave asked for it.
    pub error: Option<TileNoise>,
}

/// What became of a wave.
#[derive(Clone, Debug, PartialEq)]
pub struct WaveReport {
    /// One entry per job, in the order of the wave; `None`: cancelled before it began, nothing of it
    /// is in the film.
    pub reports: Vec<Option<JobReport>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_is_cut_to_short_jobs() {
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
