//! Palette quantisation: a cached search for the palette colour nearest to a given colour in OKLab,
//! and xterm's table of 256 colours. The table has 16 colours that users configure, a cube of 216
//! colours, and 24 greys.

use crate::cells::oklab::Oklab;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU16, Ordering};

/// Number of bits per channel to which colours are rounded before the search for the nearest
/// palette colour. Rounding to 6 bits changes a channel by at most 3 of 255 levels.
const BITS: usize = 6;

/// Palette of colours with a search for the nearest one in OKLab. A cache stores the result for
/// each sRGB colour, rounded to 6 bits per channel.
pub struct QuantisedPalette {
    /// Colours of the palette.
    pub colors: Vec<Oklab>,
    /// Index plus 1 of the nearest palette colour, for each of the 2^18 rounded sRGB colours. A 0
    /// means that the nearest palette colour has not been searched yet.
    known: Vec<AtomicU16>,
}

impl QuantisedPalette {
    /// Creates a palette of `colors`, of which there must be 1 to 65,535.
    pub fn new(colors: Vec<Oklab>) -> Self {
        Self { colors, known: (0..1 << (3 * BITS)).map(|_| AtomicU16::new(0)).collect() }
    }

    /// Returns the index of the palette colour nearest to the 8-bit sRGB colour `rgb`, which is
    /// rounded to 6 bits per channel.
    pub fn nearest(&self, rgb: [u8; 3]) -> usize {
        let coarse = rgb.map(|c| usize::from(c) >> (8 - BITS));
        let known = &self.known[(coarse[0] << (2 * BITS)) | (coarse[1] << BITS) | coarse[2]];
        // Two threads may search the same rounded colour at the same time. Both store the same
        // index.
        match known.load(Ordering::Relaxed) {
            0 => {
                // Each channel has 64 rounded levels. They are spread over 0..=255, so that black
                // and white are exact.
                let index = self.search(Oklab::of(coarse.map(|c| ((c * 255 + 31) / 63) as u8)));
                known.store(index as u16 + 1, Ordering::Relaxed);
                index
            }
            stored => usize::from(stored) - 1,
        }
    }

    /// Returns the index of the palette colour nearest to `target`, without rounding and without
    /// the cache.
    pub fn search(&self, target: Oklab) -> usize {
        let distances = self.colors.iter().map(|look| target.distance_squared(*look));
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
    }
}

/// 8-bit sRGB levels along each edge of xterm's cube of 6 x 6 x 6 colours.
const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
/// First index of xterm's colour cube. The 16 colours before it are never chosen, because users
/// configure them.
const FIRST: u8 = 16;
/// First index of xterm's 24 greys.
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

/// Returns the 8-bit sRGB of colour `index` of xterm's 256 colours.
pub fn xterm_rgb(index: u8) -> [u8; 3] {
    match index {
        ..FIRST => ANSI[usize::from(index)],
        GREYS.. => [8 + 10 * (index - GREYS); 3],
        _ => {
            let i = index - FIRST;
            [i / 36, i / 6 % 6, i % 6].map(|step| LEVELS[usize::from(step)])
        }
    }
}

/// Palette of the xterm colours that pictures use: the colour cube and the greys. Entry 0 of this
/// palette is the colour with index [`FIRST`] in xterm's table.
static XTERM: LazyLock<QuantisedPalette> = LazyLock::new(|| {
    QuantisedPalette::new((FIRST..=255).map(|index| Oklab::of(xterm_rgb(index))).collect())
});

/// Returns the index, 16..=255, of xterm's colour nearest in OKLab to the 8-bit sRGB colour `rgb`.
/// `rgb` is first rounded to 6 bits per channel, which changes a channel by at most 3 of 255
/// levels. The returned colour is therefore almost as near as the nearest one.
pub fn nearest_xterm(rgb: [u8; 3]) -> u8 {
    FIRST + XTERM.nearest(rgb) as u8
}

/// Returns the OKLab lightness, 0..=1, of colour `index` (16 to 255) of xterm's 256 colours.
pub fn xterm_lightness(index: u8) -> f32 {
    XTERM.colors[usize::from(index.saturating_sub(FIRST))].l
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_matches_xterm() {
        assert_eq!(xterm_rgb(16), [0, 0, 0]);
        assert_eq!(xterm_rgb(21), [0, 0, 255]);
        assert_eq!(xterm_rgb(67), [95, 135, 175]);
        assert_eq!(xterm_rgb(231), [255, 255, 255]);
        assert_eq!(xterm_rgb(232), [8, 8, 8]);
        assert_eq!(xterm_rgb(255), [238, 238, 238]);
    }

    #[test]
    fn table_colors_are_their_own_nearest() {
        for index in FIRST..=255 {
            assert_eq!(nearest_xterm(xterm_rgb(index)), index);
        }
    }

    /// Checks the cached search for the nearest palette colour, which rounds colours, against the
    /// search without rounding. The found colour may be farther away than the nearest one by less
    /// than 0.02 in OKLab, a difference that is hardly visible.
    #[test]
    fn nearest_color_matches_exact_search() {
        let mut exact_hits = 0;
        let mut state = 1u32;
        for _ in 0..4000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let [r, g, b, _] = state.to_be_bytes();
            let target = Oklab::of([r, g, b]);
            let [found, best] = [nearest_xterm([r, g, b]), FIRST + XTERM.search(target) as u8];
            let distance = |index| Oklab::of(xterm_rgb(index)).distance(target);
            assert!(distance(found) < distance(best) + 0.02, "{:?}", [r, g, b]);
            exact_hits += u32::from(found == best);
        }
        assert!(exact_hits > 3600, "{exact_hits} of 4000");
    }
}
