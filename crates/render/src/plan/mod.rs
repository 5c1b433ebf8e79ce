//! Plans: renders that are divided among shards, which different processes or machines trace.
//!
//! A plan fixes the sample count of every tile before the shards start, because shards do not
//! communicate. A pilot is an adaptive render that ends when its noise is still above the target.
//! Its noise estimates predict the counts ([`Schedule::predict`]). Its samples are the *base* of
//! the plan, the start of the sample sequence of every tile. The shards trace the rest. The sum of
//! base and all shards therefore holds the samples `0..end` of each tile in both replicates. It
//! equals, bit for bit, the film of a single process that has traced the same sample counts.
//!
//! [`Schedule::predict`]: crate::schedule::Schedule::predict

mod division;
mod file;
mod film_files;
mod merge;
mod part;
mod shard_render;
#[cfg(test)]
mod testing;

pub use file::is_plan_file;
pub use film_files::{FilmFiles, WatchedShards, WatchedState};
pub use merge::Merged;
pub use part::{Part, PartShard};
pub use shard_render::ShardRender;

use crate::film::{Display, Estimator, Film, TILE};
pub use crate::schedule::PlannedTile;
use crate::schedule::{Prediction, Schedule, Settings};
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_world::Precision;

/// Largest number of shards of a plan.
pub const MAX_SHARDS: u32 = 1 << 16;

/// Shard number of the base, the samples that a plan started from. Other shards count from 1.
pub const BASE: u32 = 0;

/// Inputs of a plan's samples, and its noise target.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanSettings {
    /// Path of the scene file as the user gave it.
    pub source: String,
    /// Value of [`scene_hash`](crate::export::scene_hash).
    pub scene_hash: String,
    pub size: [u32; 2],
    pub seed: u64,
    pub sampler: SamplerKind,
    /// Floating-point precision, single or double.
    pub precision: Precision,
    /// Display transform under which the noise is estimated.
    pub display: Display,
    /// Value of [`Settings::rays_per_pixel`].
    pub rays_per_pixel: u32,
    /// Noise target in 8-bit levels.
    pub noise_levels: f64,
    /// Number of shards, 1 to [`MAX_SHARDS`].
    pub shards: u32,
    /// Checksum of the earlier plan whose merged film is the base. `None` if the base is a pilot.
    pub base_plan: Option<u64>,
}

/// Plan of a render: the number of samples of each tile, fixed in advance, to be divided among
/// shards.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub settings: PlanSettings,
    /// Expected RMSE of the merged picture in 8-bit levels.
    pub predicted_levels: f64,
    /// Exponents p of RMSE ~ n^-p for n samples: in tiles that are not glossy, and in glossy tiles.
    pub slopes: [f64; 2],
    /// Tiles in row order.
    pub tiles: Vec<PlannedTile>,
}

impl Plan {
    /// Creates the plan that continues from the samples of `schedule` to its noise target.
    /// `usual_slopes` (for tiles that are not glossy, and for glossy tiles) replace slopes that the
    /// schedule has not measured. Returns `None` without a noise target or an estimate.
    pub fn of_schedule(
        schedule: &Schedule,
        usual_slopes: [f64; 2],
        settings: PlanSettings,
    ) -> Option<Self> {
        let Prediction { tiles, rmse, slopes } = schedule.predict(usual_slopes)?;
        Some(Self { settings, predicted_levels: rmse, slopes, tiles })
    }

    /// Returns the expected number of rays of a shard.
    pub fn rays(&self, shard: u32) -> f64 {
        self.rays_of(self.ranges(shard).iter().map(|range| range.len() as u32))
    }

    /// Returns the expected number of rays of base and all shards.
    pub fn all_rays(&self) -> f64 {
        self.rays_of(self.tiles.iter().map(|tile| tile.end))
    }

    /// Returns the expected number of rays for `counts`, samples per pixel and replicate of each
    /// tile.
    fn rays_of(&self, counts: impl Iterator<Item = u32>) -> f64 {
        let samples = self.samples_of(counts);
        samples.zip(&self.tiles).map(|(n, t)| n as f64 * f64::from(t.rays_per_sample)).sum()
    }

    /// Returns the number of samples of a shard, over all pixels and both replicates.
    pub fn samples(&self, shard: u32) -> u64 {
        self.samples_of(self.ranges(shard).iter().map(|range| range.len() as u32)).sum()
    }

    /// Returns the mean samples per pixel in the merged picture, over both replicates.
    pub fn spp(&self) -> f64 {
        let samples: u64 = self.samples_of(self.tiles.iter().map(|tile| tile.end)).sum();
        let [width, height] = self.settings.size.map(u64::from);
        samples as f64 / (width * height) as f64
    }

    /// Converts samples per pixel and replicate of each tile to samples of the whole tile in both
    /// replicates.
    fn samples_of(&self, counts: impl Iterator<Item = u32>) -> impl Iterator<Item = u64> {
        let tiles = counts.enumerate();
        tiles.map(|(i, count)| 2 * u64::from(count) * pixels_of(self.settings.size, i))
    }

    /// Returns the first tile in which the sample counts of `film` are not those of `shards`, which
    /// may include [`BASE`].
    pub fn differing_tile(&self, film: &Film, shards: &[u32]) -> Option<usize> {
        let mut expected = vec![0u32; self.tiles.len()];
        for shard in shards {
            for (sum, range) in expected.iter_mut().zip(self.ranges(*shard)) {
                *sum += range.len() as u32;
            }
        }
        (0..self.tiles.len()).find(|tile| film.counts(*tile) != [expected[*tile]; 2])
    }

    /// Returns the schedule that continues `film`, which holds all samples of this plan. Returns
    /// `None` if `estimator` has no estimate for a tile.
    pub fn schedule(
        &self,
        film: &Film,
        estimator: &Estimator,
        settings: Settings,
    ) -> Option<Schedule> {
        let all = 0..self.tiles.len();
        let error = |tile: usize| film.tile(tile).and_then(|tile| estimator.tile(tile));
        let errors: Vec<_> = all.clone().map(error).collect();
        if errors.contains(&None) {
            return None;
        }
        let pixels: Vec<u32> = all.map(|tile| film.tile_pixels(tile) as u32).collect();
        Some(Schedule::of_planned(&self.tiles, &pixels, &errors, settings))
    }

    /// Quotes the first line that is not the same in the texts of two plans.
    fn difference(&self, other: &Self) -> String {
        let [ours, theirs] = [self, other].map(Self::text);
        let different = ours.lines().zip(theirs.lines()).find(|(a, b)| a != b);
        different.map_or_else(|| "one is longer".to_string(), |(a, b)| format!("`{a}` and `{b}`"))
    }
}

fn tiles_of([width, height]: [u32; 2]) -> usize {
    width.div_ceil(TILE as u32) as usize * height.div_ceil(TILE as u32) as usize
}

/// Returns the number of pixels of a tile that are inside a picture of the given size.
fn pixels_of(size: [u32; 2], tile: usize) -> u64 {
    let [width, height] = size.map(|n| n as usize);
    let columns = width.div_ceil(TILE);
    let [x, y] = [tile % columns * TILE, tile / columns * TILE];
    ((width - x).min(TILE) * (height - y).min(TILE)) as u64
}
