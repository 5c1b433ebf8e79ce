//! Division of a plan's tiles among its shards, which different processes trace.
//!
//! The tiles are cut into runs of consecutive tiles, one a shard. A part therefore holds only its
//! tiles, a process needs memory for them only, and the parts of a round together are one film.
//!
//! - The lengths of the runs follow from the expected rays of their tiles. They fall linearly from
//!   the first shard to the last, to a tenth: processes take shards in ascending order, and small
//!   ones at the end let all processes finish at about the same time, slow ones included.
//! - A tile with more rays than a shard should have is cut between blocks of [`SAMPLE_ALIGNMENT`]
//!   samples. Such a block of the Owen-scrambled Sobol sequence is a net of its own and fills the
//!   widest packets.
//! - Both replicates are cut alike: in any sum of parts a tile has equally many samples of A and B,
//!   from whose difference the noise is estimated.

use crate::plan::Plan;
use crate::schedule::SAMPLE_ALIGNMENT;
use std::ops::Range;

/// Share of the weight of the first shard by which that of the last one is smaller.
const DECREASE: f64 = 0.9;
/// Work of a tile without new samples, which is copied from the base, in samples per pixel.
const COPY_SAMPLES: u32 = 1;

/// Samples of one shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Share {
    /// Number of the first tile.
    pub first: usize,
    /// Range of sample indices in each tile from the first one on, in both replicates. Ranges that
    /// begin at 0 contain the base of their tile.
    pub ranges: Vec<Range<u32>>,
}

/// First sample of a shard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Cut {
    tile: usize,
    sample: u32,
}

impl Plan {
    /// Returns all samples of the plan.
    pub fn whole(&self) -> Share {
        Share { first: 0, ranges: self.tiles.iter().map(|tile| 0..tile.end).collect() }
    }

    /// Returns the samples of `shard`, which may have none. Panics if there is no such shard.
    pub fn share(&self, shard: u32) -> Share {
        let shards = self.settings.shards;
        assert!((1..=shards).contains(&shard), "shard {shard} of {shards}");
        let cuts = self.cuts();
        let [start, end] = [cuts[shard as usize - 1], cuts[shard as usize]];
        let tiles = start.tile..end.tile + usize::from(end.sample > 0);
        let range = |tile: usize| {
            let first = if tile == start.tile { start.sample } else { 0 };
            let last = if tile == end.tile { end.sample } else { self.tiles[tile].end };
            first..last
        };
        Share {
            first: start.tile,
            ranges: tiles.map(range).filter(|r| start < end || !r.is_empty()).collect(),
        }
    }

    /// Returns the numbers of the shards that hold samples of the tiles `first..end`.
    pub(super) fn shards_of(&self, tiles: Range<usize>) -> Range<u32> {
        let cuts = self.cuts();
        let before = cuts.partition_point(|cut| *cut <= Cut { tile: tiles.start, sample: 0 });
        let end = cuts.partition_point(|cut| *cut < Cut { tile: tiles.end, sample: 0 });
        before.max(1) as u32..(end as u32).clamp(1, self.settings.shards) + 1
    }

    /// Returns the first sample of each shard, and the end of the last one.
    fn cuts(&self) -> Vec<Cut> {
        let work = |tile: usize| {
            let t = &self.tiles[tile];
            let samples = (t.end - t.base + COPY_SAMPLES) as f64;
            samples * self.pixels(tile) as f64 * f64::from(t.rays_per_sample.max(1.0))
        };
        let works: Vec<f64> = (0..self.tiles.len()).map(work).collect();
        let total: f64 = works.iter().sum();
        let shards = self.settings.shards;
        // Share of the work before shard `n`.
        let before = |n: u32| {
            let x = f64::from(n) / f64::from(shards);
            (x - 0.5 * DECREASE * x * x) / (1.0 - 0.5 * DECREASE)
        };
        let (mut tile, mut done) = (0, 0.0);
        let mut cuts = vec![Cut { tile: 0, sample: 0 }];
        for shard in 1..shards {
            let target = total * before(shard);
            while tile + 1 < works.len() && done + works[tile] <= target {
                done += works[tile];
                tile += 1;
            }
            let inside = ((target - done) / works[tile]).clamp(0.0, 1.0);
            let share = total * (before(shard + 1) - before(shard));
            let cut = self.cut(tile, inside, works[tile] <= 0.5 * share);
            cuts.push(cut.max(cuts[cuts.len() - 1]));
        }
        cuts.push(Cut { tile: self.tiles.len(), sample: 0 });
        cuts
    }

    /// Cuts `tile` after the share `inside` of its new samples, 0..=1, or beside it if it is `small`.
    fn cut(&self, tile: usize, inside: f64, small: bool) -> Cut {
        let t = &self.tiles[tile];
        let sample = t.base + (inside * f64::from(t.end - t.base)) as u32;
        let sample =
            sample.saturating_add(SAMPLE_ALIGNMENT / 2) / SAMPLE_ALIGNMENT * SAMPLE_ALIGNMENT;
        match small {
            true if inside >= 0.5 => Cut { tile: tile + 1, sample: 0 },
            true => Cut { tile, sample: 0 },
            false if sample <= t.base => Cut { tile, sample: 0 },
            false if sample >= t.end => Cut { tile: tile + 1, sample: 0 },
            false => Cut { tile, sample },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::testing::plan;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn shares_cover_every_sample_once(
            counts in proptest::collection::vec((0u32..70, 0u32..900), 1..40),
            shards in 1u32..60,
        ) {
            let tiles: Vec<[u32; 2]> =
                counts.iter().map(|(base, more)| [*base, base + more]).collect();
            let plan = plan(shards, &tiles);
            let mut next = Cut { tile: 0, sample: 0 };
            for shard in 1..=shards {
                let Share { first, ranges } = plan.share(shard);
                for (tile, range) in (first..).zip(ranges) {
                    prop_assert_eq!(Cut { tile, sample: range.start }, next);
                    let [base, end] = tiles[tile];
                    let whole = range.end == end;
                    prop_assert!(whole || range.end > base && range.end % SAMPLE_ALIGNMENT == 0);
                    next = if whole { Cut { tile: tile + 1, sample: 0 } } else {
                        Cut { tile, sample: range.end }
                    };
                    prop_assert!(plan.shards_of(tile..tile + 1).contains(&shard));
                }
            }
            prop_assert_eq!(next, Cut { tile: tiles.len(), sample: 0 });
        }
    }

    #[test]
    fn shards_shrink_and_large_tiles_are_cut() {
        let plan = |shards| plan(shards, &[[0, 16]; 90].map(|_| [0, 16]));
        let lengths: Vec<_> = (1..=9).map(|shard| plan(9).share(shard).ranges.len()).collect();
        assert_eq!(lengths, [17, 16, 13, 12, 10, 8, 7, 4, 3]);
        let large = crate::plan::testing::plan(2, &[[8, 800], [8, 16]]);
        let [one, two] = [1, 2].map(|shard| large.share(shard));
        assert_eq!((one.first, one.ranges.len(), one.ranges[0].end), (0, 1, 576));
        assert_eq!(two, Share { first: 0, ranges: vec![576..800, 0..16] });
    }
}
