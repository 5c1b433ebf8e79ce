//! Tiles of a picture in a panel, each an image of its own.

use super::{Protocol, kitty, sixel};
use crate::cells::Raster;
use crate::image::transfer::Transfer;
use crossterm::cursor::MoveTo;
use ratatui::buffer::Cell;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};

/// Largest side of a tile in pixels.
const SIDE_PX: usize = 64;
/// Number of the first image of a tile, beyond that of the viewer.
const FIRST: u32 = 1000;
/// Removal of all images on the screen.
const REMOVE_ALL: &str = "\x1b_Ga=d,d=A,q=2\x1b\\";
/// Largest number of tiles through tmux, where placeholders encode the number of an image, below
/// 256, as an indexed colour. Each tile has two numbers.
const MOST_THROUGH_TMUX: usize = 127;

/// Tile of a picture, whose images have alternating numbers, so that a new image is complete before
/// it replaces the old one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TileImage {
    pub protocol: Protocol,
    /// Number of the tile in its picture.
    pub index: usize,
    /// `true` for the second of the two numbers.
    pub second: bool,
    /// Cells that the tile covers, at least in part.
    pub place: Rect,
}

impl TileImage {
    /// Returns columns and rows of cells of a tile of a picture that covers `cells` cells of
    /// `cell_px` pixels. By sixel, tiles are as wide as the picture: xterm keeps few images, and
    /// forgets the oldest first.
    pub fn cells(protocol: Protocol, cells: [u16; 2], cell_px: [usize; 2]) -> [u16; 2] {
        if let Protocol::Sixel(_) = protocol {
            return [cells[0].max(1), cells[1].div_ceil(sixel::MAX_STRIPS).max(1)];
        }
        let mut side = cell_px.map(|px| (SIDE_PX / px.max(1)).max(1) as u16);
        let count = |side: [u16; 2]| {
            [0, 1].map(|i| usize::from(cells[i].div_ceil(side[i]))).iter().product::<usize>()
        };
        while protocol == Protocol::KittyThroughTmux && count(side) > MOST_THROUGH_TMUX {
            side = side.map(|n| n + 1);
        }
        side
    }

    fn number(&self) -> u32 {
        let first = if self.protocol == Protocol::KittyThroughTmux { 1 } else { FIRST };
        first + 2 * self.index as u32 + u32::from(self.second)
    }

    /// Encodes the image of the tile. `png` encodes a PNG file.
    ///
    /// # Errors
    /// Fails if the image cannot be encoded.
    pub fn encode(
        &self,
        image: &Raster,
        png: impl FnOnce(&Raster) -> Result<Vec<u8>, String>,
    ) -> Result<Transfer, String> {
        let Rect { x, y, width, height } = self.place;
        let mut transfer = Transfer::default();
        let number = self.number();
        match self.protocol {
            Protocol::Blocks => {}
            Protocol::Sixel(colors) => {
                transfer.is_divisible = true;
                let bytes = sixel::encoded(&image.pixels, image.width, [x, y], colors)?;
                transfer.add(bytes.as_bytes());
            }
            Protocol::Kitty => {
                // The image is above the text: with images below it, kitty 0.26 draws new text over
                // the old.
                let keys = format!("i={number},p=1,C=1");
                kitty::send(&mut transfer, &png(image)?, &keys, &MoveTo(x, y).to_string(), false);
                let old = Self { second: !self.second, ..*self };
                transfer.add(old.removal().as_bytes());
            }
            Protocol::KittyThroughTmux => {
                let keys = format!("i={number},U=1,c={width},r={height}");
                kitty::send(&mut transfer, &png(image)?, &keys, "", true);
            }
        }
        Ok(transfer)
    }

    /// Returns the sequence that removes the image, except by sixel, where text overwrites it.
    pub fn removal(&self) -> String {
        match self.protocol {
            Protocol::Kitty => kitty::removal(self.number()),
            Protocol::KittyThroughTmux => kitty::wrapped(&kitty::removal(self.number())),
            Protocol::Sixel(_) | Protocol::Blocks => String::new(),
        }
    }

    /// Returns the sequence that removes the images of all tiles.
    pub fn removal_of_all(protocol: Protocol) -> String {
        match protocol {
            Protocol::Kitty => REMOVE_ALL.to_string(),
            // Text overwrites the placeholders.
            Protocol::KittyThroughTmux => kitty::wrapped(REMOVE_ALL),
            Protocol::Sixel(_) | Protocol::Blocks => String::new(),
        }
    }

    /// Returns the sequence that ends an incomplete transfer.
    pub fn give_up(protocol: Protocol) -> String {
        match protocol {
            Protocol::Kitty => kitty::GIVE_UP.to_string(),
            Protocol::KittyThroughTmux => kitty::wrapped(kitty::GIVE_UP),
            Protocol::Sixel(_) => "\x1b\\".to_string(),
            Protocol::Blocks => String::new(),
        }
    }

    /// Returns the cell at (column, row) of the tile while its image is visible. Without placeholders
    /// it is [`TileImage::pixels`].
    pub fn cell(&self, column: u16, row: u16) -> Cell {
        let mut cell = Self::pixels();
        if self.protocol == Protocol::KittyThroughTmux {
            let style = Style::new().fg(Color::Indexed(self.number() as u8));
            cell.set_symbol(&kitty::placeholder(row, Some(column))).set_style(style);
        }
        cell
    }

    /// Returns the cell that stands for pixels of an image. It is never sent.
    pub fn pixels() -> Cell {
        Cell::new("\u{fffc}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_have_few_pixels_and_numbers_of_their_own() {
        let cells = |protocol, size| TileImage::cells(protocol, size, [10, 20]);
        assert_eq!(cells(Protocol::Kitty, [200, 100]), [6, 3]);
        assert_eq!(cells(Protocol::KittyThroughTmux, [64, 24]), [6, 3]);
        let [width, height] = cells(Protocol::KittyThroughTmux, [200, 100]);
        assert!(200u16.div_ceil(width) * 100u16.div_ceil(height) <= 127);
        assert_eq!(cells(Protocol::Sixel(256), [64, 24]), [64, 2]);
        let place = Rect { x: 2, y: 1, width: 6, height: 3 };
        let tile = TileImage { protocol: Protocol::Kitty, index: 3, second: true, place };
        let image = Raster::from_fn(60, 60, |i| [i as u8; 3]);
        let transfer = tile.encode(&image, |_| Ok(vec![7; 2000])).unwrap();
        let text = String::from_utf8(transfer.bytes).unwrap();
        assert!(text.starts_with("\x1b[2;3H\x1b_Ga=T,f=100,i=1007,p=1,C=1,q=2,m=1;"), "{text:?}");
        assert!(
            text.ends_with("\x1b_Ga=d,d=I,i=1006,q=2\x1b\\"),
            "the old image goes last: {text:?}"
        );
    }
}
