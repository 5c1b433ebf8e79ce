//! A picture that was written, to be looked at without leaving the program: crisp where the terminal
//! has a protocol for pictures, in half blocks elsewhere.
//!
//! The protocols are spoken here rather than by a widget, because a picture goes out in slices that
//! the line has room for: it takes seconds where a key must take effect in tenths of one.

mod kitty;
mod shrink;
mod sixel;
mod transfer;

use crate::film::{Display, png_of_rgb, read_exr, read_png};
use crate::terminal::Area;
use crate::terminal::cells::Raster;
use crate::terminal::{Capabilities, Multiplexer};
use shrink::shrunk;
use std::path::Path;
pub use transfer::Transfer;

/// The most pixels in a row and rows of a sixel picture if the terminal does not tell: xterm's.
const SIXEL_PX: usize = 1000;
/// The size of a cell in pixels if the terminal does not tell.
const CELL_PX: [u16; 2] = [8, 16];
/// The bytes that a pixel takes, more or less.
const BYTES_PER_PIXEL: f64 = 1.6;

/// How a picture can be shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// Kitty's, straight to the terminal.
    Kitty,
    /// Kitty's, to the terminal behind tmux, with placeholders among the text.
    KittyThroughTmux,
    /// Sixel, with so many colours.
    Sixel(u16),
    /// None: half blocks.
    Blocks,
}

/// Where a picture is to be shown, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageViewport {
    /// How.
    pub protocol: Protocol,
    /// Columns and rows of the screen, the last of which tells what is seen.
    pub screen: [u16; 2],
    /// Width and height of a cell in pixels.
    pub cell_px: Option<[u16; 2]>,
    /// The most pixels of sixel in both directions, if the terminal tells.
    pub sixel_px: Option<[u16; 2]>,
    /// More bytes than about so many take too long.
    pub most_bytes: Option<f64>,
}

/// A picture that is ready to be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewerImage {
    /// Columns and rows of the screen that it was made for.
    pub screen: [u16; 2],
    /// Width and height of the picture in the file.
    pub size: [usize; 2],
    /// The same as it is shown.
    pub shown: [usize; 2],
    /// How.
    pub protocol: Protocol,
    /// The cells that it covers.
    pub place: Area,
    /// It in half blocks, on those of the cells that the crisp one covers whole.
    pub raster: Raster,
    /// What shows it crisply; empty: nothing does.
    pub transfer: Transfer,
}

impl Protocol {
    /// What the terminal has.
    pub fn of(terminal: &Capabilities) -> Self {
        match terminal.environment.multiplexer {
            None if terminal.kitty_graphics => Self::Kitty,
            Some(Multiplexer::Tmux) if terminal.kitty_graphics && terminal.placeholders => {
                Self::KittyThroughTmux
            }
            // A tmux that says so shows them itself.
            _ if terminal.sixel && terminal.cell_px.is_some() => {
                Self::Sixel(terminal.sixel_colors.unwrap_or(256).clamp(2, 256))
            }
            _ => Self::Blocks,
        }
    }

    /// For the user.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kitty => "kitty's protocol",
            Self::KittyThroughTmux => "kitty's protocol, through tmux",
            Self::Sixel(_) => "sixel",
            Self::Blocks => "half blocks",
        }
    }
}

impl ImageViewport {
    /// The same in pixels, and how many of them a cell is; what pictures are made of as blocks counts
    /// as square.
    fn px(&self) -> ([usize; 2], [usize; 2]) {
        let cell = match self.protocol {
            Protocol::Blocks => [1, 2],
            _ => self.cell_px.unwrap_or(CELL_PX).map(|px| usize::from(px.max(1))),
        };
        let rows = match self.protocol {
            Protocol::KittyThroughTmux => (self.screen[1] - 1).min(kitty::most_rows()),
            _ => self.screen[1] - 1,
        };
        let mut most = [usize::from(self.screen[0]) * cell[0], usize::from(rows) * cell[1]];
        if let Protocol::Sixel(_) = self.protocol {
            let limit = self.sixel_px.map_or([SIXEL_PX; 2], |px| px.map(usize::from));
            most = [0, 1].map(|i| most[i].min(limit[i]));
        }
        (most, cell)
    }

    /// How large a picture of this `size` is shown: never larger than it is.
    fn fitting(&self, size: [usize; 2]) -> [usize; 2] {
        let (most, _) = self.px();
        let [width, height] = size.map(|n| n as f64);
        let mut scale = f64::min(most[0] as f64 / width, most[1] as f64 / height).min(1.0);
        if let (Some(bytes), true) = (self.most_bytes, self.protocol != Protocol::Blocks) {
            scale = scale.min((bytes / (BYTES_PER_PIXEL * width * height)).sqrt());
        }
        [0, 1].map(|i| ((size[i] as f64 * scale).round() as usize).clamp(1, most[i].max(1)))
    }
}

impl ViewerImage {
    /// Reads the picture at `path`, shown as `display` says if it is linear light, and makes it ready
    /// for `window`.
    ///
    /// # Errors
    /// Why it cannot be read or shown.
    pub fn read(path: &Path, display: &Display, window: &ImageViewport) -> Result<Self, String> {
        let (size, pixels) = if path.extension().is_some_and(|e| e == "exr") {
            let picture = read_exr(path)?;
            (picture.size, picture.pixels.iter().copied().map(display.to_8()).collect())
        } else {
            read_png(path)?
        };
        Self::of(size, &pixels, window)
    }

    /// The same for a picture of this `size`, row by row.
    fn of(size: [usize; 2], pixels: &[[u8; 3]], window: &ImageViewport) -> Result<Self, String> {
        if size.contains(&0) || window.screen[1] < 2 {
            return Err("there is nothing to see".to_string());
        }
        let (_, cell) = window.px();
        let shown = window.fitting(size);
        let small = shrunk(pixels, size, shown);
        let [width, height] = [0, 1].map(|i| shown[i].div_ceil(cell[i]) as u16);
        let x = window.screen[0].saturating_sub(width) / 2;
        let y = (window.screen[1] - 1).saturating_sub(height) / 2;
        let place = Area { x, y, width, height };
        let transfer = match window.protocol {
            Protocol::Blocks => Transfer::default(),
            Protocol::Sixel(colors) => sixel::transfer(&small, shown[0], place, cell[1], colors)?,
            Protocol::Kitty | Protocol::KittyThroughTmux => {
                let size = shown.map(|n| n as u32);
                let png = png_of_rgb(size, small.as_flattened()).map_err(|e| e.to_string())?;
                let through_tmux = window.protocol == Protocol::KittyThroughTmux;
                kitty::transfer(&png, place, window.cell_px.is_none(), through_tmux)
            }
        };
        let raster = match window.protocol {
            Protocol::Blocks => Raster { width: shown[0], height: shown[1], pixels: small },
            _ => {
                // Not on cells that the crisp one covers in part: it would look out from behind.
                let covered = [0, 1].map(|i| (shown[i] / cell[i]).max(1));
                let halves = [covered[0].min(shown[0]), (2 * covered[1]).min(shown[1])];
                let pixels = shrunk(&small, shown, halves);
                Raster { width: halves[0], height: halves[1], pixels }
            }
        };
        let ImageViewport { protocol, screen, .. } = *window;
        Ok(Self { screen, size, shown, protocol, place, raster, transfer })
    }

    /// What stands in the cells of a row of the place when all of the transfer has come, and the number
    /// of their colour; `None`: the picture lies over them.
    pub fn placeholder(&self, row: u16) -> Option<(String, u8)> {
        let among_text = self.protocol == Protocol::KittyThroughTmux;
        among_text.then(|| (kitty::placeholder(row), kitty::IMAGE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: ImageViewport = ImageViewport {
        protocol: Protocol::Kitty,
        screen: [100, 31],
        cell_px: Some([10, 20]),
        sixel_px: None,
        most_bytes: None,
    };

    #[test]
    fn pictures_keep_their_shape_and_are_not_enlarged() {
        let blocks = ImageViewport { protocol: Protocol::Blocks, ..WINDOW };
        let sixel = ImageViewport { protocol: Protocol::Sixel(256), screen: [200, 31], ..WINDOW };
        let slow = ImageViewport { most_bytes: Some(1.6e4), ..WINDOW };
        for (window, size, expected) in [
            (WINDOW, [640, 480], [640, 480]),
            (WINDOW, [2000, 1000], [1000, 500]),
            (WINDOW, [100, 1200], [50, 600]),
            (WINDOW, [1, 1], [1, 1]),
            (WINDOW, [100_000, 1], [1000, 1]),
            (blocks, [640, 480], [80, 60]),
            (sixel, [4000, 1000], [1000, 250]),
            (slow, [400, 100], [200, 50]),
        ] {
            assert_eq!(window.fitting(size), expected, "{window:?} {size:?}");
        }
    }

    #[test]
    fn it_stands_in_the_middle_above_the_last_row() {
        for protocol in
            [Protocol::Kitty, Protocol::KittyThroughTmux, Protocol::Sixel(16), Protocol::Blocks]
        {
            for size in [[64, 48], [3000, 2000], [1, 700], [999, 2]] {
                let window = ImageViewport { protocol, ..WINDOW };
                let pixels = vec![[9, 8, 7]; size[0] * size[1]];
                let still = ViewerImage::of(size, &pixels, &window).unwrap();
                let Area { x, y, width, height } = still.place;
                assert!(x + width <= 100 && y + height <= 30, "{:?}", still.place);
                assert!((100 - width).abs_diff(2 * x) <= 1 && (30 - height).abs_diff(2 * y) <= 1);
                assert!(still.raster.width <= width.into());
                assert!(still.raster.height <= 2 * usize::from(height));
                assert_eq!(still.transfer.bytes.is_empty(), protocol == Protocol::Blocks);
                assert!(still.raster.pixels.iter().all(|p| *p == [9, 8, 7]));
            }
        }
        assert!(ViewerImage::of([0, 5], &[], &WINDOW).is_err());
    }
}
