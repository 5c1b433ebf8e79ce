//! Images, encoded by kitty's protocol, by sixel, or as half blocks.
//!
//! An image is sent in slices within the byte budget of a frame, because a transfer can take
//! seconds and a key must take effect in tenths of a second. Widgets of other crates send it as a
//! whole.

mod kitty;
mod panel;
mod sixel;
mod tile;
mod transfer;

use crate::cells::Raster;
use crate::{Capabilities, Multiplexer};
pub use panel::GraphicsMode;
use ratatui::layout::Rect;
pub use tile::TileImage;
pub use transfer::Transfer;

/// Largest width and height of a sixel image if the terminal reports no limit: the limit of xterm.
const SIXEL_PX: usize = 1000;
/// Assumed width and height of a cell in pixels, if the terminal does not report them.
const CELL_PX: [u16; 2] = [8, 16];
/// Estimated bytes per pixel of an encoded image, by which it is scaled down to its byte limit.
const BYTES_PER_PIXEL: f64 = 1.6;

/// Protocol by which images are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    Kitty,
    /// Kitty's graphics protocol with Unicode placeholders, through tmux.
    KittyThroughTmux,
    /// Sixel with this number of colours.
    Sixel(u16),
    /// Half blocks, without an image protocol.
    Blocks,
}

/// Terminal for which an image is encoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageViewport {
    pub protocol: Protocol,
    /// Columns and rows of the screen; the last row shows a caption.
    pub screen: [u16; 2],
    /// Width and height of a cell in pixels, if known.
    pub cell_px: Option<[u16; 2]>,
    /// Largest width and height of a sixel image in pixels, if known.
    pub sixel_px: Option<[u16; 2]>,
    /// Approximate largest number of bytes of the encoded image. A larger image is scaled down.
    pub max_bytes: Option<f64>,
}

/// Size and place of an image in an [`ImageViewport`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageLayout {
    /// Width and height of the image in the file, in pixels.
    pub size: [usize; 2],
    /// Width and height of the displayed image in pixels, at most `size`.
    pub shown: [usize; 2],
    /// Columns and half rows of the preview in half blocks. The preview fills only cells that the
    /// image covers fully, so that no part of the preview shows beside the image.
    pub halves: [usize; 2],
    /// Cells that the image covers, at least in part.
    pub place: Rect,
}

/// Image encoded for an [`ImageViewport`].
#[derive(Clone, Debug, PartialEq)]
pub struct ViewerImage {
    /// Columns and rows of the screen.
    pub screen: [u16; 2],
    pub protocol: Protocol,
    pub layout: ImageLayout,
    /// Half blocks that show the image.
    pub raster: Raster,
    /// Bytes that show the image by the protocol.
    pub transfer: Transfer,
}

impl Protocol {
    /// Returns the best protocol that the terminal supports.
    pub fn of(terminal: &Capabilities) -> Self {
        match terminal.environment.multiplexer {
            None if terminal.kitty_graphics => Self::Kitty,
            Some(Multiplexer::Tmux) if terminal.kitty_graphics && terminal.placeholders => {
                Self::KittyThroughTmux
            }
            // A tmux that reports support of sixel shows sixel images itself.
            _ if terminal.sixel && terminal.cell_px.is_some() => {
                Self::Sixel(terminal.sixel_colors.unwrap_or(256).clamp(2, 256))
            }
            _ => Self::Blocks,
        }
    }

    /// Returns the name for users.
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
    /// Returns width and height of a cell in pixels; with [`Protocol::Blocks`], in half blocks.
    fn cell(&self) -> [usize; 2] {
        match self.protocol {
            Protocol::Blocks => [1, 2],
            _ => self.cell_px.unwrap_or(CELL_PX).map(|px| usize::from(px.max(1))),
        }
    }

    /// Returns the largest width and height of an image in pixels.
    fn largest(&self) -> [usize; 2] {
        let cell = self.cell();
        let rows = match self.protocol {
            Protocol::KittyThroughTmux => (self.screen[1] - 1).min(kitty::MAX_ROWS),
            _ => self.screen[1] - 1,
        };
        let largest = [usize::from(self.screen[0]) * cell[0], usize::from(rows) * cell[1]];
        match self.protocol {
            Protocol::Sixel(_) => {
                let limit = self.sixel_px.map_or([SIXEL_PX; 2], |px| px.map(usize::from));
                [0, 1].map(|i| largest[i].min(limit[i]))
            }
            _ => largest,
        }
    }

    /// Returns size and place of an image of `size` (width, height) pixels.
    ///
    /// # Errors
    /// Fails if the image is empty or the screen is too small.
    pub fn layout(&self, size: [usize; 2]) -> Result<ImageLayout, String> {
        if size.contains(&0) || self.screen[1] < 2 {
            return Err("the screen is too small for a picture".to_string());
        }
        let (cell, shown) = (self.cell(), self.fitting(size));
        let [width, height] = [0, 1].map(|i| shown[i].div_ceil(cell[i]) as u16);
        let x = self.screen[0].saturating_sub(width) / 2;
        let y = (self.screen[1] - 1).saturating_sub(height) / 2;
        let halves = match self.protocol {
            Protocol::Blocks => shown,
            _ => {
                // Half blocks at the edges would remain visible beside the image.
                let covered = [0, 1].map(|i| (shown[i] / cell[i]).max(1));
                [covered[0].min(shown[0]), (2 * covered[1]).min(shown[1])]
            }
        };
        Ok(ImageLayout { size, shown, halves, place: Rect { x, y, width, height } })
    }

    /// Returns the displayed size of an image, which is never enlarged.
    fn fitting(&self, size: [usize; 2]) -> [usize; 2] {
        let largest = self.largest();
        let [width, height] = size.map(|n| n as f64);
        let mut scale = f64::min(largest[0] as f64 / width, largest[1] as f64 / height).min(1.0);
        if let (Some(bytes), true) = (self.max_bytes, self.protocol != Protocol::Blocks) {
            scale = scale.min((bytes / (BYTES_PER_PIXEL * width * height)).sqrt());
        }
        [0, 1].map(|i| ((size[i] as f64 * scale).round() as usize).clamp(1, largest[i].max(1)))
    }
}

impl ViewerImage {
    /// Encodes an image. `image` has the size `layout.shown`, and `raster` the size
    /// `layout.halves`. `png` encodes `image` as a PNG file, if the protocol sends one.
    ///
    /// # Errors
    /// Fails if the image cannot be encoded.
    pub fn encode(
        viewport: &ImageViewport,
        layout: ImageLayout,
        image: &Raster,
        raster: Raster,
        png: impl FnOnce(&Raster) -> Result<Vec<u8>, String>,
    ) -> Result<Self, String> {
        let ImageViewport { protocol, screen, cell_px, .. } = *viewport;
        let transfer = match protocol {
            Protocol::Blocks => Transfer::default(),
            Protocol::Sixel(colors) => {
                sixel::transfer(image, layout.place, viewport.cell()[1], colors)?
            }
            Protocol::Kitty | Protocol::KittyThroughTmux => {
                let through_tmux = protocol == Protocol::KittyThroughTmux;
                kitty::transfer(&png(image)?, layout.place, cell_px.is_none(), through_tmux)
            }
        };
        Ok(Self { screen, protocol, layout, raster, transfer })
    }

    /// Returns placeholder character and index of its foreground colour for the cells in row `row`
    /// of the image; `None` if the protocol uses none.
    pub fn placeholder(&self, row: u16) -> Option<(String, u8)> {
        let has_placeholders = self.protocol == Protocol::KittyThroughTmux;
        has_placeholders.then(|| (kitty::placeholder(row, None), kitty::IMAGE))
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
        max_bytes: None,
    };

    #[test]
    fn image_keeps_its_aspect_and_is_not_enlarged() {
        let blocks = ImageViewport { protocol: Protocol::Blocks, ..WINDOW };
        let sixel = ImageViewport { protocol: Protocol::Sixel(256), screen: [200, 31], ..WINDOW };
        let slow = ImageViewport { max_bytes: Some(1.6e4), ..WINDOW };
        for (viewport, size, expected) in [
            (WINDOW, [640, 480], [640, 480]),
            (WINDOW, [2000, 1000], [1000, 500]),
            (WINDOW, [100, 1200], [50, 600]),
            (WINDOW, [1, 1], [1, 1]),
            (WINDOW, [100_000, 1], [1000, 1]),
            (blocks, [640, 480], [80, 60]),
            (sixel, [4000, 1000], [1000, 250]),
            (slow, [400, 100], [200, 50]),
        ] {
            assert_eq!(viewport.fitting(size), expected, "{viewport:?} {size:?}");
        }
    }

    #[test]
    fn image_is_centred_above_the_last_row() {
        for protocol in
            [Protocol::Kitty, Protocol::KittyThroughTmux, Protocol::Sixel(16), Protocol::Blocks]
        {
            for size in [[64, 48], [1100, 300], [1, 700], [999, 2]] {
                let viewport = ImageViewport { protocol, ..WINDOW };
                let layout = viewport.layout(size).unwrap();
                let plain =
                    |[width, height]: [usize; 2]| Raster::from_fn(width, height, |_| [9; 3]);
                let (image, raster) = (plain(layout.shown), plain(layout.halves));
                let png = |image: &Raster| Ok(vec![0; image.pixels.len()]);
                let image = ViewerImage::encode(&viewport, layout, &image, raster, png).unwrap();
                let Rect { x, y, width, height } = layout.place;
                assert!(x + width <= 100 && y + height <= 30, "{:?}", layout.place);
                assert!((100 - width).abs_diff(2 * x) <= 1 && (30 - height).abs_diff(2 * y) <= 1);
                assert!(image.raster.width <= width.into());
                assert!(image.raster.height <= 2 * usize::from(height));
                assert_eq!(image.transfer.bytes.is_empty(), protocol == Protocol::Blocks);
            }
        }
        assert!(WINDOW.layout([0, 5]).is_err());
    }
}
