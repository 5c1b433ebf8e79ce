//! Images for the viewer of exported pictures. An image is read from its file and encoded for the
//! terminal by kitty's protocol, by sixel, or as half blocks.
//!
//! An image is sent in slices within the byte budget of a frame, because a transfer can take
//! seconds and a key must take effect in tenths of a second. Existing widgets for images send an
//! image as a whole and are therefore not used.

mod kitty;
mod shrink;
mod sixel;
mod transfer;

use crate::cells::Raster;
use crate::{Capabilities, Multiplexer};
use ratatui::layout::Rect;
use shrink::shrunk;
use std::path::Path;
pub use transfer::Transfer;
use zerkalo_render::film::{Display, png_of_rgb, read_exr, read_png};

/// Largest width and height of a sixel image in pixels if the terminal reports no limit: the limit
/// of xterm.
const SIXEL_PX: usize = 1000;
/// Assumed width and height of a cell in pixels if the terminal does not report them.
const CELL_PX: [u16; 2] = [8, 16];
/// Estimated number of bytes per pixel of an encoded image. It determines how far an image is
/// scaled down before it is encoded, so that the encoded image does not exceed its byte limit.
const BYTES_PER_PIXEL: f64 = 1.6;

/// Protocol by which images are shown in the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// Kitty's graphics protocol, without a multiplexer.
    Kitty,
    /// Kitty's graphics protocol with Unicode placeholders, sent through tmux to the terminal
    /// outside of it.
    KittyThroughTmux,
    /// Sixel images with this number of colours.
    Sixel(u16),
    /// Half blocks in place of an image protocol.
    Blocks,
}

/// Viewport of an image: size of the terminal and protocol for which the image is encoded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageViewport {
    /// Image protocol, or half blocks.
    pub protocol: Protocol,
    /// Columns and rows of the screen. The last row shows the image's caption.
    pub screen: [u16; 2],
    /// Width and height of a terminal cell in pixels. `None` if the terminal does not report them.
    pub cell_px: Option<[u16; 2]>,
    /// Largest width and height of a sixel image in pixels. `None` if the terminal reports no
    /// limit.
    pub sixel_px: Option<[u16; 2]>,
    /// Approximate largest number of bytes of the encoded image. The limit is chosen so that the
    /// image is sent in a few seconds. A larger image is scaled down. `None` means no limit.
    pub max_bytes: Option<f64>,
}

/// Image that was scaled and encoded for the screen of an [`ImageViewport`].
#[derive(Clone, Debug, PartialEq)]
pub struct ViewerImage {
    /// Columns and rows of the screen for which the image was scaled and encoded.
    pub screen: [u16; 2],
    /// Width and height of the image in the file, in pixels.
    pub size: [usize; 2],
    /// Width and height of the displayed image, in pixels.
    pub shown: [usize; 2],
    /// Protocol by which the image is shown.
    pub protocol: Protocol,
    /// Cells that the image covers, fully or in part.
    pub place: Rect,
    /// Half blocks that show the image. If the image is also shown by an image protocol, the half
    /// blocks fill only the cells that the image covers fully.
    pub raster: Raster,
    /// Bytes that show the image by the protocol. Empty for [`Protocol::Blocks`].
    pub transfer: Transfer,
}

impl Protocol {
    /// Returns the best image protocol that the terminal supports, or half blocks if there is none.
    pub fn of(terminal: &Capabilities) -> Self {
        match terminal.environment.multiplexer {
            None if terminal.kitty_graphics => Self::Kitty,
            Some(Multiplexer::Tmux) if terminal.kitty_graphics && terminal.placeholders => {
                Self::KittyThroughTmux
            }
            // This case includes tmux, because a tmux that reports support of sixel shows sixel
            // images itself.
            _ if terminal.sixel && terminal.cell_px.is_some() => {
                Self::Sixel(terminal.sixel_colors.unwrap_or(256).clamp(2, 256))
            }
            _ => Self::Blocks,
        }
    }

    /// Returns the name of the protocol for display to users.
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
    /// Returns two sizes in pixels as `[width, height]`: first the largest size of an image on the
    /// screen, then the size of a cell. If the image is shown by half blocks, a pixel is half of a
    /// cell.
    fn px(&self) -> ([usize; 2], [usize; 2]) {
        let cell = match self.protocol {
            Protocol::Blocks => [1, 2],
            _ => self.cell_px.unwrap_or(CELL_PX).map(|px| usize::from(px.max(1))),
        };
        let rows = match self.protocol {
            Protocol::KittyThroughTmux => (self.screen[1] - 1).min(kitty::MAX_ROWS),
            _ => self.screen[1] - 1,
        };
        let mut largest = [usize::from(self.screen[0]) * cell[0], usize::from(rows) * cell[1]];
        if let Protocol::Sixel(_) = self.protocol {
            let limit = self.sixel_px.map_or([SIXEL_PX; 2], |px| px.map(usize::from));
            largest = [0, 1].map(|i| largest[i].min(limit[i]));
        }
        (largest, cell)
    }

    /// Returns the displayed size in pixels of an image of `size` pixels, scaled down to fit on the
    /// screen. Images are never enlarged.
    fn fitting(&self, size: [usize; 2]) -> [usize; 2] {
        let (largest, _) = self.px();
        let [width, height] = size.map(|n| n as f64);
        let mut scale = f64::min(largest[0] as f64 / width, largest[1] as f64 / height).min(1.0);
        if let (Some(bytes), true) = (self.max_bytes, self.protocol != Protocol::Blocks) {
            scale = scale.min((bytes / (BYTES_PER_PIXEL * width * height)).sqrt());
        }
        [0, 1].map(|i| ((size[i] as f64 * scale).round() as usize).clamp(1, largest[i].max(1)))
    }
}

impl ViewerImage {
    /// Reads the image at `path`, then scales and encodes it for `viewport`. `display` converts the
    /// linear light of an EXR file to 8-bit levels.
    ///
    /// # Errors
    /// Fails if the file cannot be read or the screen is too small.
    pub fn read(path: &Path, display: &Display, viewport: &ImageViewport) -> Result<Self, String> {
        let (size, pixels) = if path.extension().is_some_and(|e| e == "exr") {
            let picture = read_exr(path)?;
            (picture.size, picture.pixels.iter().copied().map(display.to_8()).collect())
        } else {
            read_png(path)?
        };
        Self::of(size, &pixels, viewport)
    }

    /// Scales and encodes an image of `size` (width, height) pixels for `viewport`. `pixels` are
    /// row by row.
    fn of(size: [usize; 2], pixels: &[[u8; 3]], viewport: &ImageViewport) -> Result<Self, String> {
        if size.contains(&0) || viewport.screen[1] < 2 {
            return Err("the screen is too small for a picture".to_string());
        }
        let (_, cell) = viewport.px();
        let shown = viewport.fitting(size);
        let small = shrunk(pixels, size, shown);
        let [width, height] = [0, 1].map(|i| shown[i].div_ceil(cell[i]) as u16);
        let x = viewport.screen[0].saturating_sub(width) / 2;
        let y = (viewport.screen[1] - 1).saturating_sub(height) / 2;
        let place = Rect { x, y, width, height };
        let transfer = match viewport.protocol {
            Protocol::Blocks => Transfer::default(),
            Protocol::Sixel(colors) => sixel::transfer(&small, shown[0], place, cell[1], colors)?,
            Protocol::Kitty | Protocol::KittyThroughTmux => {
                let size = shown.map(|n| n as u32);
                let png = png_of_rgb(size, small.as_flattened()).map_err(|e| e.to_string())?;
                let through_tmux = viewport.protocol == Protocol::KittyThroughTmux;
                kitty::transfer(&png, place, viewport.cell_px.is_none(), through_tmux)
            }
        };
        let raster = match viewport.protocol {
            Protocol::Blocks => Raster { width: shown[0], height: shown[1], pixels: small },
            _ => {
                // Half blocks fill only cells that the image will cover completely. In cells at the
                // edges of the image they would remain visible beside the image.
                let covered = [0, 1].map(|i| (shown[i] / cell[i]).max(1));
                let halves = [covered[0].min(shown[0]), (2 * covered[1]).min(shown[1])];
                let pixels = shrunk(&small, shown, halves);
                Raster { width: halves[0], height: halves[1], pixels }
            }
        };
        let ImageViewport { protocol, screen, .. } = *viewport;
        Ok(Self { screen, size, shown, protocol, place, raster, transfer })
    }

    /// Returns `(text, color)` for each cell in row `row` of `place`. `text` is a placeholder
    /// character with a mark, and `color` is the index of its foreground colour. The terminal shows
    /// the image, which was sent before, in place of such cells. Returns `None` if the protocol
    /// shows the image without placeholders.
    pub fn placeholder(&self, row: u16) -> Option<(String, u8)> {
        let has_placeholders = self.protocol == Protocol::KittyThroughTmux;
        has_placeholders.then(|| (kitty::placeholder(row), kitty::IMAGE))
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
                let pixels = vec![[9, 8, 7]; size[0] * size[1]];
                let image = ViewerImage::of(size, &pixels, &viewport).unwrap();
                let Rect { x, y, width, height } = image.place;
                assert!(x + width <= 100 && y + height <= 30, "{:?}", image.place);
                assert!((100 - width).abs_diff(2 * x) <= 1 && (30 - height).abs_diff(2 * y) <= 1);
                assert!(image.raster.width <= width.into());
                assert!(image.raster.height <= 2 * usize::from(height));
                assert_eq!(image.transfer.bytes.is_empty(), protocol == Protocol::Blocks);
                assert!(image.raster.pixels.iter().all(|p| *p == [9, 8, 7]));
            }
        }
        assert!(ViewerImage::of([0, 5], &[], &WINDOW).is_err());
    }
}
