//! Drawing of properties and their values.

use crate::dashboard::text::{columns, skip};
use crate::dashboard::view::is_active;
use crate::dashboard::view::painter::{Painter, Row, VisibleLine};
use crate::dashboard::{Editor, FieldLine, FieldList, Focus, Layout, Model, PanelLine};
use ratatui::layout::{Margin, Position, Rect};
use ratatui::style::{Modifier, Style};
use std::borrow::Cow;
use zerkalo_render::film::Display;
use zerkalo_scene::edit::{Property, Widget};
use zerkalo_scene::value::{number, round_significant};

/// Unit of nearly all numbers, therefore shown only for the property under the cursor.
const LENGTH: &str = "scene units";

/// List of properties, and its areas.
pub struct Fields<'a> {
    pub lines: &'a [PanelLine],
    pub list: Rect,
    pub help: Rect,
    pub state: &'a FieldList,
    /// Reason why a change by arrow keys was refused. One of the text editor is shown instead.
    pub problem: Option<&'a str>,
    pub active: bool,
}

/// Draws the inspector. Returns the position of the text cursor.
pub fn inspector(model: &Model, layout: &Layout, painter: &mut Painter) -> Option<Position> {
    let area = layout.inspector?;
    let (list, help) = model.inspector_rows()?;
    let active = is_active(model, Focus::Inspector);
    painter.panel(area, &model.selection.title(model.scene()), active);
    let lines = model.field_lines();
    let fields =
        Fields { lines: &lines, list, help, state: &model.inspector, problem: None, active };
    fields.draw(painter)
}

impl Fields<'_> {
    /// Draws the list. Returns the position of the text cursor.
    pub fn draw(&self, painter: &mut Painter) -> Option<Position> {
        let label = |line: &PanelLine| {
            line.entry().map_or(0, |f| 1 + 2 * f.property.depth + columns(&f.label))
        };
        let widest = self.lines.iter().map(label).max().unwrap_or(0);
        let labels = widest.min(usize::from(self.list.width) * 9 / 20);
        let mut typing = None;
        let border = painter.theme.border(self.active);
        let visible = painter.window(self.list, self.state.scroll, self.lines.len(), border);
        for VisibleLine { row, index } in visible {
            let to = painter.row(self.list, row);
            match &self.lines[index] {
                PanelLine::Heading(title) => heading(to, title),
                PanelLine::Entry(field) => {
                    let chosen = self.active && index == self.state.cursor;
                    let position = self.field(field, chosen, labels, to);
                    typing = typing.or(position);
                }
            }
        }
        if self.active {
            self.say(painter);
        }
        typing
    }

    fn field(
        &self,
        field: &FieldLine,
        chosen: bool,
        labels: usize,
        mut to: Row,
    ) -> Option<Position> {
        let theme = to.theme;
        let (name, value) = match (chosen, field.property.is_default) {
            (true, _) => (theme.selected(true), theme.selected(true)),
            (false, true) => (theme.dim(), theme.dim()),
            (false, false) => (theme.dim(), theme.text()),
        };
        if chosen {
            to.fill(name);
        }
        let indent = 1 + 2 * field.property.depth;
        to.skip(indent.min(labels));
        to.put_wide(&field.label, labels.saturating_sub(indent), name).skip(2);
        if let Some(editor) = self.state.editor.as_ref().filter(|_| chosen) {
            return typed(editor, &mut to);
        }
        let swatch =
            field.swatch.and_then(|color| theme.swatch(Display::default().levels_8(color)));
        if let Some(style) = swatch {
            to.put_right(" ", 0, name).put_right("██", 4, style).put_right(" ", 4, name);
        }
        let words = matches!(field.property.entry, Widget::Choice | Widget::Kind | Widget::Switch);
        match field.value.as_str() {
            "" => to.put("–", theme.dim()),
            words_value if words && chosen => {
                to.put("‹ ", value).put(words_value, value).put(" ›", value)
            }
            given => to.put(&brief(given), value),
        };
        let shows_unit = chosen || field.property.unit != LENGTH;
        let fits = to.left() >= columns(field.property.unit) + 2;
        if shows_unit && fits && !field.property.unit.is_empty() && !field.value.is_empty() {
            let unit = if chosen { name } else { theme.dim() };
            to.put(" ", unit).put(field.property.unit, unit);
        }
        None
    }

    /// Draws help on the property under the cursor: why a value was refused, or what is valid.
    fn say(&self, painter: &mut Painter) {
        let theme = painter.theme;
        let Some(field) = self.lines.get(self.state.cursor).and_then(PanelLine::entry) else {
            return;
        };
        let problem =
            self.state.editor.as_ref().and_then(|e| e.problem.as_deref()).or(self.problem);
        let mut texts = match problem {
            Some(problem) => vec![(problem.to_string(), theme.bad())],
            None => vec![
                (field.property.doc.to_string(), theme.dim()),
                (expected(&field.property), theme.dim().add_modifier(Modifier::ITALIC)),
            ],
        };
        texts.retain(|(text, _)| !text.is_empty());
        painter.paragraphs(self.help.inner(Margin::new(1, 0)), &texts);
    }
}

/// Describes valid values, with the default if the present value is another.
fn expected(property: &Property) -> String {
    match &property.default {
        Some(default) if !default.is_empty() && !property.is_default => {
            format!("{}; default {default}", property.expected)
        }
        _ => property.expected.clone(),
    }
}

/// Draws a heading with a line up to the last column but one.
pub fn heading(mut to: Row, title: &str) {
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
