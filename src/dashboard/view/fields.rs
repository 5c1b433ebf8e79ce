//! Drawing of properties and their values, in the inspector and in forms.

use crate::dashboard::editor::Editor;
use crate::dashboard::layout::{Focus, Layout};
use crate::dashboard::model::{FieldList, Model};
use crate::dashboard::panel_lines::{FieldLine, PanelLine};
use crate::dashboard::view::frame::{panel, window};
use crate::dashboard::view::is_active;
use crate::dashboard::view::text::{Row, columns, paragraphs, skip};
use crate::dashboard::view::theme::Theme;
use ratatui::buffer::Buffer;
use ratatui::layout::{Margin, Position, Rect};
use ratatui::style::{Modifier, Style};
use std::borrow::Cow;
use zerkalo_render::film::Display;
use zerkalo_scene::edit::{Property, Widget};
use zerkalo_scene::value::{number, round_significant};

/// Name of the unit of lengths. Nearly all numbers have this unit; it is therefore shown only for
/// the property under the cursor.
const LENGTH: &str = "scene units";

/// List of properties, and the areas in which it is drawn.
pub struct Fields<'a> {
    /// Headings and properties, as lines.
    pub lines: &'a [PanelLine],
    /// Area of the lines of the property list.
    pub list: Rect,
    /// Area of the help on the property under the cursor.
    pub help: Rect,
    /// Cursor, scroll position and text editor of the property list.
    pub state: &'a FieldList,
    /// Reason why the last change of a value by arrow keys was refused; `None` if it was accepted.
    /// If the text editor has a reason of its own, the editor's reason is shown instead.
    pub problem: Option<&'a str>,
    /// `true` if the list receives the keys.
    pub active: bool,
}

/// Draws the inspector, or nothing if the panel is hidden. Returns the position of the text cursor,
/// or `None` if the cursor is hidden.
pub fn inspector(
    model: &Model,
    layout: &Layout,
    theme: &Theme,
    buffer: &mut Buffer,
) -> Option<Position> {
    let area = layout.inspector?;
    let (list, help) = model.inspector_rows()?;
    let active = is_active(model, Focus::Inspector);
    panel(area, &model.selection.title(model.scene()), active, theme, buffer);
    let lines = model.field_lines();
    let fields =
        Fields { lines: &lines, list, help, state: &model.inspector, problem: None, active };
    fields.draw(theme, buffer)
}

impl Fields<'_> {
    /// Draws the list of properties. Returns the position of the text cursor, or `None` if the
    /// cursor is hidden.
    pub fn draw(&self, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let label = |line: &PanelLine| {
            line.entry().map_or(0, |f| 1 + 2 * f.property.depth + columns(&f.label))
        };
        let widest = self.lines.iter().map(label).max().unwrap_or(0);
        let labels = widest.min(usize::from(self.list.width) * 9 / 20);
        let mut typing = None;
        let border = theme.border(self.active);
        for (row, i) in window(self.list, self.state.scroll, self.lines.len(), border, buffer) {
            let to = Row::new(buffer, self.list, row);
            match &self.lines[i] {
                PanelLine::Heading(title) => heading(to, title, theme),
                PanelLine::Entry(field) => {
                    let position = self.field(field, i == self.state.cursor, labels, to, theme);
                    typing = typing.or(position);
                }
            }
        }
        if self.active {
            self.say(theme, buffer);
        }
        typing
    }

    fn field(
        &self,
        field: &FieldLine,
        chosen: bool,
        labels: usize,
        mut to: Row,
        theme: &Theme,
    ) -> Option<Position> {
        let chosen = chosen && self.active;
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
            return typed(editor, &mut to, theme);
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

    /// Draws help on the property under the cursor. If a new value of the property was refused, the
    /// help is the reason. Otherwise it is the property's description and a description of its
    /// valid values.
    fn say(&self, theme: &Theme, buffer: &mut Buffer) {
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
        paragraphs(self.help.inner(Margin::new(1, 0)), &texts, buffer);
    }
}

/// Returns a description of a property's valid values. If the present value is not the default, the
/// description includes the default.
fn expected(property: &Property) -> String {
    match &property.default {
        Some(default) if !default.is_empty() && !property.is_default => {
            format!("{}; default {default}", property.expected)
        }
        _ => property.expected.clone(),
    }
}

/// Draws the heading `title` with a line up to the last column but one of the row `to`.
pub fn heading(mut to: Row, title: &str, theme: &Theme) {
    to.put(" ", theme.heading()).put(title, theme.heading()).put(" ", theme.heading());
    let left = to.left().saturating_sub(1);
    to.put(&"─".repeat(left), theme.border(false));
}

/// Draws the text of `editor` in the free columns of the row `to`. Returns the position of the text
/// cursor, or `None` if there is no room.
pub fn typed(editor: &Editor, to: &mut Row, theme: &Theme) -> Option<Position> {
    let width = to.left().saturating_sub(1);
    if width == 0 {
        return None;
    }
    let hidden = editor.input.visual_scroll(width);
    let style = Style::new().add_modifier(Modifier::UNDERLINED).patch(match editor.problem {
        Some(_) => theme.bad(),
        None => theme.accent(),
    });
    let (x, y) = (to.x, to.y);
    to.put_wide(skip(editor.text(), hidden), width, style);
    let column = editor.input.visual_cursor().saturating_sub(hidden).min(width) as u16;
    Some(Position { x: x + column, y })
}

/// Returns `value` as it is displayed outside of the text editor: a number with many digits is
/// rounded to six significant ones, any other text is unchanged.
fn brief(value: &str) -> Cow<'_, str> {
    /// Largest length of a number, in characters, up to which it is shown with all its digits.
    /// Longer numbers are rounded.
    const SHORT: usize = 9;
    match value.parse::<f64>() {
        Ok(x) if value.len() > SHORT && x.is_finite() => number(round_significant(x, 6)).into(),
        _ => value.into(),
    }
}
