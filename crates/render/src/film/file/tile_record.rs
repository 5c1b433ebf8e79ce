//! Encoding of tiles in film files.

use crate::film::TILE;
use crate::film::file::decode::Fields;
use crate::film::tile::{TILE_PIXELS, Tile};

/// Largest integer that one sample adds to a sum.
const LARGEST_SAMPLE: u64 = 1 << 49;

/// Bytes of an integer sum in memory.
const WORD: usize = 8;

/// Appends the record of `tile` to `out`; `None` is a tile that was never written.
pub(crate) fn encode(tile: Option<&Tile>, out: &mut Vec<u8>) {
    let Some(tile) = tile.filter(|tile| tile.counts != [0; 2]) else {
        return out.extend([0; 8]);
    };
    tile.counts.iter().for_each(|count| out.extend(count.to_le_bytes()));
    out.extend(tile.saturated_samples.to_le_bytes());
    out.extend(tile.bad_samples.to_le_bytes());
    for replicate in 0..2 {
        let mut pixels: [&[i64]; TILE_PIXELS] = [&[]; TILE_PIXELS];
        let [width, height] = tile.extent;
        let pixels = &mut pixels[..width * height];
        for (sums, pixel) in pixels.iter_mut().zip(inside([width, height])) {
            *sums = tile.pixel(replicate, pixel);
        }
        for i in 0..pixels[0].len() {
            encode_plane(pixels, i, out);
        }
    }
}

/// Appends the plane of sum `i`, that is, this sum of each pixel, to `out`.
fn encode_plane(pixels: &[&[i64]], i: usize, out: &mut Vec<u8>) {
    let all = pixels.iter().fold(0, |all, sums| all | sums[i] as u64);
    let bytes = (64 - all.leading_zeros()).div_ceil(8) as usize;
    out.push(bytes as u8);
    if bytes == 0 {
        return;
    }
    let start = out.len();
    let end = start + pixels.len() * bytes;
    // Each sum is written with eight bytes. The next sum overwrites its high bytes, which are zero.
    out.resize(end + WORD, 0);
    for (n, sums) in pixels.iter().enumerate() {
        out[start + n * bytes..][..WORD].copy_from_slice(&sums[i].to_le_bytes());
    }
    out.truncate(end);
}

/// Reads a record into `tile`, which must be empty. Returns `None` if the record is invalid.
pub(crate) fn decode(tile: &mut Tile, groups: usize, fields: &mut Fields) -> Option<()> {
    tile.counts = [fields.u32()?, fields.u32()?];
    tile.saturated_samples = fields.u64()?;
    tile.bad_samples = fields.u64()?;
    let extent = tile.extent;
    let pixels = extent[0] * extent[1];
    for (replicate, count) in tile.counts.into_iter().enumerate() {
        let limit = (u64::from(count).saturating_mul(LARGEST_SAMPLE)).min(i64::MAX as u64);
        for i in 0..3 * groups {
            let bytes = usize::from(fields.u8()?);
            if bytes > WORD {
                return None;
            }
            let plane = fields.take(pixels * bytes)?;
            if bytes == 0 {
                continue;
            }
            let mask = u64::MAX >> (64 - 8 * bytes);
            for (n, pixel) in inside(extent).enumerate() {
                let rest = &plane[n * bytes..];
                let sum = match rest.first_chunk::<WORD>() {
                    Some(word) => u64::from_le_bytes(*word) & mask,
                    // Fewer than eight bytes remain at the end of the plane.
                    None => {
                        let mut word = [0; WORD];
                        word[..bytes].copy_from_slice(&rest[..bytes]);
                        u64::from_le_bytes(word)
                    }
                };
                if sum > limit {
                    return None;
                }
                tile.full |= sum == i64::MAX as u64;
                tile.pixel_mut(replicate, pixel)[i] = sum as i64;
            }
        }
    }
    Some(())
}

/// Iterates row by row over the pixels of a tile inside the picture.
fn inside([width, height]: [usize; 2]) -> impl Iterator<Item = usize> {
    (0..height).flat_map(move |y| (0..width).map(move |x| y * TILE + x))
}
