//! Conversion of images to terminal cells: pixels of half a cell in, glyphs and colours out.
//!
//! A cell is about twice as high as it is wide, so each shows two square pixels, one above the other.
//! The module is independent of scenes and of the screen's layout.

mod dither;
mod false_color;
mod mosaic;
mod oklab;
mod palette16;
mod palette256;
mod palette_cache;

pub use false_color::{Scale, depth, difference, magnitude, normals, object_color, objects};
pub use mosaic::blocks;
pub use oklab::Oklab;
pub(crate) use oklab::{code, linear};
pub use palette256::nearest as nearest_indexed;

/// Colours of a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Colors {
    /// 24-bit sRGB.
    True,
    /// The 256-colour table of xterm.
    Indexed,
    /// The 16 ANSI colours.
    Sixteen,
    /// No colours.
    Mono,
}

impl Colors {
    /// All variants, in the order in which the colour key cycles through them.
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

/// An image of square pixels, two to a cell.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Raster {
    /// Pixels in a row, one to a cell.
    pub width: usize,
    /// Rows of pixels, two to a row of cells.
    pub height: usize,
    /// sRGB, `[row][column]`, `width * height` of them.
    pub pixels: Vec<[u8; 3]>,
}

impl Raster {
    /// Creates an image of `width` x `height` pixels. `pixel(index)` returns them row by row.
    pub fn from_fn(width: usize, height: usize, pixel: impl FnMut(usize) -> [u8; 3]) -> Self {
        Self { width, height, pixels: (0..width * height).map(pixel).collect() }
    }

    fn at(&self, x: usize, y: usize) -> Option<[u8; 3]> {
        (x < self.width && y < self.height).then(|| self.pixels[y * self.width + x])
    }
}

/// Foreground or background colour of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum CellColor {
    /// Default colour of the terminal.
    #[default]
    Plain,
    /// 24-bit sRGB.
    Rgb([u8; 3]),
    /// Index into the terminal's table of 256.
    Indexed(u8),
}

/// Cell of the picture: glyph and colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PictureCell {
    /// One column wide.
    pub glyph: char,
    /// Colour of the glyph.
    pub fg: CellColor,
    /// Colour behind it.
    pub bg: CellColor,
}

impl PictureCell {
    /// Returns the colours of the upper and the lower half in a dark terminal with xterm's colours.
    pub fn halves(&self) -> [Oklab; 2] {
        let rgb = |color, plain| match color {
            CellColor::Plain => plain,
            CellColor::Rgb(rgb) => rgb,
            CellColor::Indexed(index) => palette256::rgb(index),
        };
        let (fg, bg) = (rgb(self.fg, PLAIN_FG), rgb(self.bg, PLAIN_BG));
        match self.glyph {
            '▀' => [Oklab::of(fg), Oklab::of(bg)],
            '▄' => [Oklab::of(bg), Oklab::of(fg)],
            glyph => [palette16::mixture(fg, bg, palette16::coverage(glyph)); 2],
        }
    }
}

impl PictureCell {
    /// Returns the colours of the upper and the lower half, if both are 24-bit colours.
    pub fn colors(&self) -> Option<[[u8; 3]; 2]> {
        let halves = match self.glyph {
            '▀' => [self.fg, self.bg],
            '▄' => [self.bg, self.fg],
            ' ' => [self.bg; 2],
            '█' => [self.fg; 2],
            _ => return None,
        };
        match halves {
            [CellColor::Rgb(upper), CellColor::Rgb(lower)] => Some([upper, lower]),
            _ => None,
        }
    }
}

impl Default for PictureCell {
    fn default() -> Self {
        Self { glyph: ' ', fg: CellColor::Plain, bg: CellColor::Plain }
    }
}

/// Assumed default foreground and background of a terminal, sRGB.
const PLAIN_FG: [u8; 3] = [229; 3];
const PLAIN_BG: [u8; 3] = [0; 3];

/// Image as terminal cells.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct PictureCells {
    /// Cells in a row.
    pub columns: u16,
    /// Rows of cells.
    pub rows: u16,
    /// `[row][column]`, `columns * rows` of them.
    pub cells: Vec<PictureCell>,
}

impl PictureCells {
    /// Converts `raster` for a terminal with `colors`. `settled` is `true` if the picture will not change
    /// soon; it is then dithered in 256 colours. Dithering would make a changing picture flicker.
    ///
    /// The last row of cells is half empty if the raster has an odd number of rows.
    pub fn new(raster: &Raster, colors: Colors, settled: bool) -> Self {
        let cell = |upper: Option<[u8; 3]>, lower: Option<[u8; 3]>| match (upper, lower) {
            (Some(upper), Some(lower)) => pair(upper, lower, colors),
            (Some(upper), None) => half('▀', upper, colors),
            (None, Some(lower)) => half('▄', lower, colors),
            (None, None) => PictureCell::default(),
        };
        let dithered = (settled && colors == Colors::Indexed).then(|| dither::dithered(raster));
        let rows = raster.height.div_ceil(2);
        let mut cells = Vec::with_capacity(raster.width * rows);
        for y in 0..rows {
            for x in 0..raster.width {
                let (upper, lower) = (raster.at(x, 2 * y), raster.at(x, 2 * y + 1));
                cells.push(match &dithered {
                    None => cell(upper, lower),
                    Some(indices) => {
                        let index = |y: usize| indices[y * raster.width + x];
                        two_halves(
                            CellColor::Indexed(index(2 * y)),
                            lower.map(|_| CellColor::Indexed(index(2 * y + 1))),
                        )
                    }
                });
            }
        }
        Self { columns: raster.width as u16, rows: rows as u16, cells }
    }

    /// Returns the cell at `column` and `row`; `None` outside the image.
    pub fn cell(&self, column: u16, row: u16) -> Option<&PictureCell> {
        let inside = column < self.columns && row < self.rows;
        inside.then(|| {
            &self.cells[usize::from(row) * usize::from(self.columns) + usize::from(column)]
        })
    }
}

/// Creates a cell of two halves; `lower` is `None` below the last row of pixels. Equal halves need no
/// glyph.
fn two_halves(upper: CellColor, lower: Option<CellColor>) -> PictureCell {
    match lower {
        Some(lower) if lower == upper => {
            PictureCell { glyph: ' ', fg: CellColor::Plain, bg: upper }
        }
        Some(lower) => PictureCell { glyph: '▀', fg: upper, bg: lower },
        None => PictureCell { glyph: '▀', fg: upper, bg: CellColor::Plain },
    }
}

fn pair(upper: [u8; 3], lower: [u8; 3], colors: Colors) -> PictureCell {
    match colors {
        Colors::True => two_halves(CellColor::Rgb(upper), Some(CellColor::Rgb(lower))),
        Colors::Indexed => {
            let index = |rgb| CellColor::Indexed(palette256::nearest(rgb));
            two_halves(index(upper), Some(index(lower)))
        }
        Colors::Sixteen => palette16::pair(upper, lower),
        Colors::Mono => palette16::pair_mono(upper, lower),
    }
}

fn half(glyph: char, rgb: [u8; 3], colors: Colors) -> PictureCell {
    let fg = match colors {
        Colors::True => CellColor::Rgb(rgb),
        Colors::Indexed => CellColor::Indexed(palette256::nearest(rgb)),
        Colors::Sixteen => CellColor::Indexed(palette16::nearest(rgb)),
        Colors::Mono if Oklab::of(rgb).l < 0.5 => return PictureCell::default(),
        Colors::Mono => CellColor::Plain,
    };
    PictureCell { glyph, fg, bg: CellColor::Plain }
}

#[cfg(test)]
mod tests;
