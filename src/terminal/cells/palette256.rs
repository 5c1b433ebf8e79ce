//! The 256 colours of xterm: 16 that users choose, a cube of 216, 24 greys.

use crate::terminal::cells::oklab::Oklab;
use crate::terminal::cells::palette_cache::PaletteCache;
use std::sync::LazyLock;

/// Codes along each edge of the cube.
const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
/// Where the cube begins: the colours before it look different from user to user.
const FIRST: u8 = 16;
/// Where the greys begin.
const GREYS: u8 = 232;

/// The 16 colours of xterm, which other terminals vary.
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

/// sRGB of a colour of the table.
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

/// The colours from [`FIRST`] on.
static CHOICES: LazyLock<PaletteCache> =
    LazyLock::new(|| PaletteCache::new((FIRST..=255).map(|index| Oklab::of(rgb(index))).collect()));

/// The colour of cube and greys that looks most like `rgb`, which is taken to 6 bits a channel. (Two
/// neighbours in the table are 10 codes and more apart.)
pub fn nearest(rgb: [u8; 3]) -> u8 {
    FIRST + CHOICES.nearest(rgb) as u8
}

/// How light a colour of cube or greys looks, 0..=1.
pub fn lightness(index: u8) -> f32 {
    CHOICES.look(usize::from(index.saturating_sub(FIRST))).l
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_xterms() {
        assert_eq!(rgb(16), [0, 0, 0]);
        assert_eq!(rgb(21), [0, 0, 255]);
        assert_eq!(rgb(67), [95, 135, 175]);
        assert_eq!(rgb(231), [255, 255, 255]);
        assert_eq!(rgb(232), [8, 8, 8]);
        assert_eq!(rgb(255), [238, 238, 238]);
    }

    #[test]
    fn colours_of_the_table_are_their_own_nearest() {
        for index in FIRST..=255 {
            assert_eq!(nearest(rgb(index)), index);
        }
    }

    /// Against the whole table at full precision: never visibly worse.
    #[test]
    fn the_nearest_is_near() {
        let mut exact_hits = 0;
        let mut state = 1u32;
        for _ in 0..4000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let [r, g, b, _] = state.to_be_bytes();
            let wanted = Oklab::of([r, g, b]);
            let [found, best] = [nearest([r, g, b]), FIRST + CHOICES.search(wanted) as u8];
            let distance = |index| Oklab::of(rgb(index)).distance(wanted);
            assert!(distance(found) < distance(best) + 0.02, "{:?}", [r, g, b]);
            exact_hits += u32::from(found == best);
        }
        assert!(exact_hits > 3600, "{exact_hits} of 4000");
    }
}
