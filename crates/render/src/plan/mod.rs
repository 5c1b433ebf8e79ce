//! Plans: renders that are divided among shards, which different processes or machines trace.
//!
//! A plan fixes the sample count of every tile before the shards start, because shards do not
//! communicate. A pilot is an adaptive render that ends when its noise is still above the target.
//! Its noise estimates predict the counts ([`Schedule::predict`]). Its samples are the *base* of
//! the plan, the start of the sample sequence of every tile. The shards trace the rest. The sum of
//! base and all shards therefore holds the samples `0..end` of each tile in both replicates (halves
//! of the samples). It equals, bit for bit, the film of a single process that has traced the same
//! sample counts.
//!
//! [`Schedule::predict`]: crate::schedule::Schedule::predict

mod division;
mod file;
mod merge;
mod merge_inputs;
mod part;
mod shard_render;
#[cfg(test)]
mod testing;
mod watched;

pub use file::{PlanError, is_plan_file};
pub use merge::Merged;
pub use part::{Part, PartShard};
pub use shard_render::ShardRender;
pub use watched::{WatchedFilms, WatchedShards, WatchedState};

use crate::film::{Display, Estimator, Film, TILE};
use crate::schedule::{Schedule, Settings, TilePrediction, TileSamples};
use zerkalo_kernel::sampling::SamplerKind;

/// Largest number of shards of a plan.
pub const MAX_SHARDS: u32 = 1 << 16;

/// Number that stands for the base in lists of shards. The base is the set of samples that a plan
/// started from, such as those of a pilot render. Shards have the numbers from 1.
pub const BASE: u32 = 0;

/// Settings of a render that is divided among shards: the inputs of its samples, and its noise
/// target.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanSettings {
    /// Path of the scene file as the user gave it.
    pub source: String,
    /// Hash of the text of the scene and of the files that it names.
    pub scene_hash: String,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    /// Random seed of all samples of the planned render.
    pub seed: u64,
    /// Kind of the random numbers: Sobol points or independent numbers.
    pub sampler: SamplerKind,
    /// Floating-point precision of the render, `single` or `double`.
    pub precision: String,
    /// Display transform under which the noise is estimated.
    pub display: Display,
    /// Largest number of samples per pixel in tiles in which a path makes a random choice (such as
    /// a direction of a glossy lobe), over the whole render; 0 for no limit.
    pub rays_per_pixel: u32,
    /// Noise target: RMSE of the displayed picture in 8-bit levels.
    pub noise_levels: f64,
    /// Number of shards into which the render is divided, 1 to [`MAX_SHARDS`]. Each is for one
    /// process. They are numbered from 1.
    pub shards: u32,
    /// Checksum of the earlier plan that this plan continues: it starts from the film that was
    /// merged from the shards of the earlier plan. `None` if this plan starts from a pilot, a short
    /// render whose noise determines the samples of each tile.
    pub base_plan: Option<u64>,
}

/// Plan of a render that is divided among shards: the number of samples of each tile, fixed in
/// advance.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Settings of the planned render: the inputs of its samples, and its noise target.
    pub settings: PlanSettings,
    /// Expected RMSE of the merged picture in 8-bit levels.
    pub predicted_levels: f64,
    /// Exponents s of the error, RMSE ~ n^-s for n samples: first of tiles in which no path makes a
    /// random choice, then of the other tiles (see [`PlannedTile::glossy`]).
    pub slopes: [f64; 2],
    /// Sample counts of the picture's tiles, in row order.
    pub tiles: Vec<PlannedTile>,
}

/// Sample counts of one tile in a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedTile {
    /// Base of the tile: samples per pixel that it had before the plan in each replicate (half of
    /// the samples), from a pilot render or an earlier plan.
    pub base: u32,
    /// Samples per pixel in each replicate (half of the samples) of the merged film of all shards.
    /// They include `base`, the samples that the plan started from.
    pub end: u32,
    /// Expected number of rays per sample in this tile.
    pub rays_per_sample: f32,
    /// `true` if a path in the tile has made a random choice, such as a direction of a glossy lobe.
    pub glossy: bool,
}

impl Plan {
    /// Creates the plan of a render that continues from the samples of `schedule` and ends at the
    /// noise target of `schedule`. `usual_slopes` are assumed exponents of the error (see
    /// [`Plan::slopes`]), used where the schedule has not measured any. Returns `None` if the
    /// schedule has no noise target, or no estimate of the noise.
    pub fn of_schedule(
        schedule: &Schedule,
        usual_slopes: [f64; 2],
        settings: PlanSettings,
    ) -> Option<Self> {
        let prediction = schedule.predict(usual_slopes)?;
        let tile = |tile: &TilePrediction| PlannedTile {
            base: tile.done,
            end: tile.count,
            // Two decimals suffice for an expected cost.
            rays_per_sample: (tile.rays_per_sample * 100.0).round() as f32 / 100.0,
            glossy: tile.glossy,
        };
        Some(Self {
            settings,
            predicted_levels: prediction.rmse,
            slopes: prediction.slopes,
            tiles: prediction.tiles.iter().map(tile).collect(),
        })
    }

    /// Returns the expected number of rays of all samples that the shard with the number `shard`
    /// traces.
    pub fn rays(&self, shard: u32) -> f64 {
        self.rays_of(self.ranges(shard).into_iter())
    }

    /// Returns the expected number of rays of the whole merged picture: those of the base (the
    /// samples that the plan started from) and of all shards.
    pub fn all_rays(&self) -> f64 {
        self.rays_of(self.tiles.iter().map(|tile| 0..tile.end))
    }

    /// Returns the expected number of rays for the samples with the indices `ranges` in both
    /// replicates (halves of the samples). `ranges` has a range of indices for each tile.
    fn rays_of(&self, ranges: impl Iterator<Item = std::ops::Range<u32>>) -> f64 {
        let rays = |(tile, range): (usize, std::ops::Range<u32>)| {
            let samples = 2.0 * range.len() as f64 * pixels_of(self.settings.size, tile) as f64;
            samples * f64::from(self.tiles[tile].rays_per_sample)
        };
        ranges.enumerate().map(rays).sum()
    }

    /// Returns the number of samples that the shard with the number `shard` traces, over all pixels
    /// and both replicates (halves of the samples).
    pub fn samples(&self, shard: u32) -> u64 {
        let samples = |(tile, range): (usize, std::ops::Range<u32>)| {
            2 * range.len() as u64 * pixels_of(self.settings.size, tile)
        };
        self.ranges(shard).into_iter().enumerate().map(samples).sum()
    }

    /// Returns the mean number of samples per pixel in the merged picture, over both replicates
    /// (halves of the samples).
    pub fn spp(&self) -> f64 {
        let size = self.settings.size;
        let samples = |(i, t): (usize, &PlannedTile)| 2 * u64::from(t.end) * pixels_of(size, i);
        let samples: u64 = self.tiles.iter().enumerate().map(samples).sum();
        let [width, height] = self.settings.size.map(u64::from);
        samples as f64 / (width * height) as f64
    }

    /// Compares the sample counts of `film` with those that the plan assigns to the shards with the
    /// numbers `shards`, which may include [`BASE`]. Returns the number of the first tile whose
    /// counts differ; `None` if all counts agree.
    pub fn differing_tile(&self, film: &Film, shards: &[u32]) -> Option<usize> {
        let mut expected = vec![0u32; self.tiles.len()];
        for shard in shards {
            for (sum, range) in expected.iter_mut().zip(self.ranges(*shard)) {
                *sum += range.len() as u32;
            }
        }
        (0..self.tiles.len()).find(|tile| film.counts(*tile) != [expected[*tile]; 2])
    }

    /// Returns the schedule that continues `film`, which holds all samples of this plan.
    /// `estimator` estimates the error of each tile. Returns `None` if `estimator` has no estimate
    /// for a tile.
    pub fn schedule(
        &self,
        film: &Film,
        estimator: &Estimator,
        settings: Settings,
    ) -> Option<Schedule> {
        let sample = |(index, planned): (usize, &PlannedTile)| {
            let tile = film.tile(index)?;
            Some(TileSamples {
                pixels: pixels_of(self.settings.size, index) as u32,
                count: tile.counts()[0],
                rays_per_sample: f64::from(planned.rays_per_sample),
                glossy: planned.glossy,
                error: estimator.tile(tile)?,
            })
        };
        let samples: Option<Vec<_>> = self.tiles.iter().enumerate().map(sample).collect();
        Some(Schedule::of_samples(&samples?, settings))
    }

    /// Returns a phrase for messages about two plans that differ: the first line that is not the
    /// same in the texts of `self` and `other`. The phrase quotes the line of each text.
    fn difference(&self, other: &Self) -> String {
        let [ours, theirs] = [self, other].map(Self::text);
        let different = ours.lines().zip(theirs.lines()).find(|(a, b)| a != b);
        different.map_or_else(|| "one is longer".to_string(), |(a, b)| format!("`{a}` and `{b}`"))
    }
}

/// Returns the number of tiles of a picture of the given size.
fn tiles_of([width, height]: [u32; 2]) -> usize {
    width.div_ceil(TILE as u32) as usize * height.div_ceil(TILE as u32) as usize
}

/// Returns the number of pixels of tile number `tile` that are inside a picture of the given size.
fn pixels_of(size: [u32; 2], tile: usize) -> u64 {
    let [width, height] = size.map(|n| n as usize);
    let columns = width.div_ceil(TILE);
    let [x, y] = [tile % columns * TILE, tile / columns * TILE];
    ((width - x).min(TILE) * (height - y).min(TILE)) as u64
}
