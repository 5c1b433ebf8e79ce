//! Adaptive sampling: allocates the next samples, in rounds, to the tiles in which they reduce the
//! picture's error most per ray.
//!
//! Each tile has two estimates of its error, from disjoint sets of its pixels. The *allocation
//! estimate* selects and ranks tiles. The *validation estimate* is reported to the user; allocation
//! uses it only in means over many tiles. The error of tiles is thereby measured on pixels that did
//! not select them (cross-fitting, Chernozhukov et al. 2018).
//!
//! Tiles with similar allocation estimates and sample counts form a *class*. The expected error of
//! a tile is mostly the mean of the validation estimates of its class. A tile whose allocation
//! estimate is too low by chance therefore still gets samples, and one whose estimate is too high
//! gets only a few too many.

use crate::film::{Stratum, TILE_PIXELS};
use crate::schedule::tile::{FLATTEST, Tile};
use crate::schedule::{Criterion, MAX_SAMPLES, SAMPLE_ALIGNMENT, Schedule, to_packet};
use crate::wave::Job;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use zerkalo_scene::value::{ascending, from_total_order, total_order};

/// Rays of an adaptive round, as a share of the rays traced so far. It is small enough that later
/// estimates can correct a round, and large enough that threads rarely wait for each other.
const ROUND_SHARE: f64 = 0.1;
/// Share of the rays of a round that goes to the tiles with the fewest samples, whatever their
/// estimates are. It finds features that no sample has hit.
///
/// The true error of 30 sparse pictures (`tests/error_estimates`) exceeds the reported one on
/// average by 18 % with 1/16, 16 % with 1/8, 13 % with 1/4. The scene of the mirror room needs 60.7
/// million rays to a linear RMSE of 0.00068 with 1/32, 61.7 million with 1/16, 64.8 million with
/// 1/8.
pub(super) const EXPLORATION: f64 = 0.0625;
/// Smallest number of blocks in a round, which keeps every thread busy until the end of the round.
/// A round has fewer if fewer tiles can get samples or fewer blocks meet the error target.
const MIN_BLOCKS: usize = 64;
/// A tile whose next block would more than double its samples is set aside, because an estimate is
/// reliable for one doubling only. The round ends when the largest gain of the remaining tiles is
/// below this fraction of the largest gain of the tiles set aside.
const WORTHWHILE: f64 = 0.25;
/// Weight per pixel of a tile's own allocation estimate in its expected error. The validation
/// estimates of its class have the weight 1.
const OWN_WEIGHT: f64 = 0.25;
/// Number of tiles below which a class is widened by the nearest classes. In a small class, each
/// tile's own validation estimate has a large weight; tiles whose estimate is low by chance would
/// get no samples, and the reported error would be too low.
///
/// The ratio of true to reported error in 40 sparse pictures (`tests/error_estimates`, 48 to 64
/// seeds each) is 1.02 to 1.55 without widening, 0.96 to 1.24 with 9 tiles, 0.94 to 1.23 with 17.
const MIN_CLASS_TILES: f64 = 17.0;
/// Largest distance between a class and a class that widens it. The distance is the number of
/// factors of sqrt(2) between their allocation estimates, plus that between their sample counts.
const MAX_CLASS_DISTANCE: u32 = 4;

/// Block of samples that a round may give to a tile. Blocks are ordered by gain, then by fewer
/// samples, then by the lower number of the tile.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Candidate {
    /// Gain of the block, encoded by [`total_order`] as an integer of the same order.
    gain: i64,
    /// Samples per pixel and replicate of the tile before the block.
    pub count: Reverse<u32>,
    pub tile: Reverse<usize>,
}

/// Mean squared error of a tile after n samples per pixel and replicate: `scale * n^(-2 slope)`.
#[derive(Clone, Copy)]
pub(super) struct ErrorModel {
    scale: f64,
    slope: f64,
}

impl ErrorModel {
    pub fn mse(&self, count: u32) -> f64 {
        self.scale * f64::from(count).powf(-2.0 * self.slope)
    }

    /// Returns the model with the same slope whose mean squared error at `count` samples is `mse`.
    fn through(&self, count: u32, mse: f64) -> Self {
        Self { scale: mse * f64::from(count).powf(2.0 * self.slope), ..*self }
    }
}

/// Models fitted to the allocation and to the validation estimates of one tile.
pub(super) struct TileModels {
    allocation: ErrorModel,
    validation: ErrorModel,
}

/// Class of similar tiles with n samples and the allocation estimate v of their variance per
/// sample: `(floor(log2 n), floor(2 log2 v))`. The second number is `None` if v is 0.
type Class = (u32, Option<i32>);

/// Returns the length of the next block of a tile with `count` samples per pixel and replicate. A
/// count below [`SAMPLE_ALIGNMENT`] grows to the next power of two. A larger count grows to the
/// next multiple of [`SAMPLE_ALIGNMENT`]. A multiple grows by the largest power of two up to a
/// quarter of it, at least [`SAMPLE_ALIGNMENT`]: such blocks of the sequence are well distributed.
fn block(count: u32) -> u32 {
    if count < SAMPLE_ALIGNMENT {
        return (count + 1).next_power_of_two() - count;
    }
    match to_packet(count) {
        0 => 1 << (count / 4).max(SAMPLE_ALIGNMENT).ilog2(),
        missing => missing,
    }
}

/// Allocation of the samples of one round to the tiles.
pub(super) struct Allocation<'a> {
    schedule: &'a Schedule,
    /// Samples per pixel and replicate of each tile, traced or allocated.
    pub counts: Vec<u32>,
    /// Expected rays of the samples allocated so far.
    pub spent: f64,
    blocks: usize,
    samples_left: u64,
}

impl<'a> Allocation<'a> {
    pub fn new(schedule: &'a Schedule, samples_left: u64) -> Self {
        Self {
            schedule,
            counts: schedule.tiles.iter().map(|t| t.done).collect(),
            spent: 0.0,
            blocks: 0,
            samples_left,
        }
    }

    /// Returns the number of samples per pixel and replicate in the next block of `tile`. Returns 0
    /// if the tile has reached its cap, or if one more sample per pixel would exceed the requested
    /// mean number of samples per pixel.
    pub fn next_block(&self, tile: usize) -> u32 {
        let (t, count) = (&self.schedule.tiles[tile], self.counts[tile]);
        let affordable =
            u32::try_from(self.samples_left / u64::from(t.pixels)).unwrap_or(MAX_SAMPLES);
        block(count).min(self.schedule.cap(t).saturating_sub(count)).min(affordable)
    }

    fn rays(&self, tile: usize, samples: u32) -> f64 {
        let t = &self.schedule.tiles[tile];
        2.0 * f64::from(samples) * f64::from(t.pixels) * t.rays_per_sample()
    }

    pub fn allocate(&mut self, tile: usize, samples: u32) {
        self.spent += self.rays(tile, samples);
        self.samples_left -= u64::from(samples) * u64::from(self.schedule.tiles[tile].pixels);
        self.blocks += 1;
        self.counts[tile] += samples;
    }

    /// Allocates one block to each of the tiles with the fewest samples, in ascending order of
    /// their samples, until the round has about `rays` rays.
    pub fn explore(&mut self, rays: f64) {
        for tile in ascending(self.counts.iter().map(|count| i64::from(*count)).collect()) {
            if self.spent >= rays {
                break;
            }
            let samples = self.next_block(tile);
            if samples > 0 {
                self.allocate(tile, samples);
            }
        }
    }

    /// Returns the next block of `tile`. Returns `None` if the tile can get no more samples.
    pub fn candidate(&self, tile: usize, model: &ErrorModel) -> Option<Candidate> {
        let (count, samples) = (self.counts[tile], self.next_block(tile));
        let fall = model.mse(count) - model.mse(count + samples);
        let pixels = f64::from(self.schedule.tiles[tile].pixels);
        let gain = fall * pixels / self.rays(tile, samples.max(1));
        let (gain, count, tile) = (total_order(gain), Reverse(count), Reverse(tile));
        (samples > 0).then_some(Candidate { gain, count, tile })
    }
}

impl Schedule {
    /// Returns the jobs of the next round of the adaptive phase, which starts when every tile has
    /// [`Schedule::min_samples`]. `spp` is as in [`Schedule::planned`].
    pub(super) fn highest_gain(&self, spp: Option<u32>) -> Vec<Job> {
        let criterion = self.settings.criterion;
        let pooled = [false, true].map(|glossy| self.fitted_slope(glossy).unwrap_or(FLATTEST));
        let models = self.tile_models(pooled);
        let expected = self.calibrated(&models);

        let mut allocation = Allocation::new(self, self.samples_to(spp));
        let budget = ROUND_SHARE * self.rays as f64;
        allocation.explore(EXPLORATION * budget);
        for tile in self.tiles_with_slivers() {
            let samples = allocation.next_block(tile);
            if samples > 0 {
                allocation.allocate(tile, samples);
            }
        }

        let active = self.tiles.iter().filter(|tile| !tile.rests);
        let pixels: f64 = active.map(|tile| f64::from(tile.pixels)).sum();
        let over_picture = |rmse: f64| rmse * rmse * pixels;
        let noise = self.largest_recent_noise();
        let mut error = over_picture(noise.map_or(0.0, |noise| self.error_to_lower(noise)));
        let target = self.target().filter(|(c, _)| *c == criterion);
        let enough = target.map_or(-1.0, |(_, target)| over_picture(target));
        let mut heap: BinaryHeap<Candidate> =
            expected.iter().enumerate().filter_map(|(i, m)| allocation.candidate(i, m)).collect();
        let min_blocks = MIN_BLOCKS.min(heap.len());
        let mut set_aside = 0.0f64;
        while let Some(Candidate { gain, count: Reverse(count), tile: Reverse(tile) }) = heap.pop()
        {
            let gain = from_total_order(gain);
            let done = (allocation.spent >= budget || gain < WORTHWHILE * set_aside)
                && allocation.blocks >= min_blocks;
            if done || (error <= enough && allocation.blocks > 0) {
                break;
            }
            let samples = allocation.next_block(tile);
            if samples == 0 {
                continue;
            }
            if count + samples > 2 * self.tiles[tile].done {
                set_aside = set_aside.max(gain);
                continue;
            }
            let model = &models[tile].allocation;
            error -= (model.mse(count) - model.mse(count + samples))
                * f64::from(self.tiles[tile].pixels);
            allocation.allocate(tile, samples);
            heap.extend(allocation.candidate(tile, &expected[tile]));
        }
        self.jobs_to(allocation.counts.into_iter())
    }

    /// Fits models to the estimates of each tile. `pooled` are the slopes of tiles that are not
    /// glossy, and of glossy tiles.
    pub(super) fn tile_models(&self, pooled: [f64; 2]) -> Vec<TileModels> {
        self.tiles.iter().map(|t| tile_models(t, self.settings.criterion, pooled)).collect()
    }

    /// Returns the model of each tile's expected error. At the present sample count, the expected
    /// error is a mean of the validation estimates of the tile's class, weighted by pixels, and of
    /// the tile's own allocation estimate, weighted by its pixels times [`OWN_WEIGHT`]. The own
    /// estimate keeps the expected error above 0 if the validation estimates of the class are 0.
    pub(super) fn calibrated(&self, models: &[TileModels]) -> Vec<ErrorModel> {
        let variance =
            |model: &ErrorModel, tile: &Tile| model.mse(tile.done) * f64::from(tile.done);
        let class_of = |tile: &Tile, models: &TileModels| -> Class {
            let estimate = variance(&models.allocation, tile);
            (tile.done.ilog2(), (estimate > 0.0).then(|| (2.0 * estimate.log2()).floor() as i32))
        };
        let mut classes: BTreeMap<Class, WeightedSum> = BTreeMap::new();
        for (tile, models) in self.tiles.iter().zip(models) {
            let sum = classes.entry(class_of(tile, models)).or_default();
            sum.add(f64::from(tile.pixels), variance(&models.validation, tile));
        }
        let mut wide: BTreeMap<Class, WeightedSum> = BTreeMap::new();
        wide.extend(classes.keys().map(|class| (*class, widened(*class, &classes))));
        let missing = self.missing_by_octave();
        let calibrate = |(tile, models): (&Tile, &TileModels)| {
            let mut expected = wide[&class_of(tile, models)];
            expected.add(OWN_WEIGHT * f64::from(tile.pixels), variance(&models.allocation, tile));
            let missing = missing.get(&tile.done.ilog2()).unwrap_or(&0.0);
            models.allocation.through(tile.done, expected.mean() / f64::from(tile.done) + missing)
        };
        self.tiles.iter().zip(models).map(calibrate).collect()
    }

    /// Returns the missing mean squared error that black pixels show ([`Stratum::missing_of_half`]),
    /// by the binary logarithm of the samples per pixel.
    fn missing_by_octave(&self) -> BTreeMap<u32, f64> {
        let strata = Stratum::of_tiles(self.tiles.iter().filter_map(|tile| tile.error.as_ref()));
        let is_counted = self.settings.criterion == Criterion::Levels;
        let missing = |(octave, stratum): (u32, Stratum)| (octave, stratum.missing_of_half(0));
        strata.into_iter().filter(|_| is_counted).map(missing).collect()
    }
}

/// Returns the sum of the validation estimates of `class` and of its nearest classes, as many as
/// give [`MIN_CLASS_TILES`] tiles within [`MAX_CLASS_DISTANCE`]. Estimates of other classes are
/// scaled to the allocation estimate of `class`. If that is 0, the sum has no other classes.
fn widened(class: Class, classes: &BTreeMap<Class, WeightedSum>) -> WeightedSum {
    let mut sum = classes[&class];
    let (octave, Some(half_octave)) = class else { return sum };
    for distance in 1..=MAX_CLASS_DISTANCE {
        if sum.weight >= MIN_CLASS_TILES * TILE_PIXELS as f64 {
            break;
        }
        for ((other_octave, other), others) in classes {
            let Some(other) = other else { continue };
            if 2 * octave.abs_diff(*other_octave) + half_octave.abs_diff(*other) == distance {
                sum.sum += others.sum * 2f64.powf(0.5 * f64::from(half_octave - other));
                sum.weight += others.weight;
            }
        }
    }
    sum
}

#[derive(Clone, Copy, Default)]
struct WeightedSum {
    sum: f64,
    weight: f64,
}

impl WeightedSum {
    fn add(&mut self, weight: f64, value: f64) {
        self.sum += weight * value;
        self.weight += weight;
    }

    fn mean(self) -> f64 {
        self.sum / self.weight
    }
}

/// Fits error models to the estimates of a tile, weighted by sample counts. Earlier estimates
/// reduce the influence of chance in the latest one. `pooled` are the slopes of tiles that are not
/// glossy, and of glossy tiles.
fn tile_models(tile: &Tile, criterion: Criterion, pooled: [f64; 2]) -> TileModels {
    let slope = tile.slope(criterion, pooled[usize::from(tile.glossy)]);
    let (mut sums, mut weights) = ([0.0; 2], 0.0);
    for (n, mse) in tile.estimates(criterion) {
        for (sum, mse) in sums.iter_mut().zip(mse) {
            *sum += n * mse * n.powf(2.0 * slope);
        }
        weights += n;
    }
    let [allocation, validation] =
        sums.map(|sum| ErrorModel { scale: sum / f64::max(weights, 1.0), slope });
    TileModels { allocation, validation }
}
