//! Drawing of the loupe.

use crate::dashboard::text::cut;
use crate::dashboard::view::painter::Painter;
use crate::dashboard::view::picture::{paint, visible_mask};
use crate::dashboard::view::pixel_probe::{mark, seen};
use crate::dashboard::{BORDER, Layout, Model};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use zerkalo_terminal::cells::{Raster, picture_cells};

/// Draws the frame and the pixels of the loupe. Returns its cells and their area, or `None` if there
/// are none.
pub fn draw(model: &Model, layout: &Layout, painter: &mut Painter) -> Option<(Buffer, Rect)> {
    let loupe = model.loupe(layout)?;
    let detail = model.loupe.detail.as_ref().filter(|detail| detail.size == loupe.window.size)?;
    let [x, y] = [0, 1].map(|i| loupe.window.origin[i] + loupe.window.size[i] / 2);
    let title =
        seen(model, [x, y]).map_or("1:1 · G".to_string(), |name| format!("1:1  {name} · G"));
    painter.overlay(loupe.frame, &cut(&title, usize::from(loupe.frame.width.saturating_sub(6))));
    let ends = [0, 1].map(|i| (loupe.window.origin[i], loupe.window.size[i] - 1));
    for (corner, right, lower) in [('┌', 0, 0), ('┐', 1, 0), ('└', 0, 1), ('┘', 1, 1)] {
        let point = [ends[0].0 + right * ends[0].1, ends[1].0 + lower * ends[1].1];
        if let Some([column, row]) = layout.cell_of(point.map(|n| n as f64 + 0.5)) {
            mark(column, row, corner, painter);
        }
    }
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
