//! The picture in its panel at the resolution of the screen: tiles, each an image of its own, that
//! are sent one after the other when no cells wait to be sent.

use crate::dashboard::layout::PixelGrid;
use crate::dashboard::marks::Mask;
use crate::dashboard::view::marks;
use crate::dashboard::{DisplayChannel, Model, Overlay};
use ratatui::buffer::Buffer;
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
    /// Cells with marks on the picture, at which an image above the text is transparent.
    holes: Vec<Position>,
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

/// Picture of the session, and the masks of what is outlined in it.
type Source = (Arc<Detail>, Vec<Mask>);

#[derive(Debug, Default)]
pub struct PanelTiles {
    grid: Option<(Protocol, PixelGrid)>,
    tiles: Vec<Tile>,
    source: Option<Source>,
    /// Columns and rows of `pixels`.
    size: [usize; 2],
    /// Picture with outlines, whose differences from the screen determine `order`.
    pixels: Vec<[u8; 3]>,
    /// RMS difference in levels up to which a tile is not sent again.
    least: f64,
    /// Tiles to send, the last one first.
    order: Vec<usize>,
    sending: Option<Sending>,
}

impl PanelTiles {
    /// Fits the tiles to a new frame of `model`. `target` has its cells, `picture` is the area of
    /// its picture, and `uncovered` the mask of the cells there that nothing covers. Returns the sequence that removes
    /// tiles which may no longer be visible.
    pub fn update(
        &mut self,
        model: &Model,
        target: &Buffer,
        picture: Rect,
        uncovered: &[bool],
    ) -> String {
        let wanted = wanted(model);
        let grid = wanted.as_ref().map(|(protocol, grid, _)| (*protocol, *grid));
        let mut removal = String::new();
        if self.grid != grid {
            removal = self.clear();
            self.grid = grid;
            self.tiles = grid.map_or_else(Vec::new, |(protocol, grid)| tiles(protocol, grid));
        }
        let Some((.., detail)) = wanted else { return removal };
        let mut changed = self.outline(model, detail);
        for (i, tile) in self.tiles.iter_mut().enumerate() {
            let (covered, holes) = covering(&tile.image, target, picture, uncovered);
            let is_kept = !covered && holes == tile.holes;
            changed |= tile.covered != covered || holes != tile.holes;
            (tile.covered, tile.holes) = (covered, holes);
            if is_kept {
                continue;
            }
            if self.sending.take_if(|sending| sending.tile == i).is_some() {
                removal += &TileImage::give_up(tile.image.protocol);
            }
            if !std::mem::take(&mut tile.shown).is_empty() {
                removal += &tile.image.removal();
            }
        }
        let snapshot = model.snapshot.as_ref();
        let is_tracing = snapshot.is_some_and(|s| matches!(s.report.state, State::Tracing));
        let least = if is_tracing { VISIBLE_LEVELS } else { 0.0 };
        if changed | (std::mem::replace(&mut self.least, least) != least) {
            self.sort();
        }
        removal
    }

    /// Sets the picture, with outlines. Returns `true` if it has changed.
    fn outline(&mut self, model: &Model, detail: Arc<Detail>) -> bool {
        let masks = model.outlined();
        let is_same = |(old, outlined): &Source| Arc::ptr_eq(old, &detail) && *outlined == masks;
        if self.source.as_ref().is_some_and(is_same) {
            return false;
        }
        let mut outlined = Detail::clone(&detail);
        for (mask, window) in &masks {
            outlined.pixels = marks::outlined(&outlined, mask, *window);
        }
        (self.size, self.pixels) = (outlined.size, outlined.pixels);
        self.source = Some((detail, masks));
        true
    }

    /// Forgets all tiles. Returns the sequence that removes the visible ones.
    pub fn clear(&mut self) -> String {
        let removal = if self.is_visible() { self.removal() } else { String::new() };
        *self = Self::default();
        removal
    }

    /// Returns the sequence that removes all tiles at any moment.
    pub fn removal(&self) -> String {
        let end =
            |(protocol, _)| TileImage::give_up(protocol) + &TileImage::removal_of_all(protocol);
        self.grid.map_or_else(String::new, end)
    }

    pub fn is_sixel(&self) -> bool {
        matches!(self.grid, Some((Protocol::Sixel(_), _)))
    }

    /// Returns `true` if the terminal shows tiles in place of cells, or above them.
    pub fn replace_cells(&self) -> bool {
        matches!(self.grid, Some((Protocol::Kitty | Protocol::Sixel(_), _)))
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
    /// most from the screen.
    fn sort(&mut self) {
        let mut ranks: Vec<(f64, usize)> = Vec::new();
        for (i, tile) in self.tiles.iter().enumerate().filter(|(_, tile)| !tile.covered) {
            let pixels = self.pixels(tile);
            let rank = match tile.shown.is_empty() {
                true => MISSING + mean_square(&pixels, &pixels[1.min(pixels.len())..]),
                false => mean_square(&pixels, &tile.shown),
            };
            if rank > self.least * self.least {
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
        let Some((_, grid)) = &self.grid else { return Vec::new() };
        let [x0, y0, width, height] = tile.px;
        let [columns, rows] = self.size;
        let pixel = |i: usize| {
            let (x, y) = (x0 + i % width, y0 + i / width);
            let (x, y) = (x.min(grid.size[0] - 1), y.min(grid.size[1] - 1));
            self.pixels[y * rows / grid.size[1] * columns + x * columns / grid.size[0]]
        };
        (0..width * height).map(pixel).collect()
    }

    /// Gives the pixels of `holes` a colour that no other pixel has, which is returned.
    fn cut(&self, raster: &mut Raster, place: Rect, holes: &[Position]) -> [u8; 3] {
        let colors = (0..=u16::MAX).map(|n| [n as u8, (n >> 8) as u8, 1]);
        let key = colors.into_iter().find(|color| !raster.pixels.contains(color));
        let (key, cell) =
            (key.unwrap_or_default(), self.grid.map_or([1; 2], |(_, grid)| grid.cell));
        let place = [place.x, place.y].map(usize::from);
        for (i, pixel) in raster.pixels.iter_mut().enumerate() {
            let at = [i % raster.width / cell[0], i / raster.width / cell[1]];
            let is_in = |hole: &Position| {
                at == [usize::from(hole.x) - place[0], usize::from(hole.y) - place[1]]
            };
            if holes.iter().any(is_in) {
                *pixel = key;
            }
        }
        key
    }

    /// Appends the next part of a tile to `out`, in at most about `room` bytes. Returns the cells of
    /// the tile if it is complete.
    pub fn next(&mut self, room: usize, out: &mut Vec<u8>) -> Option<Rect> {
        while self.sending.is_none() {
            let tile = self.order.pop()?;
            let pixels = self.pixels(&self.tiles[tile]);
            let Tile { image, px: [.., width, height], shown, covered, holes } = &self.tiles[tile];
            if *covered || pixels == *shown && !matches!(image.protocol, Protocol::Sixel(_)) {
                continue;
            }
            let image = TileImage { second: !image.second, ..*image };
            let mut raster = Raster { width: *width, height: *height, pixels: pixels.clone() };
            let key = (!holes.is_empty()).then(|| self.cut(&mut raster, image.place, holes));
            let size = [*width, *height].map(|n| n as u32);
            let png = |image: &Raster| {
                png_of_rgb(size, image.pixels.as_flattened(), key)
                    .map_err(|error| error.to_string())
            };
            if let Ok(transfer) = image.encode(&raster, png) {
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
                let is_free = match mask_index(place, at) {
                    Some(index) => uncovered.get_mut(index).is_some_and(std::mem::take),
                    None => target[at].symbol() == " ",
                };
                if is_free {
                    target[at] = image.cell(at.x - image.place.x, at.y - image.place.y);
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
            || snapshot.weights_for(model.seen()).as_ref() == Some(&detail.weights));
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
            Protocol::Kitty | Protocol::Sixel(_) | Protocol::Blocks => {
                [0, 1].map(|i| whole[i].min(size[i].saturating_sub(start[i])))
            }
        };
        let image = TileImage { protocol, index, second: false, place: cells };
        Tile {
            image,
            px: [start[0], start[1], width, height],
            shown: Vec::new(),
            covered: false,
            holes: Vec::new(),
        }
    };
    places.enumerate().map(tile).filter(|tile| tile.px[2] > 0 && tile.px[3] > 0).collect()
}

/// Returns `true` if text covers a part of a tile, and the cells with marks on the picture, in its
/// colours, at which an image above the text must be transparent.
fn covering(
    tile: &TileImage,
    target: &Buffer,
    picture: Rect,
    uncovered: &[bool],
) -> (bool, Vec<Position>) {
    let (mut covered, mut holes) = (false, Vec::new());
    for at in tile.place.intersection(target.area).positions() {
        match mask_index(picture, at).map(|index| uncovered.get(index) == Some(&true)) {
            Some(true) => {}
            Some(false) if matches!(target[at].bg, Color::Rgb(..) | Color::Indexed(_)) => {
                holes.push(at);
            }
            Some(false) => covered = true,
            None => covered |= target[at].symbol() != " ",
        }
    }
    holes.retain(|_| tile.protocol == Protocol::Kitty);
    (covered, holes)
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
