//! Drawing of properties and their values.

use crate::dashboard::panel_lines::RowAct;
use crate::dashboard::text::{columns, skip};
use crate::dashboard::view::is_active;
use crate::dashboard::view::painter::{Painter, Row, VisibleLine};
use crate::dashboard::{BORDER, Editor, FieldLine, FieldList, Focus, Layout, Model, PanelLine};
use ratatui::layout::{Margin, Position, Rect};
use ratatui::style::{Modifier, Style};
use std::borrow::Cow;
use zerkalo_render::film::Display;
use zerkalo_scene::edit::Widget;
use zerkalo_scene::value::{number, round_significant};

/// Unit of nearly all numbers, therefore shown only for the property under the cursor.
const LENGTH: &str = "scene units";

/// Draws the inspector. Returns the position of the text cursor.
pub fn inspector(model: &Model, layout: &Layout, painter: &mut Painter) -> Option<Position> {
    let area = layout.inspector?;
    let (list, help) = model.inspector_rows()?;
    let active = is_active(model, Focus::Inspector);
    painter.panel(area, &model.selection.title(model.scene()), active);
    draw(model, list, help, active, painter)
}

/// Draws the properties of the open form, or of the inspector, and help on the property under the
/// cursor. Returns the position of the text cursor.
pub fn draw(
    model: &Model,
    list: Rect,
    help: Rect,
    active: bool,
    painter: &mut Painter,
) -> Option<Position> {
    let (lines, state) = (model.field_lines(), model.field_list());
    let label = |line: &PanelLine| match line.entry() {
        Some(field) if field.act == RowAct::Edit => {
            1 + 2 * field.property.depth + columns(&field.label)
        }
        _ => 0,
    };
    let widest = lines.iter().map(label).max().unwrap_or(0);
    let labels = widest.min(usize::from(list.width) * 9 / 20);
    let mut typing = None;
    let border = painter.theme.border(active);
    for VisibleLine { row, index } in painter.window(list, state.scroll, lines.len(), border) {
        let to = painter.row(list, row);
        match &lines[index] {
            PanelLine::Heading(title) => heading(to, title),
            PanelLine::Entry(field) => {
                let chosen = (active && index == state.cursor).then_some(state);
                typing = typing.or(draw_field(field, chosen, labels, to));
            }
        }
    }
    let field = lines.get(state.cursor).and_then(PanelLine::entry);
    if let Some(field) = field.filter(|_| active) {
        explain(field, state.problem(), help, painter);
    }
    if let Some(filter) = &state.filter {
        let inside = Rect { height: list.height + help.height, ..list };
        let mut to = painter.edge(inside.outer(BORDER), inside.height + 1);
        to.put(" / ", to.theme.accent());
        typing = typed(filter, &mut to);
    }
    typing
}

/// Draws a field, with a label of `labels` columns. `chosen` is the state of the list if the panel
/// has the focus and the field is under the cursor. Returns the position of the text cursor.
fn draw_field(
    field: &FieldLine,
    chosen: Option<&FieldList>,
    labels: usize,
    mut to: Row,
) -> Option<Position> {
    let theme = to.theme;
    let (name, value) = match (chosen, field.property.is_default) {
        (Some(_), _) => (theme.selected(true), theme.selected(true)),
        (None, true) => (theme.dim(), theme.dim()),
        (None, false) => (theme.dim(), theme.text()),
    };
    if chosen.is_some() {
        to.fill(name);
    }
    if field.act != RowAct::Edit {
        let style = if chosen.is_some() { name } else { theme.accent() };
        let hint = if field.act == RowAct::Add { "Enter " } else { "" };
        to.put_right(hint, columns(&field.label) + 2, style);
        to.put(" ", style).put(&field.label, style.add_modifier(Modifier::BOLD));
        return None;
    }
    let indent = 1 + 2 * field.property.depth;
    to.skip(indent.min(labels));
    // The number's name within a list is never cut.
    let room = labels.saturating_sub(indent);
    let (list, number) = match field.component.and(field.label.rfind('.')) {
        Some(at) if columns(&field.label) > room => field.label.split_at(at),
        _ => (field.label.as_str(), ""),
    };
    let number_room = columns(number).min(room);
    to.put_wide(list, room - number_room, name).put_wide(number, number_room, name).skip(2);
    if let Some(editor) = chosen.and_then(|state| state.editor.as_ref()) {
        return typed(editor, &mut to);
    }
    let needed = columns(&brief(&field.value)) + columns(field.property.unit) + BAR + 4;
    if let Some([full, rest]) = bar(field).filter(|_| to.left() >= needed) {
        let color = match (field.property.widget, field.component) {
            (Widget::Color, Some(i)) => theme.swatch(CHANNELS[i.min(2)]),
            _ => None,
        };
        let color = if chosen.is_some() { name } else { color.unwrap_or(theme.accent()) };
        to.put_right(" ", 0, name).put_right(&rest, 0, name).put_right(&full, 0, color);
    }
    let swatch = field.swatch.and_then(|color| theme.swatch(Display::default().to_8()(color)));
    if let Some(style) = swatch {
        to.put_right(" ", 0, name).put_right("██", 4, style).put_right(" ", 4, name);
    }
    let words = matches!(field.property.widget, Widget::Choice | Widget::Kind | Widget::Switch);
    match field.value.as_str() {
        "" => to.put("–", theme.dim()),
        word if words && chosen.is_some() => to.put(&format!("‹ {word} ›"), value),
        given => to.put(&brief(given), value),
    };
    let shows_unit = chosen.is_some() || field.property.unit != LENGTH;
    let fits = to.left() >= columns(field.property.unit) + 2;
    if shows_unit && fits && !field.property.unit.is_empty() && !field.value.is_empty() {
        to.put(" ", name).put(field.property.unit, name);
    }
    None
}

/// Columns of the bar that shows where a number is in its range.
const BAR: usize = 6;
/// Colours of the bars of red, green and blue.
const CHANNELS: [[u8; 3]; 3] = [[232, 98, 98], [110, 178, 98], [98, 140, 242]];

/// Returns the filled and the empty part of the bar that shows where the number of `field` is in its
/// usual range; `None` without one.
fn bar(field: &FieldLine) -> Option<[String; 2]> {
    let [low, high] = field.property.range?;
    let value: f64 = field.value.parse().ok()?;
    let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
    let full = (share * BAR as f64).round() as usize;
    Some(["━".repeat(full), "─".repeat(BAR - full)])
}

/// Draws help on a field: the reason why a value was refused, or what is valid.
fn explain(field: &FieldLine, problem: Option<&str>, area: Rect, painter: &mut Painter) {
    let theme = painter.theme;
    let styles = match problem {
        Some(_) => [theme.bad(); 2],
        None => [theme.dim(), theme.dim().add_modifier(Modifier::ITALIC)],
    };
    let texts: Vec<_> = field.help(problem).into_iter().zip(styles).collect();
    painter.paragraphs(area.inner(Margin::new(1, 0)), &texts);
}

/// Draws a heading, and a horizontal line from there to the column before the last.
fn heading(mut to: Row, title: &str) {
    let theme = to.theme;
    to.put(" ", theme.heading()).put(title, theme.heading()).put(" ", theme.heading());
    let left = to.left().saturating_sub(1);
    to.put(&"─".repeat(left), theme.border(false));
}

/// Draws the text of `editor` in the row. Returns the position of the text cursor, or `None` if
/// there is no room.
pub fn typed(editor: &Editor, to: &mut Row) -> Option<Position> {
    let width = to.left().saturating_sub(1);
    if width == 0 {
        return None;
    }
    let hidden = editor.input.visual_scroll(width);
    let style = Style::new().add_modifier(Modifier::UNDERLINED).patch(match editor.problem {
        Some(_) => to.theme.bad(),
        None if editor.untouched => to.theme.accent().add_modifier(Modifier::REVERSED),
        None => to.theme.accent(),
    });
    let (x, y) = (to.x, to.y);
    to.put_wide(skip(editor.text(), hidden), width, style);
    let column = editor.input.visual_cursor().saturating_sub(hidden).min(width) as u16;
    Some(Position { x: x + column, y })
}

/// Shortens a long number to six significant digits.
fn brief(value: &str) -> Cow<'_, str> {
    /// Largest length of a number that is shown with all its digits.
    const SHORT: usize = 9;
    match value.parse::<f64>() {
        Ok(x) if value.len() > SHORT && x.is_finite() => number(round_significant(x, 6)).into(),
        _ => value.into(),
    }
}
