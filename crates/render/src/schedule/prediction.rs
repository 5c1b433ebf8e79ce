//! Prediction of the sample counts at which a picture is expected to meet its error target. The
//! shards of a plan trace these counts without adapting them.

use crate::film::TileNoise;
use crate::schedule::allocation::{Allocation, Candidate, EXPLORATION};
use crate::schedule::tile::Tile;
use crate::schedule::{Schedule, Settings};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Slope that is assumed before any tile has doubled its sample count. The scenes of the gallery
/// have slopes of 0.57 to 0.8.
pub const USUAL_SLOPE: f64 = 0.7;
/// Error at which the prediction aims, as a share of the target. The true error exceeds the
/// predicted one by 3 to 6 % (11 % in the worst of nine renders).
const AIM: f64 = 0.95;

/// Predicted end of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Sample counts of the tiles, in row order.
    pub tiles: Vec<PlannedTile>,
    /// Expected RMSE of the picture, in the unit of the error target.
    pub rmse: f64,
    /// Exponents p of the error model RMSE ~ n^-p: for tiles that are not glossy, and for glossy
    /// tiles.
    pub slopes: [f64; 2],
}

/// Sample counts of one tile in a prediction or a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlannedTile {
    /// Samples per pixel and replicate so far, which are the base of a plan.
    pub base: u32,
    /// Samples per pixel and replicate at the end, including `base`.
    pub end: u32,
    pub rays_per_sample: f32,
    /// `true` if a path in the tile has made a random choice.
    pub glossy: bool,
}

impl Schedule {
    /// Creates the schedule of a film that holds the samples of the planned `tiles`, which have
    /// `pixels` pixels inside the picture and the estimated errors `errors`, in row order.
    pub fn of_planned(
        tiles: &[PlannedTile],
        pixels: &[u32],
        errors: &[Option<TileNoise>],
        settings: Settings,
    ) -> Self {
        let mut schedule = Self::new(pixels, settings);
        for (tile, planned) in schedule.tiles.iter_mut().zip(tiles) {
            let traced = 2 * u64::from(planned.end) * u64::from(tile.pixels);
            tile.done = planned.end;
            tile.rays = (traced as f64 * f64::from(planned.rays_per_sample)) as u64;
            tile.glossy = planned.glossy;
            schedule.samples += traced;
            schedule.rays += tile.rays;
        }
        schedule.set_estimates(errors);
        schedule
    }

    /// Predicts the sample counts at which the picture meets its error target. Samples are
    /// allocated as in an adaptive render. `usual_slopes`, of tiles that are not glossy and of
    /// glossy tiles, are assumed as long as no tile of the kind has doubled its sample count.
    /// Returns `None` without an error target, or before the first noise estimate.
    pub fn predict(&self, usual_slopes: [f64; 2]) -> Option<Prediction> {
        let (criterion, target) = self.target()?;
        let rmse = criterion.of(self.noise?.rmse);
        let target = AIM * target;
        let slopes = [false, true]
            .map(|glossy| self.fitted_slope(glossy).unwrap_or(usual_slopes[usize::from(glossy)]));
        let expected = self.calibrated(&self.tile_models(slopes));
        let mut allocation = Allocation::new(self, self.samples_left());
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
        // The models are scaled to the reported error, which is the larger of two estimates and may
        // exceed the sum of the models.
        let modelled = sum_of(&mut self.tiles.iter().map(|tile| tile.done));
        let scale = if modelled > 0.0 { square_sum(rmse) / modelled } else { 1.0 };
        let enough = square_sum(target) / scale;
        let mut error = sum_of(&mut allocation.counts.iter().copied());
        let mut heap: BinaryHeap<Candidate> =
            expected.iter().enumerate().filter_map(|(i, m)| allocation.candidate(i, m)).collect();
        while error > enough
            && let Some(Candidate { count: Reverse(count), tile: Reverse(tile), .. }) = heap.pop()
        {
            let samples = allocation.next_block(tile);
            if samples > 0 {
                error += tile_sum(tile, count + samples) - tile_sum(tile, count);
                allocation.allocate(tile, samples);
                heap.extend(allocation.candidate(tile, &expected[tile]));
            }
        }
        let error = sum_of(&mut allocation.counts.iter().copied());
        let tile = |(tile, count): (&Tile, &u32)| PlannedTile {
            base: tile.done,
            end: *count,
            // Two decimals suffice for an expected cost.
            rays_per_sample: (tile.rays_per_sample() * 100.0).round() as f32 / 100.0,
            glossy: tile.glossy,
        };
        Some(Prediction {
            tiles: self.tiles.iter().zip(&allocation.counts).map(tile).collect(),
            // The true error is expected to exceed the predicted one by the factor 1 / `AIM`.
            rmse: (scale * error / self.pixels() as f64).sqrt() / AIM,
            slopes,
        })
    }
}
