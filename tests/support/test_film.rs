//! Contents of films, for tests: single pixels, and all samples as bytes. The unit tests of films
//! include this file, too.
//!
//! In the bytes of a film, all numbers are little-endian. The parts are, in this order:
//!
//! - Header: width, height and number of light groups (u32 each), a scale for each group (f64), the
//!   seed (u64), and the name of the floating-point precision as length in bytes (u32) and text.
//! - Invalid samples: their number (u64), the number of stored positions (u32), and for each
//!   position index, x, y (u32 each) and replicate (u8).
//! - Tiles, row by row: sample counts of A and B, the two halves of the samples (u32 each), and
//!   [`Tile::lattice_px`] (u8). If the tile has samples, the sums of the pixels inside the picture
//!   follow, `[replicate][row][column][group][channel]` (i64).
//! - Number of samples above the largest value that the film can store (u64). It is omitted if it
//!   is 0.

use super::{Film, LightWeights, Replicates, TILE, Tile};

/// Film whose contents a test examines.
pub trait TestFilm {
    /// Returns the radiance of the pixel in column `x` and row `y`: the mean over its samples in
    /// both replicates, or black without samples.
    fn pixel(&self, x: usize, y: usize, weights: &LightWeights) -> [f64; 3];

    /// Returns the radiance of each pixel of the row `y`, as [`Self::pixel`] does.
    fn pixels_of_row(&self, y: usize, weights: &LightWeights) -> Vec<[f64; 3]>;

    /// Returns the film as bytes. Films with equal samples have equal bytes, in whatever order the
    /// samples were added.
    fn bytes(&self) -> Vec<u8>;
}

impl TestFilm for Film {
    fn pixel(&self, x: usize, y: usize, weights: &LightWeights) -> [f64; 3] {
        self.pixels_of_row(y, weights)[x]
    }

    fn pixels_of_row(&self, y: usize, weights: &LightWeights) -> Vec<[f64; 3]> {
        let mut row = Vec::new();
        self.row(y, Replicates::Both, weights, &mut row);
        row
    }

    fn bytes(&self) -> Vec<u8> {
        let mut out = Vec::new();
        let header = self.header();
        for n in [header.width, header.height, header.scales.len()] {
            out.extend(u32_bytes(n));
        }
        header.scales.iter().for_each(|scale| out.extend(scale.to_le_bytes()));
        out.extend(header.seed.to_le_bytes());
        out.extend(u32_bytes(header.precision.len()));
        out.extend(header.precision.as_bytes());
        let bad = self.bad_samples();
        out.extend(bad.count.to_le_bytes());
        out.extend(u32_bytes(bad.first.len()));
        for sample in &bad.first {
            for n in [sample.index, sample.x, sample.y] {
                out.extend(n.to_le_bytes());
            }
            out.push(sample.replicate);
        }
        (0..self.tile_count()).for_each(|index| add_tile(self.tile(index), &mut out));
        match self.saturated_samples() {
            0 => {}
            count => out.extend(count.to_le_bytes()),
        }
        out
    }
}

fn u32_bytes(n: usize) -> [u8; 4] {
    u32::try_from(n).expect("a size below 2^32").to_le_bytes()
}

fn add_tile(tile: Option<&Tile>, out: &mut Vec<u8>) {
    let Some(tile) = tile.filter(|tile| tile.any_sampled()) else {
        return out.extend([0; 9]);
    };
    tile.counts().iter().for_each(|count| out.extend(count.to_le_bytes()));
    out.push(tile.lattice_px() as u8);
    let [width, height] = tile.extent();
    for replicate in 0..2 {
        for pixel in (0..height).flat_map(|y| (0..width).map(move |x| y * TILE + x)) {
            tile.pixel(replicate, pixel).iter().for_each(|sum| out.extend(sum.to_le_bytes()));
        }
    }
}
