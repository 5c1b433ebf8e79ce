//! Prediction of the sample counts at which a picture is expected to meet its error target, from
//! its noise estimates so far. In a plan that divides a render among processes, each process traces
//! its part of these counts without adapting them.

use crate::film::TileNoise;
use crate::schedule::allocation::{Allocation, Candidate, EXPLORATION};
use crate::schedule::tile::Tile;
use crate::schedule::{Schedule, Settings};
use std::collections::BinaryHeap;

/// Assumed slope of a tile's error, if no tile has doubled its sample count yet: RMSE ~ n^-slope
/// for n samples. The scenes of the gallery have slopes of 0.57 to 0.8.
pub const USUAL_SLOPE: f64 = 0.7;
/// Error at which the prediction aims, as a share of the error target. It is below 1, because the
/// true error exceeds the predicted one by 3 to 6 % (11 % in the worst of nine renders).
const AIM: f64 = 0.95;

/// Predicted end of a render: sample counts and error.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Present and predicted sample counts of the tiles, in row order.
    pub tiles: Vec<TilePrediction>,
    /// Expected RMSE of the whole picture after the predicted samples. Its unit is that of the
    /// error target: 8-bit levels or radiance.
    pub rmse: f64,
    /// Slopes of the error, RMSE ~ n^-slope for n samples: `[tiles that are not glossy, glossy
    /// tiles]` (see [`TilePrediction::glossy`]).
    pub slopes: [f64; 2],
}

/// Sample counts of a tile: those traced so far, and those predicted for the end of the render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TilePrediction {
    /// Samples per pixel that the tile has so far in each replicate (half of the samples).
    pub done: u32,
    /// Predicted samples per pixel of the tile in each replicate (half of the samples). They
    /// include `done`, the samples so far.
    pub count: u32,
    /// Mean number of rays per sample in this tile.
    pub rays_per_sample: f64,
    /// `true` if a path in this tile has made a random choice, such as a direction of a glossy
    /// lobe.
    pub glossy: bool,
}

/// Statistics of the samples that a film holds in one tile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileSamples {
    /// Number of the tile's pixels that are inside the picture.
    pub pixels: u32,
    /// Samples per pixel that the film holds in each replicate (half of the samples) of the tile.
    pub count: u32,
    /// Mean number of rays per sample in the tile.
    pub rays_per_sample: f64,
    /// `true` if a path in the tile has made a random choice, such as a direction of a glossy lobe.
    pub glossy: bool,
    /// Estimated error of the tile.
    pub error: TileNoise,
}

impl Schedule {
    /// Creates the schedule of a film that holds samples already. `samples` describes its tiles in
    /// row order; each has an estimate of its error.
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
    /// tiles in which they reduce the error most per ray, as in an adaptive render. A share
    /// `EXPLORATION` of the additional rays goes to the tiles with the fewest samples.
    /// `usual_slopes` is `[assumed slope of tiles that are not glossy, of glossy tiles]` (see
    /// [`TilePrediction::glossy`]). Each is used as long as no tile of its kind has doubled its
    /// sample count. Returns `None` without an error target, or before the first noise estimate.
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
        // The models are scaled so that their sum matches the reported error. The reported error
        // can be larger than this sum, because it is the larger one of two estimates.
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
            // The target was multiplied by `AIM`, because the true error exceeds the predicted one.
            // The reported error is divided by `AIM` for the same reason.
            rmse: (scale * error / self.pixels() as f64).sqrt() / AIM,
            slopes,
        })
    }
}
