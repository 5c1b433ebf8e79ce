//! Drawing of the loupe.

use crate::dashboard::view::painter::Painter;
use crate::dashboard::view::picture::{paint, visible_mask};
use crate::dashboard::{BORDER, Layout, Model};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use zerkalo_terminal::cells::{Raster, picture_cells};

/// Draws the frame and the pixels of the loupe. Returns its cells and their area, or `None` if there
/// are none.
pub fn draw(model: &Model, layout: &Layout, painter: &mut Painter) -> Option<(Buffer, Rect)> {
    let loupe = model.loupe(layout)?;
    let detail = model.loupe.detail.as_ref().filter(|detail| detail.size == loupe.window.size)?;
    painter.overlay(loupe.frame, "1:1");
    let raster = Raster::from_fn(detail.size[0], detail.size[1], |i| detail.pixels[i]);
    let cells = picture_cells(&raster, model.colors, false);
    let inside = loupe.frame.inner(BORDER);
    paint(&cells, inside, painter.buffer);
    Some((cells, inside))
}

/// Marks the cells of the loupe in `uncovered`, the mask of the picture at `place`, so that they are
/// sent as cells of the picture.
pub fn uncover(
    (cells, area): &(Buffer, Rect),
    buffer: &Buffer,
    place: Rect,
    uncovered: &mut [bool],
) {
    let (area, mask) = visible_mask(cells, *area, buffer);
    for (at, is_visible) in area.positions().zip(mask) {
        if is_visible && place.contains(at) {
            let index = usize::from(at.y - place.y) * usize::from(place.width);
            uncovered[index + usize::from(at.x - place.x)] = true;
        }
    }
}
