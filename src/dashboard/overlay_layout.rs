//! Layout of overlays and of rows in panels, shared by drawing and mouse handling.

use crate::dashboard::noise_targets::ABOUT;
use crate::dashboard::text::{columns, wrapped_rows};
use crate::dashboard::{
    BORDER, FieldList, Focus, Form, Layout, Model, Overlay, PanelLine, PickEntry,
};
use ratatui::layout::Rect;
use zerkalo_render::session::QUALITIES;

/// Areas of an overlay. Unused areas are empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OverlayLayout {
    /// Whole overlay with its border.
    pub frame: Rect,
    /// Row of the text input.
    pub input: Rect,
    /// Area of a list or of a form's fields.
    pub list: Rect,
    /// Area of help, of the text of a question, or of the reason why an input was refused.
    pub help: Rect,
}

impl Model {
    /// Returns the layout of the open overlay; `None` without one, or if the terminal is too small.
    pub fn overlay_layout(&self) -> Option<OverlayLayout> {
        let layout = self.layout()?;
        let [width, height] = self.screen;
        let centred = |wide: u16, rows: u16| {
            // Status line and hint line stay visible.
            let (columns, rows) = (wide.min(width), rows.min(height - 2));
            let [x, y] = [(width - columns) / 2, (height - 2 - rows) / 2];
            Rect { x, y, width: columns, height: rows }
        };
        let low = |columns: u16, rows: u16| {
            let y = height.saturating_sub(3 + rows);
            Rect { y, ..centred(columns, rows) }
        };
        Some(match self.overlay.as_ref()? {
            Overlay::ViewerImage(_) => OverlayLayout {
                frame: Rect { x: 0, y: 0, width, height },
                ..OverlayLayout::default()
            },
            Overlay::NoiseTargets(_) => {
                let columns = 76.min(width - 2);
                let about = wrapped_rows(ABOUT, columns - 5);
                let frame = low(columns, QUALITIES.len() as u16 + 2 + about);
                let (list, below) = divided(frame.inner(BORDER), QUALITIES.len() as u16);
                let help = Rect { x: below.x + 3, width: below.width - 3, ..below };
                OverlayLayout { frame, input: Rect::default(), list, help }
            }
            Overlay::Pick(pick) => {
                // Descriptions are cut only where there is no room for them.
                let widest = |of: fn(&PickEntry) -> &str| {
                    pick.entries.iter().map(|entry| columns(of(entry))).max().unwrap_or(0)
                };
                let wide = widest(|e| &e.name) + widest(|e| &e.note) + widest(|e| &e.keys) + 12;
                let rows = (pick.entries.len() as u16).saturating_add(3);
                let wide = u16::try_from(wide).unwrap_or(width).clamp(84, 160);
                // A border one column beside that of the panels would look double.
                let frame = centred(if wide + 2 < width { wide } else { width }, rows);
                let (input, list) = divided(frame.inner(BORDER), 1);
                OverlayLayout { frame, input, list, help: Rect::default() }
            }
            Overlay::Form(form) => self.form_layout(&layout, form),
            Overlay::Prompt(prompt) => {
                let columns = 64.min(width - 2);
                let text = prompt.editor.problem.as_ref().unwrap_or(&prompt.help);
                let rows = wrapped_rows(text, columns - 2);
                let frame = low(columns, rows + 3);
                let (input, help) = divided(frame.inner(BORDER), 1);
                OverlayLayout { frame, input, list: Rect::default(), help }
            }
            Overlay::Question(question) => {
                let columns = 64.min(width - 2);
                let answers = question.answers.len() as u16;
                let rows = wrapped_rows(&question.text, columns - 4);
                let frame = low(columns, rows + answers + 2);
                let inner = frame.inner(BORDER);
                let (text, list) = divided(inner, inner.height.saturating_sub(answers));
                let help = Rect { x: text.x + 1, width: text.width - 2, ..text };
                OverlayLayout { frame, input: Rect::default(), list, help }
            }
        })
    }

    fn form_layout(&self, layout: &Layout, form: &Form) -> OverlayLayout {
        let [width, height] = self.screen;
        // The form leaves the picture visible, which previews the new object or light.
        let side = layout.inspector.or(layout.outline).map_or(38, |side| side.width);
        let columns = side.min(width);
        let frame = Rect { x: width - columns, y: 0, width: columns, height: height - 2 };
        let (list, help) = self.split_fields(frame.inner(BORDER), &form.fields);
        OverlayLayout { frame, input: Rect::default(), list, help }
    }

    /// Returns the area of the lines of the list whose cursor the keys move; `None` if it is hidden.
    pub fn list_rows(&self) -> Option<Rect> {
        match (&self.overlay, self.focus) {
            (Some(_), _) => Some(self.overlay_layout()?.list),
            (None, _) if self.watch.is_some() => Some(self.watch_rows()?.0),
            (None, Focus::Outline) => self.outline_rows(),
            (None, Focus::Picture | Focus::Inspector) => Some(self.inspector_rows()?.0),
        }
    }

    /// Returns the area of the lines of the outline; `None` if it is hidden.
    pub fn outline_rows(&self) -> Option<Rect> {
        self.layout()?.outline.map(|area| area.inner(BORDER))
    }

    /// Returns the area of the rows of watched files, and the area of details on the row under the
    /// cursor. Returns `None` if the panel is hidden.
    pub fn watch_rows(&self) -> Option<(Rect, Rect)> {
        let inner = self.layout()?.outline?.inner(BORDER);
        let details = if inner.height >= 10 { 5 } else { 0 };
        // The first row has the titles of the columns.
        let (_, below) = divided(inner, 1);
        Some(divided(below, below.height.saturating_sub(details)))
    }

    /// Returns the area of the inspector's lines, and the area of help on the field under the
    /// cursor. Returns `None` if the inspector is hidden.
    pub fn inspector_rows(&self) -> Option<(Rect, Rect)> {
        let area = self.layout()?.inspector?;
        Some(self.split_fields(area.inner(BORDER), &self.inspector))
    }

    /// Divides the inside of a panel into the lines `list` and help on the line under the cursor,
    /// which gets rows that the lines do not need.
    fn split_fields(&self, inner: Rect, list: &FieldList) -> (Rect, Rect) {
        let (lines, help) = split(inner, list.problem().is_some());
        let shown = self.field_lines();
        let field = shown.get(list.cursor).and_then(PanelLine::entry);
        let width = inner.width.saturating_sub(2);
        let texts = field.map_or_else(Vec::new, |field| field.help(list.problem()));
        let needed: u16 = texts.iter().map(|text| wrapped_rows(text, width)).sum();
        let free = inner.height.saturating_sub(u16::try_from(shown.len()).unwrap_or(u16::MAX));
        let rows = if help.height == 0 { 0 } else { help.height.max(needed.min(free)) };
        divided(inner, lines.height + help.height - rows)
    }
}

/// Splits the inside of a panel into an area for lines and one for help below. `problem` is `true`
/// if the help includes the reason why an input was refused.
fn split(inner: Rect, problem: bool) -> (Rect, Rect) {
    let rows = match (inner.height, problem) {
        (0..4, _) => 0,
        (_, true) => (inner.height / 2).min(5),
        (0..8, _) => 0,
        (8..14, _) => 2,
        _ => 3,
    };
    divided(inner, inner.height - rows)
}

/// Divides `area` into its first `rows` rows and the rest.
fn divided(area: Rect, rows: u16) -> (Rect, Rect) {
    let upper = Rect { height: rows.min(area.height), ..area };
    let height = area.height - upper.height;
    (upper, Rect { y: area.y + upper.height, height, ..area })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panel_splits_into_lines_and_help() {
        for height in 0..40 {
            for problem in [false, true] {
                let inner = Rect { x: 3, y: 2, width: 20, height };
                let (lines, help) = split(inner, problem);
                assert_eq!(lines.height + help.height, height);
                assert_eq!(help.y, inner.y + lines.height);
                assert!(lines.height >= height / 2);
            }
        }
    }
}
