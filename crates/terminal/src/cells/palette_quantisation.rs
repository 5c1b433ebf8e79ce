//! Palette quantisation: a cached search for the nearest palette colour in OKLab, and xterm's table
//! of 256 colours. The table has 16 colours that users configure, a cube of 216 colours, and 24
//! greys.

use crate::cells::oklab::Oklab;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU16, Ordering};

/// Bits per channel to which colours are rounded before the search. This changes a channel by at
/// most 3 of 255 levels.
const BITS: usize = 6;

/// Palette with a cached search for the nearest colour.
pub struct QuantisedPalette {
    pub colors: Vec<Oklab>,
    /// Index plus 1 of the nearest colour of each of the 2^18 rounded sRGB colours; 0 before the
    /// search.
    known: Vec<AtomicU16>,
}

impl QuantisedPalette {
    /// Creates a palette of 1 to 65,535 colours.
    pub fn new(colors: Vec<Oklab>) -> Self {
        Self { colors, known: (0..1 << (3 * BITS)).map(|_| AtomicU16::new(0)).collect() }
    }

    /// Returns the index of the palette colour that is nearest to `rgb` after rounding.
    pub fn nearest(&self, rgb: [u8; 3]) -> usize {
        let coarse = rgb.map(|c| usize::from(c) >> (8 - BITS));
        let known = &self.known[(coarse[0] << (2 * BITS)) | (coarse[1] << BITS) | coarse[2]];
        // Relaxed suffices: threads that race for a colour store the same index.
        match known.load(Ordering::Relaxed) {
            0 => {
                // The 64 levels are spread over 0..=255, so that black and white are exact.
                let index = self.search(Oklab::of(coarse.map(|c| ((c * 255 + 31) / 63) as u8)));
                known.store(index as u16 + 1, Ordering::Relaxed);
                index
            }
            stored => usize::from(stored) - 1,
        }
    }

    /// Returns the index of the palette colour that is nearest to `target`, without rounding.
    pub fn search(&self, target: Oklab) -> usize {
        let distances = self.colors.iter().map(|color| target.distance_squared(*color));
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
    }
}

/// Levels along each edge of xterm's cube of 6 x 6 x 6 colours.
const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
/// First index of the cube. Pictures do not use the 16 colours before it.
const FIRST: u8 = 16;
/// First index of the greys.
const GREYS: u8 = 232;

/// Default values of the 16 ANSI colours in xterm, as `0xrrggbb`.
const ANSI: [u32; 16] = [
    0x000000, 0xcd0000, 0x00cd00, 0xcdcd00, 0x0000ee, 0xcd00cd, 0x00cdcd, 0xe5e5e5, 0x7f7f7f,
    0xff0000, 0x00ff00, 0xffff00, 0x5c5cff, 0xff00ff, 0x00ffff, 0xffffff,
];

pub fn xterm_rgb(index: u8) -> [u8; 3] {
    match index {
        ..FIRST => {
            let [_, rgb @ ..] = ANSI[usize::from(index)].to_be_bytes();
            rgb
        }
        GREYS.. => [8 + 10 * (index - GREYS); 3],
        _ => {
            let i = index - FIRST;
            [i / 36, i / 6 % 6, i % 6].map(|step| LEVELS[usize::from(step)])
        }
    }
}

/// Colours of xterm's table from [`FIRST`] on.
static XTERM: LazyLock<QuantisedPalette> = LazyLock::new(|| {
    QuantisedPalette::new((FIRST..=255).map(|index| Oklab::of(xterm_rgb(index))).collect())
});

/// Returns the index, 16..=255, of xterm's colour that is nearest to the 8-bit sRGB colour `rgb`
/// after rounding.
pub fn nearest_xterm(rgb: [u8; 3]) -> u8 {
    FIRST + XTERM.nearest(rgb) as u8
}

/// Luma up to which [`vivid`] is strongest, and luma from which it keeps colours.
const DARK: [f32; 2] = [85.0, 141.0];
/// Difference of the largest and the smallest channel, likewise.
const WEAK: [f32; 2] = [64.0, 112.0];
/// Largest factor by which [`vivid`] raises the saturation.
const VIVIDNESS: f32 = 2.3;

/// Raises the saturation of dark weak colours. Dark colours of palettes are grey or saturated, so that
/// the nearest one of a weak colour has no hue.
pub fn vivid(rgb: [u8; 3]) -> [u8; 3] {
    let channels = rgb.map(f32::from);
    // Luma weights of Rec. 709.
    let luma = 0.2126 * channels[0] + 0.7152 * channels[1] + 0.0722 * channels[2];
    let range =
        channels.into_iter().fold(0.0, f32::max) - channels.into_iter().fold(255.0, f32::min);
    let below = |[low, high]: [f32; 2], x: f32| ((high - x) / (high - low)).clamp(0.0, 1.0);
    let factor = 1.0 + (VIVIDNESS - 1.0) * below(DARK, luma) * below(WEAK, range);
    channels.map(|c| (luma + factor * (c - luma)).round().clamp(0.0, 255.0) as u8)
}

/// Returns the OKLab lightness, 0..=1, of xterm's colour `index` (16 to 255).
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

    #[test]
    fn dark_hues_are_kept_before_greys() {
        // Frame, floor and ball of the opening scene, in the shade.
        type IsHue = fn([u8; 3]) -> bool;
        let cases: [([u8; 3], IsHue); 3] = [
            ([84, 54, 26], |[r, g, b]| r > g && g >= b),
            ([96, 72, 50], |[r, g, b]| r >= g && g > b),
            ([80, 28, 30], |[r, g, b]| r > g && g == b),
        ];
        for (rgb, is_hue) in cases {
            let shown = xterm_rgb(nearest_xterm(vivid(rgb)));
            assert!(is_hue(shown), "{rgb:?} {shown:?}");
        }
        assert_eq!([vivid([90; 3]), vivid([200, 180, 190])], [[90; 3], [200, 180, 190]]);
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
