//! Drawing of fields and their values, in the inspector and in forms.

use crate::dashboard::editor::Editor;
use crate::dashboard::layout::{Focus, Layout};
use crate::dashboard::model::Model;
use crate::dashboard::overlay_layout::wrapped;
use crate::dashboard::panel_lines::{FieldLine, PanelLine};
use crate::dashboard::view::frame::{panel, scroll_mark};
use crate::dashboard::view::is_active;
use crate::dashboard::view::text::{Row, columns, skip};
use crate::dashboard::view::theme::Theme;
use crate::film::Display;
use crate::scene::edit::Widget;
use crate::terminal::Area;
use crate::value::{number, round_significant};
use ratatui::buffer::Buffer;
use ratatui::layout::Position;
use ratatui::style::{Modifier, Style};
use std::borrow::Cow;

/// Unit of lengths. Nearly all numbers have this unit; it is therefore shown only for the field
/// under the cursor.
const LENGTH: &str = "scene units";

/// A list of fields and the areas that it is drawn in.
pub struct Fields<'a> {
    /// Headings and fields.
    pub lines: &'a [PanelLine],
    /// Area of the lines.
    pub list: Area,
    /// Area of the help on the field under the cursor.
    pub help: Area,
    /// Index of the line under the cursor.
    pub cursor: usize,
    /// Index of the first visible line.
    pub scroll: usize,
    /// Text editor of the field under the cursor, if one is open.
    pub editor: Option<&'a Editor>,
    /// Reason why the last step of a field was refused. It is shown unless the editor has a reason
    /// of its own.
    pub problem: Option<&'a str>,
    /// `true` if the fields receive the keys.
    pub active: bool,
}

/// Draws the inspector, or nothing if the panel is folded. Returns the position of the text cursor,
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
    let fields = Fields {
        lines: &lines,
        list,
        help,
        cursor: model.inspector.cursor,
        scroll: model.inspector.scroll,
        editor: model.inspector.editor.as_ref(),
        problem: None,
        active,
    };
    fields.draw(theme, buffer)
}

impl Fields<'_> {
    /// Draws the fields. Returns the position of the text cursor, or `None` if the cursor is
    /// hidden.
    pub fn draw(&self, theme: &Theme, buffer: &mut Buffer) -> Option<Position> {
        let rows = usize::from(self.list.height);
        let first = self.scroll.min(self.lines.len().saturating_sub(rows));
        let label =
            |line: &PanelLine| line.field().map_or(0, |f| 1 + 2 * f.depth + columns(&f.label));
        let widest = self.lines.iter().map(label).max().unwrap_or(0);
        let labels = widest.min(usize::from(self.list.width) * 9 / 20);
        let mut typing = None;
        for (row, (i, line)) in (0..).zip(self.lines.iter().enumerate().skip(first).take(rows)) {
            let to = Row::new(buffer, self.list, row);
            match line {
                PanelLine::Heading(title) => heading(to, title, theme),
                PanelLine::Field(field) => {
                    let position = self.field(field, i == self.cursor, labels, to, theme);
                    typing = typing.or(position);
                }
            }
        }
        let window = (first, rows, self.lines.len());
        scroll_mark(self.list, window, theme.border(self.active), buffer);
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
        let (name, value) = match (chosen, field.is_default) {
            (true, _) => (theme.selected(true), theme.selected(true)),
            (false, true) => (theme.dim(), theme.dim()),
            (false, false) => (theme.dim(), theme.text()),
        };
        if chosen {
            to.fill(name);
        }
        let indent = 1 + 2 * field.depth;
        to.skip(indent.min(labels));
        to.put_wide(&field.label, labels.saturating_sub(indent), name).skip(2);
        if let Some(editor) = self.editor.filter(|_| chosen) {
            return typed(editor, &mut to, theme);
        }
        let swatch = field.swatch.and_then(|color| theme.swatch(Display::default().codes_8(color)));
        if let Some(style) = swatch {
            to.put_right(" ", 0, name).put_right("██", 4, style).put_right(" ", 4, name);
        }
        let words = matches!(field.entry, Widget::Choice | Widget::Kind | Widget::Switch);
        match field.value.as_str() {
            "" => to.put("–", theme.dim()),
            words_value if words && chosen => {
                to.put("‹ ", value).put(words_value, value).put(" ›", value)
            }
            given => to.put(&brief(given), value),
        };
        let shows_unit = chosen || field.unit != LENGTH;
        let fits = to.left() >= columns(field.unit) + 2;
        if shows_unit && fits && !field.unit.is_empty() && !field.value.is_empty() {
            let unit = if chosen { name } else { theme.dim() };
            to.put(" ", unit).put(field.unit, unit);
        }
        None
    }

    /// Draws help on the field under the cursor: the reason for a refusal if there is one,
    /// otherwise the field's description and valid input.
    fn say(&self, theme: &Theme, buffer: &mut Buffer) {
        let Some(field) = self.lines.get(self.cursor).and_then(PanelLine::field) else { return };
        let width = self.help.width.saturating_sub(2);
        let problem = self.editor.and_then(|e| e.problem.as_deref()).or(self.problem);
        let texts = match problem {
            Some(problem) => vec![(problem.to_string(), theme.bad())],
            None => vec![
                (field.doc.to_string(), theme.dim()),
                (expected(field), theme.dim().add_modifier(Modifier::ITALIC)),
            ],
        };
        let lines = texts.iter().flat_map(|(text, style)| {
            let lines = if text.is_empty() { Vec::new() } else { wrapped(text, width) };
            lines.into_iter().map(move |line| (line, *style))
        });
        for (row, (line, style)) in (0..self.help.height).zip(lines) {
            Row::new(buffer, self.help, row).put(" ", style).put(&line, style);
        }
    }
}

/// Returns a description of a field's valid input and, if the field has another value, of its
/// default value.
fn expected(field: &FieldLine) -> String {
    match &field.default {
        Some(default) if !default.is_empty() && !field.is_default => {
            format!("{}; default {default}", field.expected)
        }
        _ => field.expected.clone(),
    }
}

fn heading(mut to: Row, title: &str, theme: &Theme) {
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
    let hidden = editor.scroll_columns(width);
    let style = Style::new().add_modifier(Modifier::UNDERLINED).patch(match editor.problem {
        Some(_) => theme.bad(),
        None => theme.accent(),
    });
    let (x, y) = (to.x(), to.y());
    to.put_wide(skip(editor.text(), hidden), width, style);
    let column = editor.cursor_columns().saturating_sub(hidden).min(width) as u16;
    Some(Position { x: x + column, y })
}

/// Rounds a number with many digits to six significant digits, for display outside of the text
/// editor.
fn brief(value: &str) -> Cow<'_, str> {
    /// Largest length of a number, in characters, that is shown with all its digits.
    const SHORT: usize = 9;
    match value.parse::<f64>() {
        Ok(x) if value.len() > SHORT && x.is_finite() => number(round_significant(x, 6)).into(),
        _ => value.into(),
    }
}
