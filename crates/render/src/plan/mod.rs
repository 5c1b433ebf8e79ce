//! Plans: renders that are divided among shards, which different processes or machines trace.
//!
//! A plan fixes the sample count of every tile before the shards start, because shards do not
//! communicate. A render takes several *rounds*, each with a plan of its own. The first plan is
//! uniform and needs no samples. Each later one is planned from the errors that the shards of the
//! round before report ([`Schedule::plan_round`]); the sample counts of that round are its *base*.
//!
//! A part holds all samples of its tiles, base included. The parts of one round together are
//! therefore one film, which holds the samples `0..end` of each tile in both replicates. It equals,
//! bit for bit, the film of a single process that has traced the same sample counts.
//!
//! [`Schedule::plan_round`]: crate::schedule::Schedule::plan_round

mod division;
mod file;
mod film_files;
mod job;
mod merge;
mod part;
mod shard_render;
mod share_report;
#[cfg(test)]
mod testing;

pub use division::Share;
pub use file::is_plan_file;
pub use film_files::{FilmFiles, WatchedShards, WatchedState};
pub use job::Job;
pub use merge::Merged;
pub use part::{Part, PartShard, PlanHead};
pub use shard_render::ShardRender;
pub use share_report::{ShareReport, TileReport};

use crate::film::{Film, Header, TILE};
pub use crate::schedule::PlannedTile;
use crate::schedule::{MIN_SAMPLES, Schedule, Settings, Stop, USUAL_SLOPE};
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_world::Precision;

use crate::film::Display;

/// Largest number of shards of a plan.
pub const MAX_SHARDS: u32 = 1 << 16;
/// Largest number of samples per pixel and replicate of the first round.
const MOST_FIRST_SAMPLES: u32 = 64;

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
    /// Number of the round, from 1.
    pub round: u32,
    /// Checksum of the plan of the round before. `None` in the first round.
    pub base_plan: Option<u64>,
    /// Number of rays of all earlier rounds.
    pub base_rays: u64,
    /// Expected number of rays of all rounds; 0 in the first round.
    pub total_rays: f64,
}

/// Plan of a round: the number of samples of each tile, fixed in advance, to be divided among
/// shards.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    pub settings: PlanSettings,
    /// Expected RMSE of the merged picture in 8-bit levels; 0 in the first round.
    pub predicted_levels: f64,
    /// Exponents p of RMSE ~ n^-p for n samples: in tiles that are not glossy, and in glossy tiles.
    pub slopes: [f64; 2],
    /// Tiles in row order.
    pub tiles: Vec<PlannedTile>,
}

impl Plan {
    /// Creates the plan of the first round, which is uniform: the fewest samples from which noise
    /// can be estimated, or as many as trace a shadow ray to each light once (`light_period`).
    pub fn first(settings: PlanSettings, light_period: u32) -> Self {
        let period = light_period.next_power_of_two().min(MOST_FIRST_SAMPLES);
        let cap = match settings.rays_per_pixel {
            0 => u32::MAX,
            rays => (rays / 2).max(1),
        };
        let tile = PlannedTile {
            base: 0,
            end: MIN_SAMPLES.max(period).min(cap),
            rays_per_sample: 1.0,
            glossy: false,
            earlier: Default::default(),
        };
        let tiles = vec![tile; tiles_of(settings.size)];
        Self { settings, predicted_levels: 0.0, slopes: [USUAL_SLOPE; 2], tiles }
    }

    /// Creates the plan of the next round after this one, whose tiles have the given reports.
    /// Returns `None` if the noise meets its target or no tile can get samples, and fails if a tile
    /// has no error estimate.
    pub fn next(&self, reports: &[TileReport], noise_levels: f64) -> Result<Option<Self>, String> {
        let errors: Vec<_> = reports.iter().map(|report| report.error).collect();
        if errors.contains(&None) {
            return Err("a tile has no estimate of its noise".to_string());
        }
        let pixels: Vec<u32> = (0..self.tiles.len()).map(|i| self.pixels(i) as u32).collect();
        let mut tiles = self.tiles.clone();
        for (tile, (report, pixels)) in tiles.iter_mut().zip(reports.iter().zip(&pixels)) {
            let samples = |count: u32| 2.0 * f64::from(count) * f64::from(*pixels);
            let rays = f64::from(tile.rays_per_sample) * samples(tile.base) + report.rays as f64;
            tile.rays_per_sample = (rays / samples(tile.end).max(1.0)) as f32;
            tile.glossy |= report.glossy;
        }
        let stop = Stop { noise_levels: Some(noise_levels), ..Stop::default() };
        let cap = self.settings.rays_per_pixel;
        let settings = Settings { rays_per_pixel: cap, ..Settings::until(stop) };
        let schedule = Schedule::of_planned(&tiles, &pixels, &errors, settings);
        let Some((round, total_rays)) = schedule.plan_round(self.slopes) else { return Ok(None) };
        let settings = PlanSettings {
            noise_levels,
            round: self.settings.round + 1,
            base_plan: Some(self.checksum()),
            base_rays: self.settings.base_rays + reports.iter().map(|r| r.rays).sum::<u64>(),
            total_rays: total_rays.round(),
            ..self.settings.clone()
        };
        let (slopes, tiles) = (round.slopes, round.tiles);
        Ok(Some(Self { settings, predicted_levels: round.rmse, slopes, tiles }))
    }

    /// Returns the expected number of rays of the round.
    pub fn rays(&self) -> f64 {
        let rays = |(i, tile): (usize, &PlannedTile)| {
            let samples = 2 * u64::from(tile.end - tile.base) * self.pixels(i);
            samples as f64 * f64::from(tile.rays_per_sample)
        };
        self.tiles.iter().enumerate().map(rays).sum()
    }

    /// Returns the number of samples of a share, base included, over all pixels and both replicates.
    pub fn samples(&self, share: &Share) -> u64 {
        let ranges = (share.first..).zip(&share.ranges);
        ranges.map(|(tile, range)| 2 * range.len() as u64 * self.pixels(tile)).sum()
    }

    /// Returns the first tile in which `film` does not have the planned sample counts.
    pub fn differing_tile(&self, film: &Film) -> Option<usize> {
        (0..self.tiles.len()).find(|tile| film.counts(*tile) != [self.tiles[*tile].end; 2])
    }

    /// Returns the number of pixels of a tile that are inside the picture.
    fn pixels(&self, tile: usize) -> u64 {
        let [width, height] = self.settings.size.map(|n| n as usize);
        let header =
            Header { width, height, scales: Vec::new(), seed: 0, precision: Precision::Auto };
        header.extent(tile).iter().product::<usize>() as u64
    }
}

fn tiles_of([width, height]: [u32; 2]) -> usize {
    width.div_ceil(TILE as u32) as usize * height.div_ceil(TILE as u32) as usize
}
