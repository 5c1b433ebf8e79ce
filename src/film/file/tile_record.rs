//! Records of tiles in film files.

use crate::film::TILE;
use crate::film::file::decode::Fields;
use crate::film::invalid::{INVALID_REMEMBERED, InvalidSample, InvalidSamples};
use crate::film::tile::{TILE_PIXELS, Tile};

/// Largest value of a sample in steps of the film's scale.
const LARGEST_SAMPLE: u64 = 1 << 49;

/// Appends the record of a tile to `out`. `None` is a tile without samples.
pub(super) fn encode(tile: Option<&Tile>, out: &mut Vec<u8>) {
    let Some(tile) = tile.filter(|tile| tile.counts() != [0; 2]) else {
        return out.extend([0; 8]);
    };
    tile.counts().iter().for_each(|count| out.extend(count.to_le_bytes()));
    out.extend(tile.saturated_samples().to_le_bytes());
    let bad = tile.bad();
    out.extend(bad.count.to_le_bytes());
    out.push(bad.first.len() as u8);
    for sample in &bad.first {
        [sample.index, sample.x, sample.y].iter().for_each(|n| out.extend(n.to_le_bytes()));
        out.push(sample.replicate);
    }
    let mut plane = [0u64; TILE_PIXELS];
    for replicate in 0..2 {
        for i in 0..tile.pixel(0, 0).len() {
            let mut all = 0;
            let mut pixels = 0;
            for (pixel, sum) in inside(tile.extent()).zip(&mut plane) {
                *sum = tile.pixel(replicate, pixel)[i] as u64;
                all |= *sum;
                pixels += 1;
            }
            let bytes = (64 - all.leading_zeros()).div_ceil(8) as usize;
            out.push(bytes as u8);
            let start = out.len();
            out.resize(start + pixels * bytes, 0);
            if bytes > 0 {
                for (low, sum) in out[start..].chunks_exact_mut(bytes).zip(&plane) {
                    low.copy_from_slice(&sum.to_le_bytes()[..bytes]);
                }
            }
        }
    }
}

/// Reads a record into `tile`, which is empty. Returns `None` if the record is not valid.
pub(super) fn decode(tile: &mut Tile, groups: usize, fields: &mut Fields) -> Option<()> {
    let counts = [fields.u32()?, fields.u32()?];
    let saturated_samples = fields.u64()?;
    let bad = InvalidSamples { count: fields.u64()?, first: invalid_samples(fields)? };
    if bad.count < bad.first.len() as u64 {
        return None;
    }
    let extent = tile.extent();
    let pixels = extent[0] * extent[1];
    let mut full = false;
    for (replicate, count) in counts.into_iter().enumerate() {
        let limit = (u64::from(count).saturating_mul(LARGEST_SAMPLE)).min(i64::MAX as u64);
        for i in 0..3 * groups {
            let bytes = usize::from(fields.u8()?);
            if bytes > 8 {
                return None;
            }
            let plane = fields.take(pixels * bytes)?;
            if bytes == 0 {
                continue;
            }
            for (pixel, low) in inside(extent).zip(plane.chunks_exact(bytes)) {
                let mut sum = [0; 8];
                sum[..bytes].copy_from_slice(low);
                let sum = u64::from_le_bytes(sum);
                if sum > limit {
                    return None;
                }
                full |= sum == i64::MAX as u64;
                tile.pixel_mut(replicate, pixel)[i] = sum as i64;
            }
        }
    }
    tile.restore(counts, saturated_samples, bad, full);
    Some(())
}

fn invalid_samples(fields: &mut Fields) -> Option<Vec<InvalidSample>> {
    let remembered = usize::from(fields.u8()?);
    if remembered > INVALID_REMEMBERED {
        return None;
    }
    let sample = |_| {
        let [index, x, y] = [fields.u32()?, fields.u32()?, fields.u32()?];
        Some(InvalidSample { index, replicate: fields.u8()?, y, x })
    };
    let samples: Vec<_> = (0..remembered).map(sample).collect::<Option<_>>()?;
    (samples.is_sorted() && samples.iter().all(|s| s.replicate < 2)).then_some(samples)
}

/// Iterates over the pixels of a tile that are inside the picture, row by row.
fn inside([width, height]: [usize; 2]) -> impl Iterator<Item = usize> {
    (0..height).flat_map(move |y| (0..width).map(move |x| y * TILE + x))
}
