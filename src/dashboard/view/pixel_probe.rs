//! Drawing of the pixel probe: a mark on the picture, and a box with values.

use crate::dashboard::text::{columns, number};
use crate::dashboard::view::painter::Painter;
use crate::dashboard::{BORDER, Layout, Model};
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use zerkalo_render::film::quantised_8;
use zerkalo_scene::edit::Target;

/// Least width of the box in columns, border included.
const WIDTH: usize = 36;
/// Columns of the box besides the values, and the swatch beside the levels.
const BESIDE: usize = 13;
const SWATCH: usize = 4;

pub fn draw(model: &Model, layout: &Layout, painter: &mut Painter) {
    let theme = painter.theme;
    let Some([x, y]) = model.probe else { return };
    let place = layout.cell_of([x as f64 + 0.5, y as f64 + 0.5]);
    let [column, row] = place.unwrap_or([layout.picture.x, layout.picture.y]);
    if place.is_some() {
        mark(column, row, '┼', painter);
    }
    let lines = readout(model);
    let height = lines.len() as u16 + 2;
    let widest = (0..)
        .zip(&lines)
        .map(|(i, (_, value))| columns(value) + BESIDE + if i == 1 { SWATCH } else { 0 });
    let width = widest.fold(WIDTH, usize::max) as u16;
    let area = layout.picture;
    if area.width < width + 4 || area.height < height + 4 {
        let mut row = painter.row(area, area.height.saturating_sub(1));
        row.skip(1);
        for (name, value) in lines.iter().take(3) {
            let text = format!(" {name} {value} ");
            if columns(&text) < row.left() {
                row.put(&text, theme.text());
            }
        }
        return;
    }
    // The box is in the corner that is farthest from the mark.
    let in_left = column < area.x + area.width / 2;
    let in_upper = row < area.y + area.height / 2;
    let x_box = if in_left { area.right() - width - 2 } else { area.x + 2 };
    let y_box = if in_upper { area.bottom() - height - 1 } else { area.y + 1 };
    let frame = Rect { x: x_box, y: y_box, width, height };
    painter.overlay(frame, &format!("pixel {x}, {y}"));
    let inner = frame.inner(BORDER);
    for (i, (name, value)) in (0..).zip(&lines) {
        let mut row = painter.row(inner, i);
        row.skip(1).put_wide(name, 10, theme.dim());
        if i == 1
            && let Some(probe) = model.probed()
            && let Some(style) = theme.swatch(probe.levels.map(quantised_8))
        {
            row.put_right(" ", 0, style).put_right("██", columns(value), style);
        }
        row.put(value, theme.text());
    }
}

/// Returns the lines of the box, each a label and a value.
fn readout(model: &Model) -> Vec<(&'static str, String)> {
    let Some(probe) = model.probed() else {
        return vec![("samples", "none yet".to_string())];
    };
    let three = |values: [f64; 3]| values.map(number).join("  ");
    let [a, b] = probe.samples;
    let mut lines = vec![
        ("radiance", three(probe.radiance)),
        ("levels", probe.levels.map(|c| format!("{c:.1}")).join("  ")),
        ("samples", format!("{}", u64::from(a) + u64::from(b))),
    ];
    if let Some(difference) = probe.difference {
        lines.push(("error", format!("± {}", three(difference))));
    }
    if let Some(levels) = probe.tile_rmse_levels {
        lines.push(("tile", format!("± {} levels", number(levels))));
    }
    if let Some(text) = sources(model, &probe.error_shares) {
        lines.push(("noise of", text));
    }
    if let Some(text) = surfaces(model, &probe.tile_errors) {
        lines.push(("noise on", text));
    }
    if let Some(name) = seen(model, probe.pixel) {
        lines.push(("object", name));
    }
    lines
}

/// Names the two light groups with the largest shares in the error, such as `lamp 88 %, sky 9 %`.
/// Returns `None` if there is only one group.
fn sources(model: &Model, shares: &[f64]) -> Option<String> {
    let lighting = model.snapshot.as_ref()?.lighting.as_ref()?;
    let names = lighting.groups.names(&lighting.compiled);
    largest(shares.iter().copied().zip(names).collect())
}

/// Names the two objects that are seen first with the largest shares in the error of the probe's tile,
/// as [`sources`] does. Returns `None` if only one is seen.
fn surfaces(model: &Model, errors: &[([usize; 2], f64)]) -> Option<String> {
    let mut found: Vec<(f64, String)> = Vec::new();
    let sum: f64 = errors.iter().map(|(_, square)| square).sum();
    for (pixel, square) in errors.iter().filter(|_| sum > 0.0) {
        let name = seen(model, *pixel).unwrap_or_else(|| "background".to_string());
        match found.iter_mut().find(|(_, known)| *known == name) {
            Some((share, _)) => *share += square / sum,
            None => found.push((square / sum, name)),
        }
    }
    largest(found)
}

/// Formats the two largest shares; `None` if there is only one.
fn largest(mut found: Vec<(f64, String)>) -> Option<String> {
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let percent = |(share, name): &(f64, String)| format!("{name} {:.0} %", 100.0 * share);
    let texts: Vec<_> = found.iter().take(2).map(percent).collect();
    (found.len() > 1).then(|| texts.join(", "))
}

/// Returns the label of the object that is visible at a film pixel (column, row).
pub fn seen(model: &Model, pixel: [usize; 2]) -> Option<String> {
    let hits = model.snapshot.as_ref()?.first_hits.as_deref()?;
    let object = hits.at_pixel(pixel)?.object?;
    let target = Target::Object(object as usize);
    target.exists(model.scene()).then(|| target.label(model.scene()))
}

/// Draws a character in a cell of the picture, in a colour that contrasts with its background.
pub fn mark(column: u16, row: u16, character: char, painter: &mut Painter) {
    let Some(cell) = painter.buffer.cell_mut((column, row)) else { return };
    let light = |color: Color| match color {
        Color::Rgb(r, g, b) => u32::from(r) * 2 + u32::from(g) * 7 + u32::from(b) > 1400,
        _ => false,
    };
    let style = match cell.bg {
        bg @ Color::Rgb(..) if light(bg) => Style::new().fg(Color::Rgb(0, 0, 0)),
        Color::Rgb(..) => Style::new().fg(Color::Rgb(255, 255, 255)),
        _ => Style::new().add_modifier(Modifier::REVERSED),
    };
    cell.set_char(character).set_style(style);
}
