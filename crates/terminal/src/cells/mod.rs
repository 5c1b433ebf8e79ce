//! Conversion of images to terminal cells. A cell is about twice as high as it is wide, and shows
//! two square pixels, one above the other.

mod dither;
mod glyph_shading;
mod mosaic;
mod oklab;
mod palette_quantisation;

pub(crate) use mosaic::shape;
pub use mosaic::{Blocks, mosaic_cells};
pub use oklab::{Oklab, level, linear};
pub use palette_quantisation::nearest_xterm;
use palette_quantisation::{vivid, xterm_rgb};
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;

/// Set of colours that a terminal shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Colors {
    /// 24-bit sRGB.
    #[default]
    True,
    /// The 256 colours of xterm's table.
    Indexed,
    /// The 16 ANSI colours, which users configure.
    Sixteen,
    /// No colours: glyphs alone make the picture.
    Mono,
}

impl Colors {
    /// All sets of colours, in the order in which a user cycles through them.
    pub const ALL: [Self; 4] = [Self::True, Self::Indexed, Self::Sixteen, Self::Mono];

    /// Returns the name for users.
    pub fn name(self) -> &'static str {
        match self {
            Self::True => "24-bit colour",
            Self::Indexed => "256 colours",
            Self::Sixteen => "16 colours",
            Self::Mono => "no colour",
        }
    }
}

/// Image in the pixels of cells. In half blocks they are squares, and a cell shows two of them, one
/// above the other.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Raster {
    pub width: usize,
    pub height: usize,
    /// Pixels in 8-bit sRGB, row by row.
    pub pixels: Vec<[u8; 3]>,
}

impl Raster {
    /// Creates an image. `pixel` returns the colour of each pixel, which are numbered row by row.
    pub fn from_fn(width: usize, height: usize, pixel: impl FnMut(usize) -> [u8; 3]) -> Self {
        Self { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    /// Returns the negative, which a terminal without colours and with a light background shows as
    /// a positive.
    pub fn negative(&self) -> Self {
        let shown = glyph_shading::tone_curve(self);
        let pixel = |i: usize| self.pixels[i].map(|c| 255 - shown[usize::from(c)]);
        Self::from_fn(self.width, self.height, pixel)
    }
}

/// Terminal cell of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PictureCell {
    /// Character, one column wide.
    pub glyph: char,
    /// Colour of the glyph: the terminal's default, 24-bit or indexed.
    pub fg: Color,
    /// Colour behind the glyph: the terminal's default, 24-bit or indexed.
    pub bg: Color,
}

impl PictureCell {
    /// Returns the mean linear light of the upper left, upper right, lower left and lower right
    /// quarter. Default colours are those of a dark terminal; indexed colours are xterm's.
    pub fn light(&self) -> [[f32; 3]; 4] {
        let rgb = |color, plain| match color {
            Color::Rgb(r, g, b) => [r, g, b],
            Color::Indexed(index) => xterm_rgb(index),
            _ => plain,
        };
        let (fg, bg) = (linear(rgb(self.fg, PLAIN_FG)), linear(rgb(self.bg, PLAIN_BG)));
        let coverage = || [glyph_shading::coverage(self.glyph); 4];
        let shares = mosaic::shape(self.glyph).map_or_else(coverage, |shape| shape.quarters);
        shares.map(|share| [0, 1, 2].map(|c| share * fg[c] + (1.0 - share) * bg[c]))
    }

    /// Returns the mean colours of the quarters.
    pub fn quarters(&self) -> [Oklab; 4] {
        let [upper, right, lower, last] = self.light();
        let both = |left, right| match left == right {
            true => [Oklab::of_linear(left); 2],
            false => [left, right].map(Oklab::of_linear),
        };
        let [[a, b], [c, d]] = [both(upper, right), both(lower, last)];
        [a, b, c, d]
    }

    /// Returns `true` if all visible colours are 24-bit.
    pub fn is_24_bit(&self) -> bool {
        let is_rgb = |color| matches!(color, Color::Rgb(..));
        is_rgb(self.bg) && (self.glyph == ' ' || is_rgb(self.fg))
    }
}

impl Default for PictureCell {
    fn default() -> Self {
        Self { glyph: ' ', fg: Color::Reset, bg: Color::Reset }
    }
}

/// Assumed default foreground of a terminal, 8-bit sRGB.
const PLAIN_FG: [u8; 3] = [229; 3];
/// Assumed default background of a terminal, 8-bit sRGB.
const PLAIN_BG: [u8; 3] = [0; 3];

impl From<&Cell> for PictureCell {
    fn from(cell: &Cell) -> Self {
        let glyph = cell.symbol().chars().next().unwrap_or(' ');
        Self { glyph, fg: cell.fg, bg: cell.bg }
    }
}

/// Converts `raster` to cells of a terminal with `colors`. In 256 colours, the picture is dithered
/// only if it is `settled`, because a changing picture would flicker.
///
/// If the raster has an odd number of rows, the lower halves of the last row of cells are empty, or
/// continue the upper halves in cells with shading glyphs. With few colours, dark colours become
/// more saturated, and without colours, a dark picture becomes brighter: distinct surfaces stay
/// distinct.
pub fn picture_cells(raster: &Raster, colors: Colors, settled: bool) -> Buffer {
    let dithered = (settled && colors == Colors::Indexed).then(|| dither::dithered(raster));
    let curve = (colors == Colors::Mono).then(|| glyph_shading::tone_curve(raster));
    let rgb = |pixel: usize| match (&curve, colors) {
        (Some(curve), _) => raster.pixels[pixel].map(|c| curve[usize::from(c)]),
        (None, Colors::True) => raster.pixels[pixel],
        (None, _) => vivid(raster.pixels[pixel]),
    };
    let color = |pixel: usize| match &dithered {
        Some(indices) => Color::Indexed(indices[pixel]),
        None if colors == Colors::True => Color::from(rgb(pixel)),
        None => Color::Indexed(nearest_xterm(rgb(pixel))),
    };
    let cell = |index: usize| {
        let upper = index / raster.width * 2 * raster.width + index % raster.width;
        let lower = Some(upper + raster.width).filter(|pixel| *pixel < raster.pixels.len());
        match (colors, lower) {
            (Colors::True | Colors::Indexed, _) => two_halves(color(upper), lower.map(color)),
            (Colors::Sixteen, lower) => {
                glyph_shading::pair(rgb(upper), rgb(lower.unwrap_or(upper)))
            }
            (Colors::Mono, lower) => {
                glyph_shading::pair_mono(rgb(upper), rgb(lower.unwrap_or(upper)))
            }
        }
    };
    let area = Rect::new(0, 0, raster.width as u16, raster.height.div_ceil(2) as u16);
    let content = (0..area.area() as usize).map(|index| {
        let PictureCell { glyph, fg, bg } = cell(index);
        let mut out = UPPER_HALF;
        if glyph != '▀' {
            out.set_char(glyph);
        }
        out.set_fg(fg).set_bg(bg);
        out
    });
    Buffer { area, content: content.collect() }
}

/// Upper half block. Cells are copies of it, because setting a glyph takes several times as long.
const UPPER_HALF: Cell = Cell::new("▀");

/// Creates a cell from the colours of its halves. `lower` is `None` below the last row of pixels.
fn two_halves(upper: Color, lower: Option<Color>) -> PictureCell {
    match lower {
        Some(lower) if lower == upper => PictureCell { glyph: ' ', fg: Color::Reset, bg: upper },
        Some(lower) => PictureCell { glyph: '▀', fg: upper, bg: lower },
        None => PictureCell { glyph: '▀', fg: upper, bg: Color::Reset },
    }
}

#[cfg(test)]
mod tests;
