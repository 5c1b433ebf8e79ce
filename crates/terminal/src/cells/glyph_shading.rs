//! Conversion of pictures to cells with shading glyphs, in 16 colours or without colours.

use crate::cells::oklab::{Oklab, level, linear};
use crate::cells::palette_quantisation::{QuantisedPalette, xterm_rgb};
use crate::cells::{PLAIN_BG, PLAIN_FG, PictureCell, Raster};
use ratatui::style::Color;
use std::sync::LazyLock;

/// Glyphs with the share of the cell that they cover. The shares of ░▒▓ are nominal; the other
/// shares were measured in DejaVu Sans Mono.
const COVERAGE: [(char, f32); 9] = [
    (' ', 0.0),
    ('.', 0.025),
    (':', 0.05),
    ('+', 0.11),
    ('%', 0.18),
    ('░', 0.25),
    ('▒', 0.5),
    ('▓', 0.75),
    ('█', 1.0),
];
/// Glyphs for mixtures of two colours.
const SHADES: [char; 3] = ['░', '▒', '▓'];
/// Backgrounds of mixtures: ANSI colours from black to white, which leave the hue unchanged.
const NEUTRAL: [u8; 4] = [0, 7, 8, 15];
/// Least fall of the OKLab errors, summed over both halves of a cell, for which a half block is
/// preferred to a shading glyph. With 0, a cell of a changing picture would flicker between the
/// two.
const HALVES_GAIN: f32 = 0.05;

/// Returns the share of the cell that `glyph` covers, 0..=1. It is 0.5 for glyphs that are not in
/// [`COVERAGE`], such as half blocks.
pub fn coverage(glyph: char) -> f32 {
    COVERAGE.iter().find(|(known, _)| *known == glyph).map_or(0.5, |(_, part)| *part)
}

/// Returns the mean colour of a cell of which `fg` covers the share `coverage`.
pub fn mixture(fg: [u8; 3], bg: [u8; 3], coverage: f32) -> Oklab {
    let (fg, bg) = (linear(fg), linear(bg));
    Oklab::of_linear([0, 1, 2].map(|c| coverage * fg[c] + (1.0 - coverage) * bg[c]))
}

/// Light grey, whose sparse glyphs on black show the greys that are darker than all shades.
const GREY: u8 = 7;
/// Mean OKLab lightness to which [`tone_curve`] raises dark pictures.
const MEAN_LIGHTNESS: f32 = 0.5;

/// Returns the curve of levels that shows a picture without colours: a power of the linear light,
/// which makes a dark picture brighter, because glyphs show few dark greys.
pub fn tone_curve(raster: &Raster) -> [u8; 256] {
    let sum: f32 = raster.pixels.iter().map(|rgb| Oklab::of(*rgb).l).sum();
    let mean = (sum / raster.pixels.len().max(1) as f32).clamp(0.01, 0.99);
    let power = (MEAN_LIGHTNESS.ln() / mean.ln()).clamp(0.5, 1.0);
    std::array::from_fn(|c| level(linear([c as u8; 3])[0].powf(power)))
}

/// Cells for colours: each of 16 colours alone, each shading glyph on a neutral background, and
/// sparse glyphs in grey on black.
static CELLS: LazyLock<Vec<PictureCell>> = LazyLock::new(|| {
    let mixed = NEUTRAL.into_iter().flat_map(|bg| (0..16).map(move |fg| (fg, bg)));
    let mixed = mixed.filter(|(fg, bg)| fg != bg).flat_map(|(fg, bg)| {
        SHADES.map(|glyph| PictureCell { glyph, fg: Color::Indexed(fg), bg: Color::Indexed(bg) })
    });
    let sparse = COVERAGE[1..3].iter().map(|(glyph, _)| PictureCell {
        glyph: *glyph,
        fg: Color::Indexed(GREY),
        bg: Color::Indexed(0),
    });
    (0..16).map(flat).chain(mixed).chain(sparse).collect()
});

/// Mean colours of [`CELLS`], in the same order.
static SHADED: LazyLock<QuantisedPalette> =
    LazyLock::new(|| QuantisedPalette::new(CELLS.iter().map(|cell| cell.quarters()[0]).collect()));

/// The 16 ANSI colours.
static BARE: LazyLock<QuantisedPalette> = LazyLock::new(|| {
    QuantisedPalette::new((0..16).map(|index| Oklab::of(xterm_rgb(index))).collect())
});

fn flat(index: u8) -> PictureCell {
    PictureCell { glyph: ' ', fg: Color::Reset, bg: Color::Indexed(index) }
}

/// Returns the index of the nearest ANSI colour.
pub fn nearest(rgb: [u8; 3]) -> u8 {
    BARE.nearest(rgb) as u8
}

/// Returns the cell in 16 colours that approximates the colours `upper` and `lower` of its halves.
pub fn pair(upper: [u8; 3], lower: [u8; 3]) -> PictureCell {
    let target = [upper, lower].map(Oklab::of);
    let [a, b] = [upper, lower].map(linear);
    let shade = SHADED.nearest([0, 1, 2].map(|c| level(0.5 * (a[c] + b[c]))));
    // The halves differ too little for a half block.
    if target[0].distance(target[1]) < HALVES_GAIN {
        return CELLS[shade];
    }
    let [top, bottom] = [upper, lower].map(nearest);
    let error = |halves: [Oklab; 2]| target[0].distance(halves[0]) + target[1].distance(halves[1]);
    let halves_error = error([top, bottom].map(|index| BARE.colors[usize::from(index)]));
    if top != bottom && halves_error + HALVES_GAIN < error([SHADED.colors[shade]; 2]) {
        return PictureCell { glyph: '▀', fg: Color::Indexed(top), bg: Color::Indexed(bottom) };
    }
    CELLS[shade]
}

/// Returns the cell without colours that approximates the lightness of `upper` and `lower`.
pub fn pair_mono(upper: [u8; 3], lower: [u8; 3]) -> PictureCell {
    static LIGHTNESS: LazyLock<Vec<(char, f32)>> = LazyLock::new(|| {
        COVERAGE.map(|(glyph, part)| (glyph, mixture(PLAIN_FG, PLAIN_BG, part).l)).to_vec()
    });
    let [top, bottom] = [upper, lower].map(|rgb| Oklab::of(rgb).l);
    let target = mixture(upper, lower, 0.5).l;
    let (glyph, lightness) = LIGHTNESS
        .iter()
        .min_by(|a, b| (a.1 - target).abs().total_cmp(&(b.1 - target).abs()))
        .copied()
        .unwrap_or((' ', 0.0));
    let shade_error = (top - lightness).abs() + (bottom - lightness).abs();
    let white = LIGHTNESS.last().map_or(1.0, |(_, l)| *l);
    let halves = |glyph, light: f32, dark: f32| {
        let error = (light - white).abs() + dark;
        (error + HALVES_GAIN < shade_error).then_some(glyph)
    };
    let glyph = if top > bottom { halves('▀', top, bottom) } else { halves('▄', bottom, top) }
        .unwrap_or(glyph);
    PictureCell { glyph, fg: Color::Reset, bg: Color::Reset }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mono_glyph_density_rises_with_lightness() {
        let mut last = 0.0;
        for level in 0..=255u8 {
            let cell = pair_mono([level; 3], [level; 3]);
            assert_eq!((cell.fg, cell.bg), (Color::Reset, Color::Reset));
            assert!(coverage(cell.glyph) >= last, "{level}: {}", cell.glyph);
            last = coverage(cell.glyph);
        }
        assert_eq!(last, 1.0);
        assert_eq!(pair_mono([0; 3], [0; 3]).glyph, ' ');
        // An edge between the halves of a cell gives a half block.
        assert_eq!(pair_mono([255; 3], [0; 3]).glyph, '▀');
        assert_eq!(pair_mono([0; 3], [255; 3]).glyph, '▄');
    }

    #[test]
    fn sixteen_colors_keep_hues_and_edges() {
        let flat = |rgb| pair(rgb, rgb);
        assert_eq!(flat([255, 0, 0]), super::flat(9));
        assert_eq!(flat([0, 0, 0]), super::flat(0));
        // Dark red is a shade of red on black; light red is a shade of red on white.
        for (rgb, neutral) in [([110, 0, 0], 0), ([255, 150, 140], 15)] {
            let PictureCell { glyph, fg: Color::Indexed(fg), bg: Color::Indexed(bg) } = flat(rgb)
            else {
                panic!("{rgb:?}");
            };
            assert!(SHADES.contains(&glyph) && [1, 9].contains(&fg), "{rgb:?} {fg}");
            assert!(bg == neutral || bg == 7, "{rgb:?} {bg}");
        }
        let edge = pair([255, 255, 255], [0, 0, 238]);
        assert_eq!(edge, PictureCell { glyph: '▀', fg: Color::Indexed(15), bg: Color::Indexed(4) });
    }

    #[test]
    fn shades_are_closer_than_sixteen_colors_alone() {
        let (mut bare, mut shaded) = (0.0, 0.0);
        for i in 0..512usize {
            let rgb = [i / 64, i / 8 % 8, i % 8].map(|c| (c * 36) as u8);
            let target = Oklab::of(rgb);
            bare += Oklab::of(xterm_rgb(nearest(rgb))).distance(target);
            shaded += pair(rgb, rgb).quarters()[0].distance(target);
        }
        assert!(shaded < 0.6 * bare, "{shaded} of {bare}");
    }
}
