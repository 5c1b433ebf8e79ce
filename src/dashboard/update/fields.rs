//! Commands on the properties in the inspector and in forms.

use crate::dashboard::panel_lines::{MATERIAL, RowAct, walked};
use crate::dashboard::update::Coalesce;
use crate::dashboard::{Editor, FieldLine, KeyContext, Overlay, PanelLine, UpdateContext};
use zerkalo_scene::edit::{self, Edit, EditError, Widget, Word};
use zerkalo_scene::value::{number, round_significant};

/// Returns the result of `text`, a number, one of `* / + -` and another number. Without the first
/// number, or with `=` after the sign, it is `present`; a minus sign then needs the `=`, because
/// `-1` is a number. Returns `None` if `text` is no calculation.
fn calculated(text: &str, present: f64) -> Option<f64> {
    let result = text.char_indices().find_map(|(i, sign)| {
        let (left, right) = (text[..i].trim(), &text[i + sign.len_utf8()..]);
        let relative = right.strip_prefix('=');
        let left = match left {
            "" if sign != '-' || relative.is_some() => present,
            _ if relative.is_some() => return None,
            left => left.parse().ok()?,
        };
        let right: f64 = relative.unwrap_or(right).trim().parse().ok()?;
        Some(match sign {
            '*' => left * right,
            '/' => left / right,
            '+' => left + right,
            '-' => left - right,
            _ => return None,
        })
    });
    result.map(|x| round_significant(x, 12))
}

impl UpdateContext<'_> {
    fn set_editor(&mut self, editor: Option<Editor>) {
        let fields = self.model.field_list_mut();
        (fields.editor, fields.refusal) = (editor, None);
    }

    pub(super) fn move_field_cursor(&mut self, steps: isize) {
        let lines = self.model.field_lines();
        let cursor = &mut self.model.field_list_mut().cursor;
        *cursor = walked(&lines, *cursor, steps);
    }

    /// Returns the line under the cursor of the open form or inspector; `None` for a heading.
    fn row(&self) -> Option<FieldLine> {
        let lines = self.model.field_lines();
        Some(*lines.get(self.model.field_list().cursor)?.entry()?.clone())
    }

    /// Returns the property under the cursor; `None` on a row without one.
    pub(super) fn field(&self) -> Option<FieldLine> {
        self.row().filter(|row| row.act == RowAct::Edit)
    }

    /// Moves the cursor of the inspector from the first line to the first one that Left and Right
    /// step, if there is one.
    pub(super) fn skip_text(&mut self) {
        if self.model.context() != KeyContext::Inspector || self.model.inspector.cursor != 0 {
            return;
        }
        let steps = |line: &PanelLine| {
            let widget = line.entry().map(|row| row.property.widget);
            matches!(widget, Some(Widget::Numbers | Widget::Switch))
        };
        self.model.inspector.cursor = self.model.field_lines().iter().position(steps).unwrap_or(0);
    }

    /// Confirms what is being typed, or carries out Enter on the row under the cursor. In a form, a
    /// confirmed value leads on to the next row.
    pub(super) fn open_row(&mut self) {
        if self.end_filter() {
            return;
        }
        if self.model.field_list().editor.is_some() {
            if self.apply_field() && self.in_form() {
                self.move_field_cursor(1);
            }
            return;
        }
        match self.row().map(|row| row.act) {
            Some(RowAct::Edit) => self.open_field(),
            Some(RowAct::Add) => self.confirm_form(),
            Some(RowAct::Unfold) => drop(self.model.folded.remove(MATERIAL)),
            Some(RowAct::Fold) => {
                let list = self.model.field_list_mut();
                list.unfolded = !list.unfolded;
            }
            None => {}
        }
    }

    /// Folds or unfolds the group of the field under the cursor.
    pub(super) fn fold_group(&mut self) {
        let Some((group, first)) = self.model.field_group() else {
            return self.say("This field has no group");
        };
        if !self.model.folded.remove(&group) {
            self.model.folded.insert(group);
            self.model.field_list_mut().cursor = first;
        }
    }

    /// Opens a text editor for the property under the cursor, with the character `c` in it.
    pub(super) fn type_value(&mut self, c: char) {
        self.set_editor(Some(Editor::new(c)));
    }

    /// Opens the property under the cursor: a switch is toggled, a choice outside a form opens its
    /// list, and any other property opens a text editor with the present value.
    pub(super) fn open_field(&mut self) {
        let Some(field) = self.field() else { return };
        let words = field.property.words;
        if field.property.widget == Widget::Switch {
            self.step_field(1.0);
        } else if !words.is_empty() && !self.in_form() {
            let cursor = words.iter().position(|word| word.name == field.value);
            self.open_pick(field.label, words, cursor.unwrap_or(0), |c, word| c.fill_field(word));
        } else {
            self.set_editor(Some(Editor::replacing(field.value)));
        }
    }

    /// Starts to filter the lines by words, of which `text` is the beginning.
    pub(super) fn open_filter(&mut self, text: impl Into<String>) {
        self.model.field_list_mut().filter = Some(Editor::new(text));
        self.search();
    }

    /// Ends the filter, with the cursor on the line that it has found. Returns `false` if the lines
    /// are not filtered.
    pub(super) fn end_filter(&mut self) -> bool {
        if !matches!(self.model.overlay, None | Some(Overlay::Form(_))) {
            return false;
        }
        let found = self.row();
        let filtered = self.model.field_list_mut().filter.take().is_some();
        if let Some(row) = found.filter(|_| filtered) {
            self.show_row(|line| line.is_same(&row));
        }
        filtered
    }

    /// Moves the cursor to the first line for which `is_wanted` is `true`, and unfolds the list if
    /// the line is hidden. Returns `false` if there is no such line.
    pub(super) fn show_row(&mut self, is_wanted: impl Fn(&FieldLine) -> bool) -> bool {
        let folded = !self.model.field_list().unfolded;
        let groups = self.model.folded.clone();
        for unfolded in [!folded, true] {
            if unfolded {
                self.model.folded.clear();
            }
            self.model.field_list_mut().unfolded = unfolded;
            let lines = self.model.field_lines();
            let wanted = |line: &PanelLine| line.entry().is_some_and(|entry| is_wanted(entry));
            if let Some(at) = lines.iter().position(wanted) {
                self.model.field_list_mut().cursor = at;
                return true;
            }
        }
        self.model.field_list_mut().unfolded = !folded;
        self.model.folded = groups;
        false
    }

    /// Completes the word that is being typed. Without one, confirms the value and moves the cursor
    /// by `by` groups.
    pub(super) fn next_group(&mut self, by: isize) {
        self.end_filter();
        if let (Some(field), Some(editor)) = (self.field(), &mut self.model.field_list_mut().editor)
        {
            let text = editor.text().to_lowercase();
            let begun = |word: &&Word| !text.is_empty() && word.name.starts_with(&text);
            let word = field.property.words.iter().find(begun);
            if let Some(word) = word.filter(|word| word.name != text) {
                *editor = Editor::new(word.name.clone());
                return;
            }
        }
        if !self.apply_field() {
            return;
        }
        let lines = self.model.field_lines();
        let cursor = &mut self.model.field_list_mut().cursor;
        let begins = |i: &usize| {
            let before = i.checked_sub(1).map(|i| lines[i].entry());
            let apart = |row: Option<&Box<FieldLine>>| row.is_none_or(|row| row.act == RowAct::Add);
            lines[*i].entry().is_some() && before.is_none_or(apart)
        };
        let starts: Vec<_> = (0..lines.len()).filter(begins).collect();
        let group = starts.iter().rposition(|start| *start <= *cursor).unwrap_or(0) as isize;
        if !starts.is_empty() {
            *cursor = starts[(group + by).rem_euclid(starts.len() as isize) as usize];
        }
    }

    pub(super) fn in_form(&self) -> bool {
        matches!(self.model.overlay, Some(Overlay::Form(_)))
    }

    /// Applies the typed value and closes the text editor. Returns `false` if the value is not
    /// valid; the editor then shows the reason.
    pub(super) fn apply_field(&mut self) -> bool {
        let Some(field) = self.field() else {
            self.set_editor(None);
            return true;
        };
        let Some(editor) = &self.model.field_list().editor else { return true };
        let text = editor.text().trim().to_string();
        if text == field.value {
            self.set_editor(None);
            return true;
        }
        match self.set_field(&field, &text) {
            Ok(edit) => {
                self.set_editor(None);
                self.record(edit, Coalesce::Single);
                true
            }
            Err(error) => {
                if let Some(editor) = &mut self.model.field_list_mut().editor {
                    editor.problem = Some(error.to_string());
                }
                false
            }
        }
    }

    /// Returns the edit that sets the property or number in the line `field`. For one number,
    /// `text` may be a calculation. For one number of a list, it may also be the whole list, or a
    /// colour.
    pub(super) fn set_field(&self, field: &FieldLine, text: &str) -> Result<Edit, EditError> {
        let scene = self.scene();
        let is_number = matches!(field.property.widget, Widget::Numbers | Widget::Color);
        let result = field.value.parse().ok().and_then(|present| calculated(text, present));
        let result = result.filter(|_| is_number).map(number);
        let text = result.as_deref().unwrap_or(text);
        let is_word = |c: char| c.is_alphabetic() && c != 'e' && c != 'E';
        let whole = text.contains(['#', ',', ';', ' ', '[']) || text.contains(is_word);
        match field.component {
            Some(component) if !whole => {
                edit::set_component(scene, &field.target, &field.property.key, component, text)
            }
            _ => edit::set(scene, &field.target, &field.property.key, text),
        }
    }

    /// Steps the value of the property under the cursor. In a question, moves the cursor.
    pub(super) fn step_field(&mut self, steps: f64) {
        if let Some(Overlay::Question(_)) = self.model.overlay {
            self.move_cursor(if steps > 0.0 { 1 } else { -1 });
            return;
        }
        if self.model.overlay.is_some() && !self.in_form() {
            return;
        }
        if let Some(field) = self.field() {
            let FieldLine { target, property, component, .. } = &field;
            let edit = edit::step(self.scene(), target, &property.key, *component, steps);
            self.commit(edit, Coalesce::Repeat);
        }
    }

    /// Sets the property under the cursor; an empty text stands for the default.
    pub(super) fn fill_field(&mut self, value: &str) {
        if let Some(field) = self.field() {
            let edit = edit::set(self.scene(), &field.target, &field.property.key, value);
            self.commit(edit, Coalesce::Single);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::calculated;

    #[test]
    fn calculations_start_from_present_value() {
        for (text, result) in [
            ("*2", Some(8.0)),
            ("/2", Some(2.0)),
            ("+.1", Some(4.1)),
            ("-=.1", Some(3.9)),
            ("*=-2", Some(-8.0)),
            ("-.1", None),
            ("1e-3", None),
            ("0.3*3", Some(0.9)),
            ("-3-1", Some(-4.0)),
            ("1e-3*2", Some(2e-3)),
            ("*x", None),
            ("", None),
        ] {
            assert_eq!(calculated(text, 4.0), result, "{text}");
        }
    }
}
