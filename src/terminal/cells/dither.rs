//! Ordered dithering to the 256-colour table, for pictures that no longer change.
//!
//! The method is Thomas Knoll's pattern dithering. For each pixel a few colours of the table are
//! chosen. Their mean in linear light approximates the colour of the pixel. The chosen colours are
//! sorted by lightness, and the position of the pixel in an ordered pattern selects one of them.

use crate::terminal::cells::Raster;
use crate::terminal::cells::oklab::{code, linear};
use crate::terminal::cells::palette256;

/// Number of table colours that are mixed for a pixel, one per cell of the pattern.
const MIXED: usize = 4;
/// Bayer's ordered pattern of 2 x 2 pixels.
const PATTERN: [[usize; 2]; 2] = [[0, 2], [3, 1]];
/// Share of the accumulated error that the choice of the next colour compensates. A share of 1
/// reproduces the mean best, but mixes distant colours, which looks coarse in pixels as large as
/// half a cell.
const STRENGTH: f32 = 0.5;

/// Returns the index of a table colour for each pixel of `raster`, by ordered dithering.
pub fn dithered(raster: &Raster) -> Vec<u8> {
    let mut last = None;
    let mut mixed = [0; MIXED];
    let mut indices = Vec::with_capacity(raster.pixels.len());
    for (i, rgb) in raster.pixels.iter().enumerate() {
        if last != Some(*rgb) {
            mixed = mixture(*rgb);
            last = Some(*rgb);
        }
        let (x, y) = (i % raster.width, i / raster.width);
        indices.push(mixed[PATTERN[y % 2][x % 2]]);
    }
    indices
}

/// Returns the table colours to mix for `rgb`, from dark to light. Their mean approximates `rgb`.
fn mixture(rgb: [u8; 3]) -> [u8; MIXED] {
    let target = linear(rgb);
    let mut missing = [0.0f32; 3];
    let mut mixed = [0; MIXED];
    for index in &mut mixed {
        let goal = [0, 1, 2].map(|c| code(target[c] + STRENGTH * missing[c]));
        *index = palette256::nearest(goal);
        let chosen = linear(palette256::rgb(*index));
        (0..3).for_each(|c| missing[c] += target[c] - chosen[c]);
    }
    mixed.sort_by(|a, b| palette256::lightness(*a).total_cmp(&palette256::lightness(*b)));
    mixed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terminal::cells::Oklab;

    /// Checks that the mean over the pattern is closer to the target than the nearest single table
    /// colour.
    #[test]
    fn dithered_mean_is_closer_than_nearest_color() {
        let (mut plain, mut mixed) = (0.0, 0.0);
        for step in 0..64u8 {
            let rgb = [40 + 3 * step, 90 + step, 200 - 2 * step];
            let target = Oklab::of(rgb);
            let raster = Raster::from_fn(8, 8, |_| rgb);
            let mut mean = [0.0f32; 3];
            for index in dithered(&raster) {
                let color = linear(palette256::rgb(index));
                (0..3).for_each(|c| mean[c] += color[c] / 64.0);
            }
            mixed += Oklab::of_linear(mean).distance(target);
            plain += Oklab::of(palette256::rgb(palette256::nearest(rgb))).distance(target);
        }
        assert!(mixed < 0.6 * plain, "{mixed} after {plain}");
    }

    #[test]
    fn table_colors_are_not_dithered() {
        for index in 16..=255 {
            assert_eq!(mixture(palette256::rgb(index)), [index; MIXED]);
        }
    }
}
