//! Ordered dithering to the 256-colour table: Thomas Knoll's pattern dithering.
//!
//! For each pixel a few colours of the table are chosen, whose mean in linear light approximates
//! the colour of the pixel. They are sorted by lightness, and the position of the pixel in an
//! ordered pattern selects one of them.

use crate::cells::Raster;
use crate::cells::oklab::{level, linear};
use crate::cells::palette_quantisation::{nearest_xterm, vivid, xterm_lightness, xterm_rgb};

/// Number of colours that are mixed for a pixel.
const MIXED: usize = 4;
/// Bayer's pattern, `[y][x]`: which of the mixed colours, ordered from dark to light, a pixel
/// shows.
const PATTERN: [[usize; 2]; 2] = [[0, 2], [3, 1]];
/// Share, from 0 to 1, of the error so far that is added to the target before the next colour is
/// chosen. A share of 1 reproduces the mean best, but mixes distant colours, which looks coarse
/// because pixels are as large as half a cell.
const STRENGTH: f32 = 0.5;

/// Returns the index in xterm's table of 256 colours for each pixel.
pub fn dithered(raster: &Raster) -> Vec<u8> {
    let mut last = None;
    let mut mixed = [0; MIXED];
    let mut indices = Vec::with_capacity(raster.pixels.len());
    for (i, rgb) in raster.pixels.iter().enumerate() {
        if last != Some(*rgb) {
            mixed = mixture(vivid(*rgb));
            last = Some(*rgb);
        }
        let (x, y) = (i % raster.width, i / raster.width);
        indices.push(mixed[PATTERN[y % 2][x % 2]]);
    }
    indices
}

/// Returns the indices of xterm's colours to mix for `rgb`, from dark to light.
fn mixture(rgb: [u8; 3]) -> [u8; MIXED] {
    let target = linear(rgb);
    let mut missing = [0.0f32; 3];
    let mut mixed = [0; MIXED];
    for index in &mut mixed {
        let goal = [0, 1, 2].map(|c| level(target[c] + STRENGTH * missing[c]));
        *index = nearest_xterm(goal);
        let chosen = linear(xterm_rgb(*index));
        (0..3).for_each(|c| missing[c] += target[c] - chosen[c]);
    }
    mixed.sort_by(|a, b| xterm_lightness(*a).total_cmp(&xterm_lightness(*b)));
    mixed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::Oklab;

    /// Checks that the mean colour of a dithered area is closer to its target than any single
    /// colour of the palette.
    #[test]
    fn dithered_mean_is_closer_than_nearest_color() {
        let (mut plain, mut mixed) = (0.0, 0.0);
        for step in 0..64u8 {
            let rgb = [60 + 3 * step, 160 + step, 220 - 2 * step];
            let target = Oklab::of(rgb);
            let raster = Raster::from_fn(8, 8, |_| rgb);
            let mut mean = [0.0f32; 3];
            for index in dithered(&raster) {
                let color = linear(xterm_rgb(index));
                (0..3).for_each(|c| mean[c] += color[c] / 64.0);
            }
            mixed += Oklab::of_linear(mean).distance(target);
            plain += Oklab::of(xterm_rgb(nearest_xterm(rgb))).distance(target);
        }
        assert!(mixed < 0.6 * plain, "{mixed} after {plain}");
    }

    #[test]
    fn table_colors_are_not_dithered() {
        for index in 16..=255 {
            assert_eq!(mixture(xterm_rgb(index)), [index; MIXED]);
        }
    }
}
