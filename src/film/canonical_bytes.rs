//! Canonical serialisation of the film. Tests compare films by these bytes. Films with equal
//! samples have equal bytes, in whatever order the samples were added.
//!
//! All numbers are little-endian. The parts are, in this order:
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

use crate::film::TILE;
use crate::film::store::Film;
use crate::film::tile::Tile;
use std::io::{self, Write};

impl Film {
    /// Returns the film as bytes. Films with equal samples have equal bytes.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.write_bytes(&mut bytes).expect("writing to memory does not fail");
        bytes
    }

    /// Writes the bytes of [`Film::bytes`] to `out`, part by part.
    ///
    /// # Errors
    /// Returns the error of writing to `out`.
    pub fn write_bytes(&self, out: &mut impl Write) -> io::Result<()> {
        let u32_bytes = |n: usize| u32::try_from(n).map_err(io::Error::other).map(u32::to_le_bytes);
        let header = self.header();
        for n in [header.width, header.height, header.scales.len()] {
            out.write_all(&u32_bytes(n)?)?;
        }
        header.scales.iter().try_for_each(|scale| out.write_all(&scale.to_le_bytes()))?;
        out.write_all(&header.seed.to_le_bytes())?;
        out.write_all(&u32_bytes(header.precision.len())?)?;
        out.write_all(header.precision.as_bytes())?;
        let bad = self.bad_samples();
        out.write_all(&bad.count.to_le_bytes())?;
        out.write_all(&u32_bytes(bad.first.len())?)?;
        for sample in &bad.first {
            for n in [sample.index, sample.x, sample.y] {
                out.write_all(&n.to_le_bytes())?;
            }
            out.write_all(&[sample.replicate])?;
        }
        (0..self.tile_count()).try_for_each(|index| write_tile(self.tile(index), out))?;
        match self.saturated_samples() {
            0 => Ok(()),
            count => out.write_all(&count.to_le_bytes()),
        }
    }
}

fn write_tile(tile: Option<&Tile>, out: &mut impl Write) -> io::Result<()> {
    let Some(tile) = tile.filter(|tile| tile.any_sampled()) else {
        return out.write_all(&[0; 9]);
    };
    tile.counts().iter().try_for_each(|count| out.write_all(&count.to_le_bytes()))?;
    out.write_all(&[tile.lattice_px() as u8])?;
    let [width, height] = tile.extent();
    for replicate in 0..2 {
        for pixel in (0..height).flat_map(|y| (0..width).map(move |x| y * TILE + x)) {
            for sum in tile.pixel(replicate, pixel) {
                out.write_all(&sum.to_le_bytes())?;
            }
        }
    }
    Ok(())
}
