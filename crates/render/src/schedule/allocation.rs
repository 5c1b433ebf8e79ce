//! Adaptive sampling: allocates the next samples, in rounds, to the tiles in which they reduce the
//! picture's error most per ray.
//!
//! Each tile has two estimates of its error, from disjoint sets of its pixels. The *allocation
//! estimate* selects and ranks tiles. The *validation estimate* is reported to the user; allocation
//! uses it only in means over many tiles. The error of tiles is thereby measured on pixels that did
//! not select them (cross-fitting, Chernozhukov et al. 2018).
//!
//! The expected error of a tile is calibrated by similar tiles. Tiles with similar allocation
//! estimates and sample counts form a *class*. The expected error is mostly the mean of the
//! validation estimates of the class. A tile whose allocation estimate is too low by chance
//! therefore still gets samples. A feature that only validation pixels contain raises the expected
//! error of all tiles of the class. A tile whose allocation estimate is too high by chance gets
//! only a few samples too many.

use crate::film::TILE_PIXELS;
use crate::schedule::tile::Tile;
use crate::schedule::{Criterion, MAX_SAMPLES, SAMPLE_ALIGNMENT, Schedule, to_packet};
use crate::wave::Job;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};
use zerkalo_scene::value::ascending;

/// Number of rays that one round of adaptive sampling allocates, as a share of the rays traced so
/// far. A round is one decision on the next samples of all tiles. The share is small enough that
/// later noise estimates can correct a round, and large enough that threads rarely wait for each
/// other between rounds.
const ROUND_SHARE: f64 = 0.1;
/// Share of the rays of an allocation round that goes to the tiles with the fewest samples,
/// whatever their noise estimates are. No estimate contains a feature that no sample has hit; this
/// share finds such features.
///
/// Measured on 30 sparse pictures (stars and balls of the size of a pixel,
/// `tests/error_estimates`): the true error exceeds the reported one by 18 % in the mean with a
/// share of 1/16, by 16 % with 1/8, by 13 % with 1/4. The scene of the physical mirror room needs
/// 60.7 million rays to reach an RMSE of 0.00068 with a share of 1/32, 61.7 million with 1/16, 64.8
/// million with 1/8.
pub(super) const EXPLORATION: f64 = 0.0625;
/// Smallest number of sample blocks that an allocation round gives to tiles. A round gives fewer
/// only if fewer tiles can get samples, or if fewer blocks suffice for the error target. A block is
/// a run of samples of every pixel of a tile. So many blocks keep every thread busy until the end
/// of the round.
const MIN_BLOCKS: usize = 64;
/// Fraction that decides whether an allocation round ends early. The round ends when the largest
/// gain (error reduction per ray) of the remaining tiles is below this fraction of the largest gain
/// of the tiles that were set aside. A tile is set aside for the rest of the round when its next
/// block would more than double its sample count, because a noise estimate is reliable for one
/// doubling only. The round gives at least [`MIN_BLOCKS`] blocks, whatever their gain is.
const WORTHWHILE: f64 = 0.25;
/// Weight per pixel of a tile's own allocation estimate in its expected error. The validation
/// estimates of all tiles of its class (tiles with similar estimates) have the weight 1 per pixel.
const OWN_WEIGHT: f64 = 0.25;
/// Number of tiles below which a class (tiles with similar error estimates) is widened by the
/// nearest classes.
///
/// In a small class, each tile's own validation estimate has a large weight in its expected error.
/// Tiles whose estimate is low by chance would get no samples. The reported error, the sum of these
/// estimates, would then be too low. Ratio of true to reported error in 40 pictures of stars and of
/// balls as small as a pixel (`tests/error_estimates`, 48 to 64 seeds each): 1.02 to 1.55 without
/// widening, 0.96 to 1.24 with 9 tiles, 0.94 to 1.23 with 17.
const MIN_CLASS_TILES: f64 = 17.0;
/// Largest distance between a class (tiles with similar error estimates) and a class that widens
/// it. The distance is the sum of two numbers: the number of factors of sqrt(2) between the
/// allocation estimates, and the number of such factors between the sample counts. For example, a
/// factor of 4 between the sample counts is a distance of 4.
const MAX_CLASS_DISTANCE: u32 = 4;

/// Block of samples that an allocation round may give to a tile. A block is a run of samples of
/// every pixel of the tile.
pub(super) struct Candidate {
    /// Expected decrease of the picture's error per ray of the block. The error is the sum of the
    /// squared errors of all pixels.
    gain: f64,
    /// Samples per pixel that the tile has in each replicate (half of the samples) without this
    /// block of samples.
    pub count: u32,
    /// Number of the tile that gets this block of samples.
    pub tile: usize,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Candidate {}
impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Candidate {
    /// Compares two blocks of samples by their gain. Of two blocks with equal gains, the greater is
    /// that of the tile with fewer samples. If the samples are equal too, it is that of the tile
    /// with the lower number.
    fn cmp(&self, other: &Self) -> Ordering {
        let fewer = other.count.cmp(&self.count).then(other.tile.cmp(&self.tile));
        self.gain.total_cmp(&other.gain).then(fewer)
    }
}

/// Model of the decrease of a tile's mean squared error with the number n of samples per pixel in
/// each replicate (half of the samples): `scale * n^(-2 slope)`.
#[derive(Clone, Copy)]
pub(super) struct ErrorModel {
    scale: f64,
    slope: f64,
}

impl ErrorModel {
    /// Returns the mean squared error of the tile after `count` samples per pixel in each of the
    /// two replicates (halves of the samples).
    pub fn mse(&self, count: u32) -> f64 {
        self.scale * f64::from(count).powf(-2.0 * self.slope)
    }

    /// Returns an error model with the slope of this one and the mean squared error `mse` at
    /// `count` samples.
    fn through(&self, count: u32, mse: f64) -> Self {
        Self { scale: mse * f64::from(count).powf(2.0 * self.slope), ..*self }
    }
}

/// Error models of one tile. One is fitted to its allocation estimates, which select tiles; the
/// other to its validation estimates, which are reported.
struct TileModels {
    allocation: ErrorModel,
    validation: ErrorModel,
}

/// Class of similar tiles: `(floor(log2 n), floor(2 log2 v))`. Here n is the sample count of the
/// tile, and v is the allocation estimate of its variance per sample. The second number is `None`
/// if v is 0.
type Class = (u32, Option<i32>);

/// Returns the length of the next block of a tile with `count` samples per pixel in each of the two
/// replicates (halves of the samples). A block is a run of samples that is allocated as a whole. If
/// `count` is below [`SAMPLE_ALIGNMENT`], the block ends at the next power of two. If `count` is
/// larger but no multiple of [`SAMPLE_ALIGNMENT`], the block ends at the next multiple. Otherwise
/// the length is the largest power of two up to a quarter of `count`, at least
/// [`SAMPLE_ALIGNMENT`], because such blocks of the sample sequence are well distributed.
fn block(count: u32) -> u32 {
    if count < SAMPLE_ALIGNMENT {
        return (count + 1).next_power_of_two() - count;
    }
    match to_packet(count) {
        0 => 1 << (count / 4).max(SAMPLE_ALIGNMENT).ilog2(),
        missing => missing,
    }
}

/// Allocation round in progress: the samples that each tile has got so far. A round is one decision
/// on the next samples of all tiles.
pub(super) struct Allocation<'a> {
    schedule: &'a Schedule,
    /// Samples per pixel of each tile in each of the two replicates (halves of the samples): those
    /// traced so far and those allocated in this round.
    pub counts: Vec<u32>,
    /// Expected number of rays of the samples that this round has allocated so far.
    pub spent: f64,
    blocks: usize,
    samples_left: u64,
}

impl<'a> Allocation<'a> {
    /// Starts an allocation round, one decision on the next samples of all tiles. The round starts
    /// with the samples that the tiles of `schedule` have.
    pub fn new(schedule: &'a Schedule) -> Self {
        Self {
            schedule,
            counts: schedule.tiles.iter().map(|t| t.done).collect(),
            spent: 0.0,
            blocks: 0,
            samples_left: schedule.samples_left(),
        }
    }

    /// Returns the length of the next block of `tile`: its number of samples per pixel in each of
    /// the two replicates (halves of the samples). A block is a run of samples that is allocated as
    /// a whole. Returns 0 if the tile has reached its largest sample count ([`Schedule::cap`]), or
    /// if one more sample per pixel of the tile would exceed the requested mean sample count of the
    /// picture.
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

    /// Allocates `samples` further samples per pixel in each of the two replicates (halves of the
    /// samples) to `tile`.
    pub fn allocate(&mut self, tile: usize, samples: u32) {
        self.spent += self.rays(tile, samples);
        self.samples_left -= u64::from(samples) * u64::from(self.schedule.tiles[tile].pixels);
        self.blocks += 1;
        self.counts[tile] += samples;
    }

    /// Allocates one block of samples to one tile after another, starting with the tile that has
    /// the fewest samples. Ends when the allocation round has about `rays` rays in total.
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

    /// Returns the next block of samples of `tile` with its gain under the error model `model`.
    /// Returns `None` if the tile can get no more samples.
    pub fn candidate(&self, tile: usize, model: &ErrorModel) -> Option<Candidate> {
        let (count, samples) = (self.counts[tile], self.next_block(tile));
        let fall = model.mse(count) - model.mse(count + samples);
        let pixels = f64::from(self.schedule.tiles[tile].pixels);
        let gain = fall * pixels / self.rays(tile, samples.max(1));
        (samples > 0).then_some(Candidate { gain, count, tile })
    }

    fn into_jobs(self) -> Vec<Job> {
        let jobs = self.counts.iter().zip(&self.schedule.tiles).zip(0..);
        jobs.map(|((n, t), tile)| Job { tile, first: t.done, count: n - t.done })
            .filter(|job| job.count > 0)
            .collect()
    }
}

impl Schedule {
    /// Returns the jobs of the next allocation round in the adaptive phase. The tiles with the
    /// highest gain (error reduction per ray) get samples first. The phase starts when every tile
    /// has [`Schedule::min_samples`] samples in each replicate (half of the samples).
    pub(super) fn highest_gain(&self) -> Vec<Job> {
        let criterion = self.settings.criterion;
        let models = self.tile_models([self.pooled_slope(false), self.pooled_slope(true)]);
        let expected = self.calibrated(&models);

        let mut allocation = Allocation::new(self);
        let budget = ROUND_SHARE * self.rays as f64;
        allocation.explore(EXPLORATION * budget);

        let over_picture = |rmse: f64| rmse * rmse * self.pixels() as f64;
        let noise = self.largest_recent_noise();
        let mut error = over_picture(noise.map_or(0.0, |noise| criterion.of_picture(noise)));
        let target = self.target().filter(|(c, _)| *c == criterion);
        let enough = target.map_or(-1.0, |(_, target)| over_picture(target));
        let mut heap: BinaryHeap<Candidate> =
            expected.iter().enumerate().filter_map(|(i, m)| allocation.candidate(i, m)).collect();
        let min_blocks = MIN_BLOCKS.min(heap.len());
        let mut set_aside = 0.0f64;
        while let Some(Candidate { gain, count, tile }) = heap.pop() {
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
        allocation.into_jobs()
    }

    /// Returns for each tile a model of its expected error as a function of its sample count.
    /// `pooled` is `[slope of tiles that are not glossy, slope of glossy tiles]`, with RMSE ~
    /// n^-slope for n samples. A tile is glossy if a path in it has made a random choice.
    pub(super) fn expected_errors(&self, pooled: [f64; 2]) -> Vec<ErrorModel> {
        self.calibrated(&self.tile_models(pooled))
    }

    fn tile_models(&self, pooled: [f64; 2]) -> Vec<TileModels> {
        self.tiles.iter().map(|t| tile_models(t, self.settings.criterion, pooled)).collect()
    }

    /// Returns the expected error of each tile as a function of its sample count. The error at the
    /// present count is a weighted mean of two kinds of estimates: the validation estimates of the
    /// tile's class (tiles with similar error estimates), and the tile's own allocation estimate. A
    /// class with few tiles also uses the estimates of the nearest classes. The weight of an
    /// estimate is the number of pixels of its tile. The weight of the own estimate is multiplied
    /// by [`OWN_WEIGHT`]. The own estimate keeps the expected error above 0 if the validation
    /// estimates of the class are 0.
    fn calibrated(&self, models: &[TileModels]) -> Vec<ErrorModel> {
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
        let calibrate = |(tile, models): (&Tile, &TileModels)| {
            let mut expected = wide[&class_of(tile, models)];
            expected.add(OWN_WEIGHT * f64::from(tile.pixels), variance(&models.allocation, tile));
            models.allocation.through(tile.done, expected.mean() / f64::from(tile.done))
        };
        self.tiles.iter().zip(models).map(calibrate).collect()
    }
}

/// Returns the sum of the validation estimates over the tiles of `class` (tiles with similar error
/// estimates) and of its nearest classes. Classes are added in the order of their distance, up to
/// [`MAX_CLASS_DISTANCE`], until there are [`MIN_CLASS_TILES`] tiles. Their validation estimates
/// are scaled to the allocation estimate of `class`. If that estimate is 0, no classes are added.
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

/// Sum of the validation estimates of tiles, each weighted by the tile's pixels, with the sum of
/// these weights.
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

/// Fits two error models to the noise estimates of a tile: one to its allocation estimates, one to
/// its validation estimates. Each estimate is weighted by its sample count. Earlier estimates, from
/// fewer samples, reduce the influence of chance in the latest one. `pooled` is `[slope of all
/// tiles that are not glossy, slope of all glossy tiles]`.
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
