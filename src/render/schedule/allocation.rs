//! Adaptive sampling: the next samples go where they lower the picture's error most per ray.

use super::tile::Tile;
use super::{Criterion, FULL, PACKET, Schedule, to_packet};
use crate::render::wave::Job;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A decision gives out about this share of the rays spent so far: small enough to correct itself,
/// large enough for few barriers.
const SHARE: f64 = 0.1;
/// And at least so many blocks, or one for each tile of a picture that has fewer, so that all threads
/// have work between two barriers.
const MIN_BLOCKS: usize = 64;
/// Once the best tiles have doubled their count (further an estimate does not reach), the others go
/// on only as long as their gain is at least this share of what those would still give.
const WORTHWHILE: f64 = 0.25;

/// A tile while samples are handed out.
struct Bid {
    /// Expected fall of the summed squared error per ray.
    gain: f64,
    tile: usize,
}

impl PartialEq for Bid {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Bid {}
impl PartialOrd for Bid {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Bid {
    /// By gain; the lower tile number first among equals, so that the order is always the same.
    fn cmp(&self, other: &Self) -> Ordering {
        self.gain.total_cmp(&other.gain).then(other.tile.cmp(&self.tile))
    }
}

/// The law by which one tile's error is expected to fall: `scale * n^(-2 slope)`.
#[derive(Clone, Copy)]
struct Law {
    scale: f64,
    slope: f64,
}

impl Law {
    fn mse(&self, count: u32) -> f64 {
        self.scale * f64::from(count).powf(-2.0 * self.slope)
    }
}

/// The block that a tile with `count` samples per replicate gets next: about a quarter more, a power
/// of two and at least a packet, so that blocks stay aligned to what makes the sequence even; or what is missing
/// to such a block; before the first packet is full, as many again.
fn block(count: u32) -> u32 {
    if count < PACKET {
        return (count + 1).next_power_of_two() - count;
    }
    match to_packet(count) {
        0 => 1 << (count / 4).max(PACKET).ilog2(),
        rest => rest,
    }
}

impl Schedule {
    /// The jobs for the next decision once the floors are reached.
    pub(super) fn by_gain(&self) -> Vec<Job> {
        let criterion = self.settings.criterion;
        let pooled = [self.pooled_slope(false), self.pooled_slope(true)];
        let own: Vec<Law> = self.tiles.iter().map(|t| law(t, criterion, pooled)).collect();
        let guarded: Vec<Law> = (0..own.len()).map(|i| self.guarded(&own, i)).collect();

        let rays = |i: usize, samples: u32| {
            2.0 * f64::from(samples)
                * f64::from(self.tiles[i].pixels)
                * self.tiles[i].rays_per_sample()
        };
        let mut count: Vec<u32> = self.tiles.iter().map(|t| t.done).collect();
        let next = |i: usize, n: u32| block(n).min(self.cap(&self.tiles[i]).saturating_sub(n));
        let bid = |tile: usize, n: u32| {
            let samples = next(tile, n);
            let fall = guarded[tile].mse(n) - guarded[tile].mse(n + samples);
            let gain = fall * f64::from(self.tiles[tile].pixels) / rays(tile, samples);
            (samples > 0).then_some(Bid { gain, tile })
        };

        let budget = SHARE * self.rays as f64;
        let mut samples_left = self.samples_left();
        let over_picture = |rmse: f64| rmse * rmse * self.pixels() as f64;
        let mut error = over_picture(self.noise.map_or(0.0, |noise| criterion.of_picture(noise)));
        let target = self.target().filter(|(c, _)| *c == criterion);
        let enough = target.map_or(-1.0, |(_, target)| over_picture(target));
        let mut heap: BinaryHeap<Bid> =
            count.iter().enumerate().filter_map(|(i, n)| bid(i, *n)).collect();
        let min_blocks = MIN_BLOCKS.min(heap.len());
        let (mut spent, mut blocks, mut set_aside) = (0.0, 0, 0.0f64);
        while let Some(Bid { gain, tile }) = heap.pop() {
            let done = (spent >= budget || gain < WORTHWHILE * set_aside) && blocks >= min_blocks;
            if done || (error <= enough && blocks > 0) {
                break;
            }
            let n = count[tile];
            let pixels = u64::from(self.tiles[tile].pixels);
            let affordable = u32::try_from(samples_left / pixels).unwrap_or(FULL);
            let samples = next(tile, n).min(affordable);
            if samples == 0 {
                continue;
            }
            if n + samples > 2 * self.tiles[tile].done {
                set_aside = set_aside.max(gain);
                continue;
            }
            error -= (own[tile].mse(n) - own[tile].mse(n + samples)) * pixels as f64;
            spent += rays(tile, samples);
            samples_left -= u64::from(samples) * pixels;
            blocks += 1;
            count[tile] = n + samples;
            heap.extend(bid(tile, n + samples));
        }
        let jobs = count.iter().zip(&self.tiles).zip(0..);
        jobs.map(|((n, t), tile)| Job { tile, first: t.done, count: n - t.done })
            .filter(|job| job.count > 0)
            .collect()
    }

    /// The law of tile `i`, guarded against an estimate that is low by chance: a feature that no
    /// sample has met yet leaves no error behind. A share of 1 / 8n of the mean of the eight
    /// neighbours' errors is added, as if one in 8n samples had met what they meet.
    fn guarded(&self, own: &[Law], i: usize) -> Law {
        let (columns, rows) = (self.tiles_per_row, own.len() / self.tiles_per_row);
        let (x, y) = (i % columns, i / columns);
        let n = self.tiles[i].done.max(1);
        let (mut sum, mut neighbours) = (0.0, 0.0);
        for y in y.saturating_sub(1)..(y + 2).min(rows) {
            for x in x.saturating_sub(1)..(x + 2).min(columns) {
                let j = y * columns + x;
                if j != i {
                    sum += own[j].mse(n);
                    neighbours += 1.0;
                }
            }
        }
        let law = own[i];
        let guard = sum / f64::max(neighbours, 1.0) / (8.0 * f64::from(n));
        let scale = law.scale + guard * f64::from(n).powf(2.0 * law.slope);
        Law { scale, ..law }
    }
}

/// The law through a tile's estimates, weighted by their counts. The earlier ones take part so that
/// chance in the latest weighs less: a tile that is passed over because its estimate is low by chance
/// leaves the estimate of the whole picture too low.
fn law(tile: &Tile, criterion: Criterion, pooled: [f64; 2]) -> Law {
    let slope = tile.slope(criterion, pooled[usize::from(tile.glossy)]);
    let (sum, weights) = tile.estimates(criterion).fold((0.0, 0.0), |(sum, weights), (n, mse)| {
        (sum + n * mse * n.powf(2.0 * slope), weights + n)
    });
    Law { scale: sum / f64::max(weights, 1.0), slope }
}
