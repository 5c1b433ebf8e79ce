//! The picture in its panel at the resolution of the screen: tiles, each an image of its own, that
//! are sent one after the other when no cells wait to be sent.

use crate::dashboard::layout::PixelGrid;
use crate::dashboard::{DisplayChannel, Model, Overlay};
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::{Position, Rect};
use ratatui::style::Color;
use std::sync::Arc;
use zerkalo_render::film::Detail;
use zerkalo_render::image_file::png_of_rgb;
use zerkalo_render::session::State;
use zerkalo_terminal::cells::Raster;
use zerkalo_terminal::image::{Protocol, TileImage, Transfer};

/// RMS difference in levels above which a tile is sent again while the picture is traced.
const VISIBLE_LEVELS: f64 = 1.0;
/// Rank of tiles that are not visible yet, above that of any difference.
const MISSING: f64 = 1e6;

/// Tile of the grid.
#[derive(Debug)]
struct Tile {
    image: TileImage,
    /// Left and upper edge, width and height in pixels of the picture.
    px: [usize; 4],
    /// Pixels on the screen; empty if the tile is not visible.
    shown: Vec<[u8; 3]>,
    /// `true` if text covers a part of it.
    covered: bool,
}

/// Transfer of a tile, and the number of bytes sent.
#[derive(Debug)]
struct Sending {
    tile: usize,
    pixels: Vec<[u8; 3]>,
    transfer: Transfer,
    sent: usize,
    /// `true` if the bytes sent so far end inside an escape sequence.
    open: bool,
}

#[derive(Debug, Default)]
pub struct PanelTiles {
    grid: Option<(Protocol, PixelGrid)>,
    tiles: Vec<Tile>,
    /// Picture whose differences determine `order`.
    detail: Option<Arc<Detail>>,
    /// Tiles to send, the last one first.
    order: Vec<usize>,
    sending: Option<Sending>,
}

impl PanelTiles {
    /// Fits the tiles to a new frame of `model`. `target` has its cells, and `picture` is the area of
    /// its picture with the mask of the cells that nothing covers. Returns the sequence that removes
    /// tiles which may no longer be visible.
    pub fn update(&mut self, model: &Model, target: &Buffer, picture: (Rect, &[bool])) -> String {
        let wanted = wanted(model);
        let grid = wanted.as_ref().map(|(protocol, grid, _)| (*protocol, *grid));
        let mut removal = String::new();
        if self.grid != grid {
            removal = self.clear();
            self.grid = grid;
            self.tiles = grid.map_or_else(Vec::new, |(protocol, grid)| tiles(protocol, grid));
        }
        let Some((.., detail)) = wanted else { return removal };
        let mut changed = !self.detail.as_ref().is_some_and(|old| Arc::ptr_eq(old, &detail));
        self.detail = Some(detail);
        for (i, tile) in self.tiles.iter_mut().enumerate() {
            let covered = is_covered(tile.image.place, target, picture);
            changed |= std::mem::replace(&mut tile.covered, covered) != covered;
            if !covered {
                continue;
            }
            if self.sending.take_if(|sending| sending.tile == i).is_some() {
                removal += &tile.image.give_up();
            }
            if !std::mem::take(&mut tile.shown).is_empty() {
                removal += &tile.image.removal();
            }
        }
        if changed {
            let snapshot = model.snapshot.as_ref();
            let is_tracing = snapshot.is_some_and(|s| matches!(s.report.state, State::Tracing));
            self.sort(if is_tracing { VISIBLE_LEVELS } else { 0.0 });
        }
        removal
    }

    /// Forgets all tiles. Returns the sequence that removes the visible ones.
    pub fn clear(&mut self) -> String {
        let removal = if self.is_visible() { self.removal() } else { String::new() };
        *self = Self::default();
        removal
    }

    /// Returns the sequence that removes all tiles at any moment.
    pub fn removal(&self) -> String {
        let visible = self.tiles.iter().filter(|tile| !tile.shown.is_empty());
        let sending = self.sending.iter().map(|sending| sending.tile);
        let give_up = sending.map(|tile| self.tiles[tile].image.give_up());
        give_up.chain(visible.map(|tile| tile.image.removal())).collect()
    }

    pub fn is_sixel(&self) -> bool {
        matches!(self.grid, Some((Protocol::Sixel(_), _)))
    }

    /// Returns the cell that stands for pixels of a sixel image.
    pub fn pixel_cell() -> Cell {
        let place = Rect::ZERO;
        TileImage { protocol: Protocol::Sixel(0), index: 0, second: false, place }.cell(0, 0)
    }

    fn is_visible(&self) -> bool {
        self.sending.is_some() || self.tiles.iter().any(|tile| !tile.shown.is_empty())
    }

    /// Returns `true` if a part of a tile waits to be sent.
    pub fn waits(&self) -> bool {
        self.sending.is_some() || !self.order.is_empty()
    }

    /// Returns `true` if the bytes sent so far end inside an escape sequence.
    pub fn is_open(&self) -> bool {
        self.sending.as_ref().is_some_and(|sending| sending.open)
    }

    /// Selects the tiles to send: the missing ones with most contrast first, then those that differ
    /// most from the screen. A difference up to `least` levels RMS is ignored.
    fn sort(&mut self, least: f64) {
        let mut ranks: Vec<(f64, usize)> = Vec::new();
        for (i, tile) in self.tiles.iter().enumerate().filter(|(_, tile)| !tile.covered) {
            let pixels = self.pixels(tile);
            let rank = match tile.shown.is_empty() {
                true => MISSING + mean_square(&pixels, &pixels[1.min(pixels.len())..]),
                false => mean_square(&pixels, &tile.shown),
            };
            if rank > least * least {
                ranks.push((rank, i));
            }
        }
        if self.is_sixel() && !ranks.is_empty() {
            // A terminal that keeps few images forgets the oldest first, so that all are sent in
            // their order.
            let all = self.tiles.iter().enumerate().filter(|(_, tile)| !tile.covered);
            ranks = all.map(|(i, _)| (-(i as f64), i)).collect();
        }
        ranks.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.order = ranks.into_iter().map(|(_, i)| i).collect();
    }

    /// Returns the present pixels of a tile.
    fn pixels(&self, tile: &Tile) -> Vec<[u8; 3]> {
        let (Some((_, grid)), Some(detail)) = (&self.grid, &self.detail) else { return Vec::new() };
        let [x0, y0, width, height] = tile.px;
        let [columns, rows] = detail.size;
        let pixel = |i: usize| {
            let (x, y) = (x0 + i % width, y0 + i / width);
            let (x, y) = (x.min(grid.size[0] - 1), y.min(grid.size[1] - 1));
            detail.pixels[y * rows / grid.size[1] * columns + x * columns / grid.size[0]]
        };
        (0..width * height).map(pixel).collect()
    }

    /// Appends the next part of a tile to `out`, in at most about `room` bytes. Returns the cells of
    /// the tile if it is complete.
    pub fn next(&mut self, room: usize, out: &mut Vec<u8>) -> Option<Rect> {
        while self.sending.is_none() {
            let tile = self.order.pop()?;
            let pixels = self.pixels(&self.tiles[tile]);
            let Tile { image, px: [.., width, height], shown, covered } = &self.tiles[tile];
            if *covered || pixels == *shown && !matches!(image.protocol, Protocol::Sixel(_)) {
                continue;
            }
            let image = TileImage { second: !image.second, ..*image };
            let raster = Raster { width: *width, height: *height, pixels };
            let size = [*width, *height].map(|n| n as u32);
            let png = |image: &Raster| {
                png_of_rgb(size, image.pixels.as_flattened()).map_err(|error| error.to_string())
            };
            if let Ok(transfer) = image.encode(&raster, png) {
                let pixels = raster.pixels;
                self.sending = Some(Sending { tile, pixels, transfer, sent: 0, open: false });
            }
        }
        let sending = self.sending.as_mut()?;
        let (range, open) = sending.transfer.slice(sending.sent, room);
        out.extend(&sending.transfer.bytes[range.clone()]);
        (sending.sent, sending.open) = (range.end, open);
        if sending.sent < sending.transfer.bytes.len() {
            return None;
        }
        let Sending { tile, pixels, .. } = self.sending.take()?;
        let tile = &mut self.tiles[tile];
        tile.image.second = !tile.image.second;
        tile.shown = pixels;
        Some(tile.image.place)
    }

    /// Replaces the cells of visible tiles in `target`, and marks them as text in the mask of the
    /// picture.
    pub fn paint(&self, target: &mut Buffer, place: Rect, uncovered: &mut [bool]) {
        for Tile { image, .. } in self.tiles.iter().filter(|tile| !tile.shown.is_empty()) {
            for at in image.place.intersection(target.area).positions() {
                let free = match mask_index(place, at) {
                    Some(index) => uncovered.get_mut(index).is_some_and(std::mem::take),
                    None => target[at].symbol() == " ",
                };
                if free {
                    target[at] = image.cell(at.x - image.place.x, at.y - image.place.y);
                } else if image.protocol == Protocol::Kitty && is_mark(target[at].bg) {
                    target[at].set_bg(Color::Reset);
                }
            }
        }
    }
}

/// Returns protocol, grid and picture of the tiles that may be visible. Returns `None` while the
/// scene, the view or the display changes, and if something else than the picture is shown.
fn wanted(model: &Model) -> Option<(Protocol, PixelGrid, Arc<Detail>)> {
    let grid = model.layout()?.pixels?;
    let snapshot = model.snapshot.as_ref()?;
    let detail = snapshot.detail.as_ref()?;
    let is_current = model.requested.detail == Some((detail.window, detail.size))
        && detail.generation == snapshot.report.generation
        && detail.display == model.display
        && (model.watch.is_some()
            || snapshot.weights_for(model.scene()).as_ref() == Some(&detail.weights));
    let is_covered = matches!(model.overlay, Some(Overlay::ViewerImage(_)));
    let is_picture = model.channel == DisplayChannel::Beauty && !model.file.unreadable;
    let is_wanted = is_current && is_picture && !is_covered;
    is_wanted.then(|| (model.graphics.protocol, grid, Arc::clone(detail)))
}

/// Divides a picture into tiles.
fn tiles(protocol: Protocol, grid: PixelGrid) -> Vec<Tile> {
    let PixelGrid { place, size, cell, .. } = grid;
    let side = TileImage::cells(protocol, [place.width, place.height], cell);
    let steps = |length: u16, side: u16| (0..length).step_by(side.into());
    let places = steps(place.height, side[1]).flat_map(|y| {
        steps(place.width, side[0]).map(move |x| Rect {
            x: place.x + x,
            y: place.y + y,
            width: side[0].min(place.width - x),
            height: side[1].min(place.height - y),
        })
    });
    let tile = |(index, cells): (usize, Rect)| {
        let start = [(cells.x - place.x, cell[0]), (cells.y - place.y, cell[1])]
            .map(|(cells, px)| usize::from(cells) * px);
        let whole = [usize::from(cells.width) * cell[0], usize::from(cells.height) * cell[1]];
        // Placeholders show whole cells.
        let [width, height] = match protocol {
            Protocol::KittyThroughTmux => whole,
            _ => [0, 1].map(|i| whole[i].min(size[i].saturating_sub(start[i]))),
        };
        let image = TileImage { protocol, index, second: false, place: cells };
        Tile { image, px: [start[0], start[1], width, height], shown: Vec::new(), covered: false }
    };
    places.enumerate().map(tile).filter(|tile| tile.px[2] > 0 && tile.px[3] > 0).collect()
}

/// Returns `true` if text covers a part of `cells`. A mark on the picture, in its colours, does not.
fn is_covered(cells: Rect, target: &Buffer, (place, uncovered): (Rect, &[bool])) -> bool {
    cells.intersection(target.area).positions().any(|at| match mask_index(place, at) {
        Some(index) => !uncovered.get(index).copied().unwrap_or(false) && !is_mark(target[at].bg),
        None => target[at].symbol() != " ",
    })
}

fn is_mark(background: Color) -> bool {
    matches!(background, Color::Rgb(..) | Color::Indexed(_))
}

fn mask_index(place: Rect, at: Position) -> Option<usize> {
    let index =
        || usize::from(at.y - place.y) * usize::from(place.width) + usize::from(at.x - place.x);
    place.contains(at).then(index)
}

/// Returns the mean squared difference of two rows of pixels in levels.
fn mean_square(a: &[[u8; 3]], b: &[[u8; 3]]) -> f64 {
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    let sum: u64 = pairs.map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2)).sum();
    sum as f64 / a.as_flattened().len().max(1) as f64
}
