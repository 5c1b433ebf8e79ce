//! Drawing of the viewer of exported images.

use crate::dashboard::view::painter::Painter;
use crate::dashboard::view::picture::paint;
use crate::dashboard::{Model, ViewedImage, short_name};
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use zerkalo_terminal::cells::picture_cells;
use zerkalo_terminal::image::{Protocol, ViewerImage};

/// Draws the viewed image in half blocks until it is uploaded, and returns these cells and their
/// area. Returns `None` if the image is still being read, or if placeholder characters of kitty's
/// protocol show the uploaded image.
pub fn draw(model: &Model, viewed: &ViewedImage, painter: &mut Painter) -> Option<(Buffer, Rect)> {
    let theme = painter.theme;
    let [width, height] = model.screen;
    let last = Rect { x: 0, y: height.saturating_sub(1), width, height: 1 };
    let mut row = painter.row(last, 0);
    row.skip(1);
    let Some(image) = &viewed.image else {
        row.put("reading ", theme.dim()).put(&short_name(&viewed.path), theme.text());
        return None;
    };
    let (important, more) = description(viewed, image);
    row.put(&short_name(&viewed.path), theme.text()).put("  ", theme.dim());
    row.put(&important, theme.text()).put("  ·  any key returns", theme.accent());
    row.put(more, theme.dim());
    let place = image.layout.place;
    if viewed.sent >= 1.0 && image.placeholder(0).is_some() {
        for at in place.intersection(painter.buffer.area).positions() {
            if let Some((symbol, color)) = image.placeholder(at.y - place.y) {
                painter.buffer[at]
                    .set_symbol(&symbol)
                    .set_style(Style::new().fg(Color::Indexed(color)));
            }
        }
        return None;
    }
    let cells = picture_cells(&image.raster, model.colors, true);
    paint(&cells, place, painter.buffer);
    Some((cells, place))
}

/// Returns size and progress of the image, and a hint if the terminal supports no image protocol.
fn description(viewed: &ViewedImage, image: &ViewerImage) -> (String, &'static str) {
    let [width, height] = image.layout.size;
    let whole = format!("{width}×{height}");
    let size = match image.layout.shown {
        [w, h] if [w, h] == image.layout.size => whole,
        _ if image.protocol == Protocol::Blocks => format!("{whole} in half blocks"),
        [w, h] => format!("{w}×{h} of {whole}"),
    };
    match image.protocol {
        Protocol::Blocks if viewed.downloads => {
            let kilobytes = image.transfer.bytes.len() as f64 * 1e-3;
            (format!("to your machine: {:.0} % of {kilobytes:.0} KB", 100.0 * viewed.sent), "")
        }
        Protocol::Blocks => (size, "  ·  zerkalo doctor lists the requirements of sharp images"),
        _ if viewed.sent < 1.0 => {
            let kilobytes = image.transfer.bytes.len() as f64 * 1e-3;
            (format!("{size}  {:.0} % of {kilobytes:.0} KB", 100.0 * viewed.sent), "")
        }
        _ => (size, ""),
    }
}
