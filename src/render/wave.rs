//! What the schedule decides and the pass carries out, as plain data.

use crate::film::TileNoise;

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
