//! Prediction: the sample counts at which a picture is expected to meet its error target, from the
//! estimates at hand. Shards of a plan trace these counts without further decisions.

use crate::film::TileNoise;
use crate::render::schedule::allocation::{Allocation, Candidate, EXPLORATION};
use crate::render::schedule::tile::Tile;
use crate::render::schedule::{Schedule, Settings};
use std::collections::BinaryHeap;

/// Slope of the error of a tile, if no tile has doubled its sample count yet: RMSE ~ n^-slope. The
/// scenes of the gallery have 0.57 to 0.8.
pub const USUAL_SLOPE: f64 = 0.7;
/// Aim of a prediction relative to the error target. The predicted error is too low by 3 to 6 %
/// (11 % in the worst of nine renders), because tiles that were selected for high estimates fall
/// towards the mean of their class.
const AIM: f64 = 0.95;

/// Predicted end of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Tiles in row order.
    pub tiles: Vec<TilePrediction>,
    /// Expected RMSE of the whole picture, in the unit of the target.
    pub rmse: f64,
    /// Slope of the error of tiles without and with glossy lobes.
    pub slopes: [f64; 2],
}

/// Samples of a tile at hand, and predicted ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TilePrediction {
    /// Samples per replicate at hand.
    pub done: u32,
    /// Predicted samples per replicate; at least `done`.
    pub count: u32,
    /// Mean number of rays per sample.
    pub rays_per_sample: f64,
    /// `true` if a path has hit a glossy lobe.
    pub glossy: bool,
}

/// Samples that a film holds in one tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileSamples {
    /// Number of pixels inside the picture.
    pub pixels: u32,
    /// Samples per replicate.
    pub count: u32,
    /// Mean number of rays per sample.
    pub rays_per_sample: f64,
    /// `true` if a path has hit a glossy lobe.
    pub glossy: bool,
    /// Estimated error.
    pub error: TileNoise,
}

impl Schedule {
    /// Creates the schedule of a film that holds samples already. All tiles have an estimate.
    pub fn of_samples(samples: &[TileSamples], settings: Settings) -> Self {
        let pixels: Vec<u32> = samples.iter().map(|s| s.pixels).collect();
        let mut schedule = Self::new(&pixels, settings);
        for (tile, s) in schedule.tiles.iter_mut().zip(samples) {
            let traced = 2 * u64::from(s.count) * u64::from(s.pixels);
            tile.done = s.count;
            tile.rays = (traced as f64 * s.rays_per_sample) as u64;
            tile.glossy = s.glossy;
            schedule.samples += traced;
            schedule.rays += tile.rays;
        }
        let estimates: Vec<_> = samples.iter().map(|s| Some(s.error)).collect();
        schedule.set_estimates(&estimates);
        schedule
    }

    /// Predicts the sample counts at which the picture meets its error target. Samples go to the
    /// tiles in which they reduce the error most per ray, as in an adaptive render; the share
    /// `EXPLORATION` of the rays goes to the tiles with the fewest samples. `usual_slopes` are
    /// the slopes of tiles without and with glossy lobes, as long as none of them has doubled its
    /// sample count. Returns `None` without a target, or before the first estimate of the noise.
    pub fn predict(&self, usual_slopes: [f64; 2]) -> Option<Prediction> {
        let (criterion, target) = self.target()?;
        let rmse = criterion.of_picture(self.noise?);
        let target = AIM * target;
        let slopes = [false, true]
            .map(|glossy| self.fitted_slope(glossy).unwrap_or(usual_slopes[usize::from(glossy)]));
        let expected = self.expected_errors(slopes);
        let mut allocation = Allocation::new(self);
        let slope = self.convergence.fitted_slope().unwrap_or(0.5 * (slopes[0] + slopes[1]));
        let growth = (rmse / target).max(1.0).powf(1.0 / slope);
        allocation.explore(EXPLORATION * self.rays as f64 * (growth - 1.0));

        let square_sum = |rmse: f64| rmse * rmse * self.pixels() as f64;
        let tile_sum = |tile: usize, count: u32| {
            expected[tile].mse(count) * f64::from(self.tiles[tile].pixels)
        };
        let sum_of = |counts: &mut dyn Iterator<Item = u32>| -> f64 {
            counts.enumerate().map(|(tile, count)| tile_sum(tile, count)).sum()
        };
        // The models are scaled to the reported error, which is the larger one of two estimates.
        let modelled = sum_of(&mut self.tiles.iter().map(|tile| tile.done));
        let scale = if modelled > 0.0 { square_sum(rmse) / modelled } else { 1.0 };
        let enough = square_sum(target) / scale;
        let mut error = sum_of(&mut allocation.counts.iter().copied());
        let mut heap: BinaryHeap<Candidate> =
            expected.iter().enumerate().filter_map(|(i, m)| allocation.candidate(i, m)).collect();
        while error > enough
            && let Some(Candidate { count, tile, .. }) = heap.pop()
        {
            let samples = allocation.next_block(tile);
            if samples > 0 {
                error += tile_sum(tile, count + samples) - tile_sum(tile, count);
                allocation.allocate(tile, samples);
                heap.extend(allocation.candidate(tile, &expected[tile]));
            }
        }
        let error = sum_of(&mut allocation.counts.iter().copied());
        let tile = |(tile, count): (&Tile, &u32)| TilePrediction {
            done: tile.done,
            count: *count,
            rays_per_sample: tile.rays_per_sample(),
            glossy: tile.glossy,
        };
        Some(Prediction {
            tiles: self.tiles.iter().zip(&allocation.counts).map(tile).collect(),
            // The predicted error is reported without the correction.
            rmse: (scale * error / self.pixels() as f64).sqrt() / AIM,
            slopes,
        })
    }
}
