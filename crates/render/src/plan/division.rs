//! Division of a planned render's samples among its shards, which different processes trace.
//!
//! The samples of a tile after its base are cut at multiples of [`SAMPLE_ALIGNMENT`] into blocks.
//! Shards get whole blocks, contiguous within a tile, for three reasons:
//!
//! - An aligned block of 2^m indices of the Owen-scrambled Sobol sequence is as well distributed as
//!   the first 2^m. The samples of every shard are therefore stratified (evenly distributed), and
//!   so are those of a merged picture that lacks a shard. The full picture holds the sample indices
//!   of each tile without gaps, starting at 0, wherever the cuts are.
//! - A block is as long as the widest packet. Shards trace the same packets as one process, at the
//!   same speed.
//! - A shard traces the same indices in both replicates. In any sum of shards each tile therefore
//!   has equally many samples of A and of B. The noise is estimated from the difference of A and B.
//!
//! If the number of blocks is not a multiple of the number of shards, the remaining blocks go to
//! shards in turn, tile after tile. The total numbers of blocks of two shards differ by at most 1.

use crate::plan::{BASE, Plan, PlannedTile};
use crate::schedule::SAMPLE_ALIGNMENT;
use std::ops::Range;

impl PlannedTile {
    /// Returns the number of blocks that the shards trace in this tile. The first and the last may
    /// be shorter.
    fn blocks(&self) -> u32 {
        if self.end > self.base {
            self.end.div_ceil(SAMPLE_ALIGNMENT) - self.base / SAMPLE_ALIGNMENT
        } else {
            0
        }
    }

    fn block_start(&self, block: u32) -> u32 {
        let aligned = (self.base / SAMPLE_ALIGNMENT + block).saturating_mul(SAMPLE_ALIGNMENT);
        aligned.clamp(self.base, self.end)
    }
}

impl Plan {
    /// Returns the range of sample indices that `shard` traces in each tile, in row order, and in
    /// both replicates. Ranges may be empty. The ranges of the shard [`BASE`] are the samples that
    /// the plan started from. Panics if there is no such shard.
    pub fn ranges(&self, shard: u32) -> Vec<Range<u32>> {
        let shards = self.settings.shards;
        assert!(shard <= shards, "shard {shard} of {shards}");
        if shard == BASE {
            return self.tiles.iter().map(|tile| 0..tile.base).collect();
        }
        let mut turn = 0;
        let range = |tile: &PlannedTile| {
            let (whole, remaining) = (tile.blocks() / shards, tile.blocks() % shards);
            // Position of the shard in the order in which the shards get the blocks of this tile.
            let place = (shard - 1 + shards - turn) % shards;
            turn = (turn + remaining) % shards;
            let start = |place: u32| tile.block_start(place * whole + place.min(remaining));
            start(place)..start(place + 1)
        };
        self.tiles.iter().map(range).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::testing::plan;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn ranges_cover_every_sample_once_in_whole_blocks(
            counts in proptest::collection::vec((0u32..70, 0u32..900), 12),
            shards in 1u32..40,
        ) {
            let tiles: Vec<[u32; 2]> =
                counts.iter().map(|(base, more)| [*base, base + more]).collect();
            let plan = plan(shards, &tiles);
            let ranges: Vec<_> = (0..=shards).map(|shard| plan.ranges(shard)).collect();
            for (tile, [base, end]) in tiles.iter().enumerate() {
                let mut sorted: Vec<_> = ranges.iter().map(|r| r[tile].clone()).collect();
                sorted.retain(|range| !range.is_empty());
                sorted.sort_by_key(|range| range.start);
                let mut next = 0;
                for range in sorted {
                    prop_assert_eq!(range.start, next);
                    let aligned = range.start % SAMPLE_ALIGNMENT == 0 || range.start == *base;
                    prop_assert!(aligned, "{:?}", range);
                    next = range.end;
                }
                prop_assert_eq!(next, *end);
            }
            let blocks = |shard: u32| -> u32 {
                let of_range = |r: &Range<u32>| {
                    if r.is_empty() { 0 } else { r.end.div_ceil(16) - r.start / 16 }
                };
                ranges[shard as usize].iter().map(of_range).sum()
            };
            let (least, most) = ((1..=shards).map(blocks).min(), (1..=shards).map(blocks).max());
            prop_assert!(most.unwrap() - least.unwrap() <= 1);
        }
    }

    #[test]
    fn shards_of_equal_tiles_have_equal_blocks() {
        let plan = plan(4, &[[8, 40]; 12]);
        // Each tile has the blocks 8..16, 16..32 and 32..40. The fourth shard gets no block of the
        // first tile, and is therefore first in the second tile.
        let ranges = |shard: u32| plan.ranges(shard)[..2].to_vec();
        assert_eq!(ranges(0), [0..8, 0..8]);
        assert_eq!(ranges(1), [8..16, 16..32]);
        assert_eq!(ranges(2), [16..32, 32..40]);
        assert_eq!(ranges(3), [32..40, 40..40]);
        assert_eq!(ranges(4), [40..40, 8..16]);
    }
}
