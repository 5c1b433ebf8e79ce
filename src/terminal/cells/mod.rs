//! Conversion of images to terminal cells, that is, to glyphs with colours. A pixel is half a cell.
//!
//! A cell is about twice as high as it is wide. Each cell therefore shows two square pixels, one
//! above the other. The module is independent of scenes and of the screen's layout.

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

/// Set of colours that a terminal can show.
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

    /// Returns the name that users see.
    pub fn name(self) -> &'static str {
        match self {
            Self::True => "24-bit colour",
            Self::Indexed => "256 colours",
            Self::Sixteen => "16 colours",
            Self::Mono => "no colour",
        }
    }
}

/// An image of square pixels. A cell shows two pixels, one above the other.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct Raster {
    /// Number of pixels in a row: one per cell.
    pub width: usize,
    /// Number of rows of pixels: two per row of cells.
    pub height: usize,
    /// `width * height` pixels in 8-bit sRGB, row by row.
    pub pixels: Vec<[u8; 3]>,
}

impl Raster {
    /// Creates an image of `width` x `height` pixels. `pixel(index)` returns the colour of the
    /// pixel with an index; pixels are numbered row by row.
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
    /// Index into the terminal's table of 256 colours.
    Indexed(u8),
}

/// Terminal cell of the picture: its glyph and its colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PictureCell {
    /// Character of the cell, one column wide.
    pub glyph: char,
    /// Colour of the glyph.
    pub fg: CellColor,
    /// Colour behind the glyph.
    pub bg: CellColor,
}

impl PictureCell {
    /// Returns the mean colours of the upper and the lower half of the cell, as shown by a terminal
    /// with a dark background and xterm's colours.
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
    /// Returns the 24-bit colours of the upper and the lower half. Returns `None` if a half has
    /// several colours, or one that is not 24-bit.
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

/// Assumed default foreground of a terminal, 8-bit sRGB.
const PLAIN_FG: [u8; 3] = [229; 3];
/// Assumed default background of a terminal, 8-bit sRGB.
const PLAIN_BG: [u8; 3] = [0; 3];

/// Image converted to terminal cells.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct PictureCells {
    /// Number of cells in a row.
    pub columns: u16,
    /// Number of rows of cells.
    pub rows: u16,
    /// `columns * rows` cells, row by row.
    pub cells: Vec<PictureCell>,
}

impl PictureCells {
    /// Converts `raster` for a terminal with `colors`. `settled` is `true` if the picture will not
    /// change soon. In 256 colours a settled picture is dithered. A changing picture is not,
    /// because dithering would make it flicker.
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

    /// Returns the cell at `column` and `row`. Returns `None` outside the image.
    pub fn cell(&self, column: u16, row: u16) -> Option<&PictureCell> {
        let inside = column < self.columns && row < self.rows;
        inside.then(|| {
            &self.cells[usize::from(row) * usize::from(self.columns) + usize::from(column)]
        })
    }
}

/// Creates a cell from the colours of its upper and lower half. `lower` is `None` below the last
/// row of pixels. The glyph of equal halves is a space.
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
