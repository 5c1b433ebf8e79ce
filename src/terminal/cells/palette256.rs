//! The 256-colour table of xterm: 16 colours that users configure, a colour cube of 216, and 24
//! greys.

use crate::terminal::cells::oklab::Oklab;
use crate::terminal::cells::palette_cache::PaletteCache;
use std::sync::LazyLock;

/// 8-bit sRGB levels along each edge of the colour cube.
const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
/// First index of the colour cube. The 16 colours before it are never used, because users configure
/// them.
const FIRST: u8 = 16;
/// First index of the greys.
const GREYS: u8 = 232;

/// Default values of the 16 ANSI colours in xterm, 8-bit sRGB.
const ANSI: [[u8; 3]; 16] = [
    [0, 0, 0],
    [205, 0, 0],
    [0, 205, 0],
    [205, 205, 0],
    [0, 0, 238],
    [205, 0, 205],
    [0, 205, 205],
    [229, 229, 229],
    [127, 127, 127],
    [255, 0, 0],
    [0, 255, 0],
    [255, 255, 0],
    [92, 92, 255],
    [255, 0, 255],
    [0, 255, 255],
    [255, 255, 255],
];

/// Returns the 8-bit sRGB of table colour `index`.
pub fn rgb(index: u8) -> [u8; 3] {
    match index {
        ..FIRST => ANSI[usize::from(index)],
        GREYS.. => [8 + 10 * (index - GREYS); 3],
        _ => {
            let i = index - FIRST;
            [i / 36, i / 6 % 6, i % 6].map(|step| LEVELS[usize::from(step)])
        }
    }
}

/// Palette of the usable colours: the cube and the greys, from index [`FIRST`] on.
static CHOICES: LazyLock<PaletteCache> =
    LazyLock::new(|| PaletteCache::new((FIRST..=255).map(|index| Oklab::of(rgb(index))).collect()));

/// Returns the index of the colour nearest to `rgb` among the cube and the greys. `rgb` is first
/// rounded to 6 bits per channel; the resulting error is small, because neighbours in the table
/// differ by at least 10 of 255 levels.
pub fn nearest(rgb: [u8; 3]) -> u8 {
    FIRST + CHOICES.nearest(rgb) as u8
}

/// Returns the OKLab lightness, 0..=1, of a colour of the cube or a grey.
pub fn lightness(index: u8) -> f32 {
    CHOICES.color(usize::from(index.saturating_sub(FIRST))).l
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_matches_xterm() {
        assert_eq!(rgb(16), [0, 0, 0]);
        assert_eq!(rgb(21), [0, 0, 255]);
        assert_eq!(rgb(67), [95, 135, 175]);
        assert_eq!(rgb(231), [255, 255, 255]);
        assert_eq!(rgb(232), [8, 8, 8]);
        assert_eq!(rgb(255), [238, 238, 238]);
    }

    #[test]
    fn table_colors_are_their_own_nearest() {
        for index in FIRST..=255 {
            assert_eq!(nearest(rgb(index)), index);
        }
    }

    /// Compares results of the cache with results of a search at full precision.
    #[test]
    fn nearest_color_matches_exact_search() {
        let mut exact_hits = 0;
        let mut state = 1u32;
        for _ in 0..4000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let [r, g, b, _] = state.to_be_bytes();
            let target = Oklab::of([r, g, b]);
            let [found, best] = [nearest([r, g, b]), FIRST + CHOICES.search(target) as u8];
            let distance = |index| Oklab::of(rgb(index)).distance(target);
            assert!(distance(found) < distance(best) + 0.02, "{:?}", [r, g, b]);
            exact_hits += u32::from(found == best);
        }
        assert!(exact_hits > 3600, "{exact_hits} of 4000");
    }
}
