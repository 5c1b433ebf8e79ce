//! Films with known contents, for unit tests.

use crate::film::store::{Film, Header};
use crate::film::tile::Tile;
use crate::film::{LightWeights, TILE};

pub use crate::film::test_random::Rng;

/// Returns an empty film of `width` x `height` pixels. Each entry of `scales` creates a light
/// group; samples of the group are multiplied by it before they are rounded to integers.
pub fn film(width: usize, height: usize, scales: &[f64]) -> Film {
    let scales = scales.to_vec();
    Film::new(Header { width, height, scales, seed: 1, precision: "single".to_string() })
}

/// Returns light weights of 1 for each of `groups` groups.
pub fn white(groups: usize) -> LightWeights {
    LightWeights { weights: vec![[1.0; 3]; groups] }
}

/// Returns light weights of 1 for the group `group` and 0 for the others of `groups`.
pub fn only(group: usize, groups: usize) -> LightWeights {
    LightWeights { weights: (0..groups).map(|g| [f64::from(u8::from(g == group)); 3]).collect() }
}

/// Calls `f` with every tile, and with the column and row of its upper left pixel.
pub fn each_tile(film: &mut Film, mut f: impl FnMut(&mut Tile, [usize; 2])) {
    let all: Vec<_> = (0..film.tile_count()).collect();
    for slot in film.slots(&all) {
        let origin = slot.origin;
        f(slot.prepare(), origin);
    }
}

/// Adds `count` samples per pixel to both replicates (halves of the samples). `sums(x, y,
/// replicate)` returns the sums of a pixel's samples in radiance, `[group][channel]`. Each sum is
/// multiplied by the scale of its group and rounded.
pub fn fill(film: &mut Film, count: u32, mut sums: impl FnMut(usize, usize, usize) -> Vec<f64>) {
    let scales = film.scales().to_vec();
    each_tile(film, |tile, [x0, y0]| {
        let [width, height] = tile.extent();
        for replicate in 0..2 {
            for pixel in (0..height).flat_map(|y| (0..width).map(move |x| y * TILE + x)) {
                let sums = sums(x0 + pixel % TILE, y0 + pixel / TILE, replicate);
                let fixed: Vec<_> = sums
                    .iter()
                    .enumerate()
                    .map(|(i, sum)| (sum * scales[i / 3]).round() as i64)
                    .collect();
                tile.add(replicate, pixel, &fixed);
            }
            tile.advance(replicate, count);
        }
    });
}
