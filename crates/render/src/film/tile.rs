//! Film tile of 16x16 pixels: integer sums of the samples of both replicates.

use crate::film::TILE;
use std::collections::TryReserveError;
use zerkalo_kernel::lanes::prefetch;

/// Number of pixels in a film tile.
pub const TILE_PIXELS: usize = TILE * TILE;

/// Largest number of light groups of a film.
pub const MAX_FILM_GROUPS: usize = 16;

/// Number of integer sums (8 bytes each) in a cache line of 64 bytes.
const CACHE_LINE: usize = 8;

/// Integer sums of a pixel without samples.
static ZERO_SUMS: [i64; 3 * MAX_FILM_GROUPS] = [0; 3 * MAX_FILM_GROUPS];

/// Integer sums of 16 x 16 pixels of a film. The pixel in column x and row y of the tile has the
/// number `16 y + x`. Pixels outside the picture stay zero.
///
/// All pixels have the same number of samples in a replicate, except during the first pass. It adds
/// the first sample of replicate A to ever more pixels; [`Tile::lattice_px`] is its progress.
#[derive(Clone, Debug, Default)]
pub struct Tile {
    /// Epoch of the film when the tile was written; 0 for a new tile.
    pub(super) epoch: u64,
    /// Number of integer sums of a pixel and replicate: `groups * 3`.
    stride: usize,
    /// Width and height of the tile's part inside the picture, 1..=16 pixels.
    pub extent: [usize; 2],
    /// Number of samples of every pixel in the replicates A and B, without an incomplete first
    /// pass.
    pub counts: [u32; 2],
    /// Progress of the first pass: pixels whose x and y are multiples of this number have their first
    /// sample of replicate A. 0 before and after the first pass.
    pub lattice_px: usize,
    /// `true` if an integer sum has reached `i64::MAX`.
    pub(super) full: bool,
    /// Number of samples with [`SampleFault::Saturated`].
    pub saturated_samples: u64,
    /// Number of samples with [`SampleFault::Invalid`].
    pub bad_samples: u64,
    /// Integer sums, `[replicate][pixel][group][channel]`. Until the tile is first written, the
    /// numbers have no meaning; the vector only keeps memory.
    pub(super) sums: Vec<i64>,
    /// Bits of the pixels written since the film's last restart: bit `p % 64` of `[replicate][p /
    /// 64]` is for pixel p. Sums of other pixels count as zero, so that a restart does not access
    /// them.
    written: [[u64; TILE_PIXELS / 64]; 2],
}

/// Reason for which the film does not hold a sample as it was traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleFault {
    /// The sample is NaN or negative in a light group; black was added.
    Invalid,
    /// The sample exceeds the largest value that the film can store, which was added.
    Saturated,
}

impl Tile {
    pub(super) fn cleared(groups: usize, extent: [usize; 2]) -> Self {
        Self { stride: groups * 3, extent, ..Self::default() }
    }

    /// Creates a tile that belongs to no film.
    pub(crate) fn blank(groups: usize, extent: [usize; 2]) -> Self {
        let mut tile = Self::cleared(groups, extent);
        tile.clear_if_stale(1);
        tile
    }

    pub(super) fn sums_len(groups: usize) -> usize {
        2 * TILE_PIXELS * groups * 3
    }

    /// Allocates the memory of the sums, without writing to it.
    pub(super) fn reserve(&mut self) -> Result<(), TryReserveError> {
        let len = Self::sums_len(self.stride / 3);
        if self.sums.capacity() < len {
            self.sums = Vec::new();
            self.sums.try_reserve_exact(len)?;
        }
        Ok(())
    }

    /// Clears the tile, unless it was written in `epoch`, the current epoch of the film. Allocates
    /// its memory if necessary.
    pub(super) fn clear_if_stale(&mut self, epoch: u64) {
        if self.epoch == epoch {
            return;
        }
        let len = Self::sums_len(self.stride / 3);
        let mut sums = std::mem::take(&mut self.sums);
        if sums.capacity() >= len {
            sums.resize(len, 0);
        } else {
            // Growing the vector would copy its old contents.
            sums = vec![0; len];
        }
        *self = Self { epoch, sums, ..Self::cleared(self.stride / 3, self.extent) };
    }

    /// Returns the number of samples of one pixel in the replicates A and B.
    #[inline]
    pub fn counts_of(&self, pixel: usize) -> [u32; 2] {
        let extra = self.lattice_px != 0 && on_lattice(pixel, self.lattice_px);
        [self.counts[0] + u32::from(extra), self.counts[1]]
    }

    /// Returns `true` if at least one pixel has a sample.
    pub fn any_sampled(&self) -> bool {
        self.counts != [0; 2] || self.lattice_px != 0
    }

    /// Increases the sample count of all pixels in `replicate` (0: A, 1: B) by `samples`.
    pub fn advance(&mut self, replicate: usize, samples: u32) {
        self.counts[replicate] = self.counts[replicate].saturating_add(samples);
    }

    pub fn count_fault(&mut self, fault: SampleFault) {
        match fault {
            SampleFault::Invalid => self.bad_samples += 1,
            SampleFault::Saturated => self.saturated_samples += 1,
        }
    }

    /// Records that the pixels whose x and y are multiples of `step_px` (1, 2, 4, 8 or 16) have
    /// their first sample. A step of 1 completes the first pass.
    ///
    /// # Panics
    /// Panics if `step_px` is none of these, or larger than the previous step of the same pass.
    pub fn set_lattice(&mut self, step_px: usize) {
        assert!(
            matches!(step_px, 1 | 2 | 4 | 8 | 16)
                && (self.lattice_px == 0 || step_px <= self.lattice_px),
            "a lattice of {step_px} pixels after one of {}",
            self.lattice_px
        );
        if step_px == 1 {
            self.lattice_px = 0;
            self.advance(0, 1);
        } else {
            self.lattice_px = step_px;
        }
    }

    /// Returns the integer sums of a pixel for writing, `[group][channel]`. Callers must ensure
    /// that no sum overflows.
    #[inline(always)]
    pub fn pixel_mut(&mut self, replicate: usize, pixel: usize) -> &mut [i64] {
        let start = (replicate * TILE_PIXELS + pixel) * self.stride;
        let sums = &mut self.sums[start..start + self.stride];
        let (word, bit) = (&mut self.written[replicate][pixel / 64], 1 << (pixel % 64));
        if *word & bit == 0 {
            *word |= bit;
            // With one light group, three stores are faster than a call of `fill`.
            match &mut *sums {
                [r, g, b] => (*r, *g, *b) = (0, 0, 0),
                several => several.fill(0),
            }
        }
        sums
    }

    /// Returns the integer sums of a pixel, `[group][channel]`.
    #[inline(always)]
    pub fn pixel(&self, replicate: usize, pixel: usize) -> &[i64] {
        if self.written[replicate][pixel / 64] >> (pixel % 64) & 1 == 0 {
            return &ZERO_SUMS[..self.stride];
        }
        let start = (replicate * TILE_PIXELS + pixel) * self.stride;
        &self.sums[start..start + self.stride]
    }

    /// Prefetches the integer sums of a replicate into the processor's cache.
    pub fn prefetch(&self, replicate: usize) {
        let start = replicate * TILE_PIXELS * self.stride;
        let sums = &self.sums[start..start + TILE_PIXELS * self.stride];
        sums.chunks(CACHE_LINE).for_each(|line| prefetch(&line[0]));
    }

    /// Iterates over the pairs (replicate, pixel) written since the last restart.
    fn written(&self) -> impl Iterator<Item = (usize, usize)> {
        let all = (0..2).flat_map(|r| (0..TILE_PIXELS).map(move |p| (r, p)));
        all.filter(|(r, p)| self.written[*r][p / 64] >> (p % 64) & 1 != 0)
    }

    /// Adds non-negative `values`, `[group][channel]`, to the sums of a pixel. A sum that would
    /// exceed `i64::MAX` becomes `i64::MAX`, so that the order of addition does not matter.
    #[inline(always)]
    pub fn add(&mut self, replicate: usize, pixel: usize, values: &[i64]) {
        for (group, values) in values.chunks_exact(3).enumerate() {
            self.add_group(replicate, pixel, group, [values[0], values[1], values[2]]);
        }
    }

    /// Adds non-negative `values` to the sums of one light group, as [`Tile::add`] does.
    #[inline(always)]
    pub fn add_group(&mut self, replicate: usize, pixel: usize, group: usize, values: [i64; 3]) {
        let sums = &mut self.pixel_mut(replicate, pixel)[3 * group..][..3];
        // A sum of non-negative numbers is negative if it has overflowed.
        let new = [0, 1, 2].map(|c| sums[c].wrapping_add(values[c]));
        let fit = new[0] | new[1] | new[2] >= 0;
        sums.copy_from_slice(&if fit { new } else { new.map(saturated_sum) });
        self.full |= !fit;
    }

    /// Returns the number of pixels with a sum that has reached `i64::MAX`. Further samples make
    /// them too dark.
    pub fn saturated_pixels(&self) -> u64 {
        if !self.full {
            return 0;
        }
        let full = |pixel: &usize| (0..2).any(|r| self.pixel(r, *pixel).contains(&i64::MAX));
        (0..TILE_PIXELS).filter(full).count() as u64
    }

    /// Adds the samples of `other`, a tile at the same position of another film. At most one of the
    /// two tiles may be in its first pass.
    pub(crate) fn add_tile(&mut self, other: &Self) {
        for (replicate, pixel) in other.written() {
            self.add(replicate, pixel, other.pixel(replicate, pixel));
        }
        self.full |= other.full;
        self.saturated_samples += other.saturated_samples;
        self.lattice_px = self.lattice_px.max(other.lattice_px);
        for replicate in 0..2 {
            self.advance(replicate, other.counts[replicate]);
        }
        self.bad_samples += other.bad_samples;
    }
}

/// Returns `sum`, the result of a wrapping addition, or `i64::MAX` if the addition overflowed.
#[cold]
fn saturated_sum(sum: i64) -> i64 {
    if sum < 0 { i64::MAX } else { sum }
}

#[inline(always)]
fn on_lattice(pixel: usize, step_px: usize) -> bool {
    // The step is a power of two: in its multiples, all bits below the bit of the step are 0.
    ((pixel % TILE) | (pixel / TILE)) & (step_px - 1) == 0
}

/// Iterates row by row over the pixels of a tile whose x and y are multiples of `step_px`, which
/// divides 16. Pixels whose x and y are multiples of the larger step `before_px` are left out,
/// unless it is 0.
pub fn lattice_pixels(before_px: usize, step_px: usize) -> impl Iterator<Item = usize> {
    let lines = move || (0..TILE).step_by(step_px);
    lines()
        .flat_map(move |y| lines().map(move |x| y * TILE + x))
        .filter(move |p| before_px == 0 || !on_lattice(*p, before_px))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile() -> Tile {
        let mut tile = Tile::cleared(2, [16, 16]);
        tile.clear_if_stale(1);
        tile
    }

    #[test]
    fn lattices_visit_every_pixel_once() {
        let mut seen = [0; TILE_PIXELS];
        for (before, step) in [(0, 16), (16, 8), (8, 4), (4, 2), (2, 1)] {
            lattice_pixels(before, step).for_each(|p| seen[p] += 1);
        }
        assert_eq!(seen, [1; TILE_PIXELS]);
        assert_eq!(lattice_pixels(0, 8).collect::<Vec<_>>(), [0, 8, 128, 136]);
        assert_eq!(lattice_pixels(8, 1).count(), 252);
    }

    #[test]
    fn lattice_determines_the_pixels_with_a_first_sample() {
        let mut tile = tile();
        assert!(!tile.any_sampled());
        tile.set_lattice(8);
        assert!(tile.any_sampled() && tile.counts_of(137) == [0; 2]);
        assert_eq!((tile.counts, tile.counts_of(8)), ([0, 0], [1, 0]));
        tile.set_lattice(1);
        assert_eq!((tile.counts, tile.lattice_px), ([1, 0], 0));
        assert_eq!(tile.counts_of(137), [1, 0]);
    }

    #[test]
    #[should_panic(expected = "a lattice of 8 pixels after one of 4")]
    fn coarser_lattice_panics() {
        let mut tile = tile();
        tile.set_lattice(4);
        tile.set_lattice(8);
    }

    #[test]
    fn saturated_sums_stay_and_are_counted() {
        let mut tile = tile();
        tile.add(1, 3, &[i64::MAX - 1, 1, 2, 3, 4, 5]);
        assert_eq!(tile.saturated_pixels(), 0);
        tile.add(1, 3, &[2, 1, 2, 3, 4, 5]);
        tile.add(1, 3, &[2, 0, 0, 0, 0, 0]);
        assert_eq!(tile.saturated_pixels(), 1);
        assert_eq!(tile.pixel(1, 3), [i64::MAX, 2, 4, 6, 8, 10]);
        assert_eq!(tile.pixel(0, 3), [0; 6]);
        tile.add(0, 3, &[i64::MAX, i64::MAX, 0, 0, 0, 0]);
        tile.add(0, 3, &[1, 1, 0, 0, 0, 0]);
        assert_eq!(tile.pixel(0, 3), [i64::MAX, i64::MAX, 0, 0, 0, 0]);
        assert_eq!(tile.saturated_pixels(), 1);
    }

    #[test]
    fn new_epoch_clears_the_tile() {
        let mut tile = tile();
        tile.add(0, 0, &[1; 6]);
        tile.advance(0, 1);
        tile.saturated_samples += 3;
        tile.clear_if_stale(1);
        assert_eq!((tile.pixel(0, 0)[0], tile.counts), (1, [1, 0]));
        assert_eq!(tile.saturated_samples, 3);
        tile.clear_if_stale(2);
        assert_eq!((tile.pixel(0, 0)[0], tile.counts), (0, [0, 0]));
        assert_eq!(tile.saturated_samples, 0);
        // The first access to the cleared tile is a write. Below, tiles with 1 and 3 groups reuse
        // memory of a tile with another number of groups.
        tile.add(0, 0, &[2; 6]);
        assert_eq!((tile.pixel(0, 0), tile.pixel(1, 0)), (&[2; 6][..], &[0; 6][..]));
        for groups in [1, 3] {
            let memory = std::mem::replace(&mut tile, Tile::cleared(groups, [16, 16]));
            tile.sums = memory.sums;
            tile.clear_if_stale(7);
            tile.add(1, 255, &vec![5; 3 * groups]);
            assert_eq!(tile.pixel(1, 255), vec![5; 3 * groups]);
            assert!((0..255).all(|p| tile.pixel(1, p) == vec![0; 3 * groups]));
        }
    }
}
