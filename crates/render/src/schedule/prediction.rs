//! Prediction of the sample counts at which a picture is expected to meet its error target. The
//! shards of a plan trace these counts without adapting them.

use crate::film::{ByMeasure, TileNoise};
use crate::schedule::allocation::{Allocation, Candidate, EXPLORATION};
use crate::schedule::tile::Tile;
use crate::schedule::{SPARSE_MIN_SAMPLES, Schedule, Settings};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Slope that is assumed before any tile has doubled its sample count. The scenes of the gallery
/// have slopes of 0.57 to 0.8.
pub const USUAL_SLOPE: f64 = 0.7;
/// Number of earlier estimates of a tile that a plan keeps, from which slopes are fitted.
pub const EARLIER: usize = 2;

/// Excess of the error over its target, as a share, with which a plan ends. A round that misses the
/// target by more is followed by a small one.
const TOLERANCE: f64 = 0.02;
/// Growth of all rays up to which a round is the last one. The error model of a tile misses by a
/// few per cent for each doubling of its samples.
const LAST_GROWTH: f64 = 1.5;
/// Growth up to which a round before the last one suffices. It then gets all but a quarter of the
/// rays.
const SECOND_GROWTH: f64 = 9.0;
/// Share of all rays at which the round before the last one ends.
const SECOND_SHARE: f64 = 0.75;
/// Growth of the samples of a tile in a round that is not the last.
const TILE_GROWTH: u32 = 16;

/// End of a prediction: the first of its limits that is reached.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Largest expected number of rays, in addition to those traced.
    pub rays: f64,
    /// Largest growth of the samples of a tile.
    pub growth: u32,
}

impl Goal {
    /// No limit but the target.
    pub const TO_TARGET: Self = Self { rays: f64::INFINITY, growth: u32::MAX };
}

/// Predicted end of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Sample counts of the tiles, in row order.
    pub tiles: Vec<PlannedTile>,
    /// Expected RMSE of the picture, in the unit of the error target.
    pub rmse: f64,
    /// Expected rays of the samples that are not traced yet.
    pub rays: f64,
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
    /// Error estimates at the ends of earlier rounds, oldest first. Those without samples do not
    /// count.
    pub earlier: [RoundEstimate; EARLIER],
}

/// Mean squared errors of a tile at the end of a round, in squared 8-bit levels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RoundEstimate {
    /// Samples per pixel and replicate.
    pub samples: u32,
    /// Value of [`TileNoise::allocation`].
    pub allocation: f32,
    /// Value of [`TileNoise::reported`].
    pub reported: f32,
}

impl RoundEstimate {
    fn of_noise(noise: &TileNoise) -> Self {
        let [allocation, reported] =
            [noise.allocation, noise.reported].map(|mse| mse.levels as f32);
        Self { samples: noise.samples, allocation, reported }
    }

    /// Returns the estimate as one of a tile with the latest estimate `latest`.
    fn noise(&self, latest: TileNoise) -> TileNoise {
        let levels = |mse: f32| ByMeasure { levels: f64::from(mse), linear: 0.0 };
        let (allocation, reported) = (levels(self.allocation), levels(self.reported));
        TileNoise { samples: self.samples, allocation, reported, ..latest }
    }
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
        for ((tile, planned), latest) in schedule.tiles.iter_mut().zip(tiles).zip(errors) {
            let traced = 2 * u64::from(planned.end) * u64::from(tile.pixels);
            tile.done = planned.end;
            tile.rays = (traced as f64 * f64::from(planned.rays_per_sample)) as u64;
            tile.glossy = planned.glossy;
            schedule.samples += traced;
            schedule.rays += tile.rays;
            let earlier = planned.earlier.iter().filter(|estimate| estimate.samples > 0);
            let earlier =
                latest.iter().flat_map(|latest| earlier.clone().map(|e| e.noise(*latest)));
            earlier.chain(*latest).for_each(|error| tile.record_error(error));
        }
        schedule.update_noise();
        schedule
    }

    /// Predicts the next round of a plan, whose rounds so far are traced. A round decides by the
    /// estimates at its beginning, which hold for a few doublings of the samples: a round that has
    /// to multiply the rays is therefore followed by others. Returns `None` if the error meets its
    /// target, or no tile can get samples.
    pub fn plan_round(&self, usual_slopes: [f64; 2]) -> Option<(Prediction, f64)> {
        let (criterion, target) = self.target()?;
        if criterion.of(self.noise?.rmse) <= (1.0 + TOLERANCE) * target {
            return None;
        }
        let mut round = self.predict(usual_slopes, Goal::TO_TARGET)?;
        let (traced, rest) = (self.rays as f64, round.rays);
        let growth = 1.0 + rest / traced;
        if self.common_count() < self.min_samples() {
            for (planned, tile) in round.tiles.iter_mut().zip(&self.tiles) {
                planned.end = tile.done.max(SPARSE_MIN_SAMPLES.min(self.cap(tile)));
            }
        } else if growth > LAST_GROWTH {
            let share = if growth <= SECOND_GROWTH { SECOND_SHARE } else { growth.powf(-0.5) };
            let rays = share * (traced + rest) - traced;
            round = self.predict(usual_slopes, Goal { rays, growth: TILE_GROWTH })?;
        }
        let grows = round.tiles.iter().any(|tile| tile.end > tile.base);
        grows.then_some((round, traced + rest))
    }

    /// Predicts the sample counts at which the picture meets its error target, as far as `goal`
    /// allows. Samples are allocated as in an adaptive render. `usual_slopes`, of tiles that are not
    /// glossy and of glossy tiles, are assumed as long as no tile of the kind has doubled its sample
    /// count. Returns `None` without an error target, or before the first noise estimate.
    pub fn predict(&self, usual_slopes: [f64; 2], goal: Goal) -> Option<Prediction> {
        let (criterion, target) = self.target()?;
        let rmse = criterion.of(self.noise?.rmse);
        let slopes = [false, true]
            .map(|glossy| self.fitted_slope(glossy).unwrap_or(usual_slopes[usize::from(glossy)]));
        let expected = self.calibrated(&self.tile_models(slopes));
        let mut allocation = Allocation::new(self, self.samples_left());
        let slope = self.convergence.fitted_slope().unwrap_or(0.5 * (slopes[0] + slopes[1]));
        let growth = (rmse / target).max(1.0).powf(1.0 / slope);
        allocation.explore(EXPLORATION * goal.rays.min(self.rays as f64 * (growth - 1.0)));

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
            && allocation.spent < goal.rays
            && let Some(Candidate { count: Reverse(count), tile: Reverse(tile), .. }) = heap.pop()
        {
            let samples = allocation.next_block(tile);
            let most = self.tiles[tile].done.saturating_mul(goal.growth);
            if samples > 0 && count + samples <= most {
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
            earlier: {
                let latest = tile.history.iter().rev().take(EARLIER).rev();
                let mut earlier = [RoundEstimate::default(); EARLIER];
                earlier
                    .iter_mut()
                    .zip(latest)
                    .for_each(|(e, noise)| *e = RoundEstimate::of_noise(noise));
                earlier
            },
        };
        Some(Prediction {
            tiles: self.tiles.iter().zip(&allocation.counts).map(tile).collect(),
            rmse: (scale * error / self.pixels() as f64).sqrt(),
            rays: allocation.spent,
            slopes,
        })
    }
}
