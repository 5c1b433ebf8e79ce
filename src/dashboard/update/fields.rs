//! Commands on the properties in the inspector and in forms.

use crate::dashboard::panel_lines::walked;
use crate::dashboard::update::Coalesce;
use crate::dashboard::{Editor, FieldLine, Overlay, UpdateContext};
use zerkalo_scene::edit::{self, Edit, EditError, Widget};

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
    pub(super) fn field(&self) -> Option<FieldLine> {
        let lines = self.model.field_lines();
        Some(*lines.get(self.model.field_list().cursor)?.entry()?.clone())
    }

    /// Starts the input of a value for the property under the cursor. The character `typed` opens a
    /// text editor, except for a space, which changes a switch or a choice to its next value.
    /// Without a character, a switch is toggled, a choice outside a form opens its list, and any
    /// other property opens a text editor with the present value.
    pub(super) fn open_field(&mut self, typed: Option<char>) {
        let Some(field) = self.field() else { return };
        let words = field.property.words;
        let chosen = !words.is_empty();
        match typed {
            None if field.property.widget == Widget::Switch => self.step_field(1.0),
            None if chosen && !self.in_form() => {
                let cursor = words.iter().position(|word| word.name == field.value);
                self.open_pick(field.label, words, cursor.unwrap_or(0), |c, word| {
                    c.fill_field(word)
                });
            }
            Some(' ') if chosen || field.property.widget == Widget::Switch => self.step_field(1.0),
            Some(' ') => {}
            Some(c) => self.set_editor(Some(Editor::new(c))),
            None => self.set_editor(Some(Editor::new(field.value))),
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

    /// Returns the edit that sets the property or number in the line `field`. For one number of a
    /// list, `text` may also be the whole list, or a colour in hexadecimal digits.
    fn set_field(&self, field: &FieldLine, text: &str) -> Result<Edit, EditError> {
        let scene = self.scene();
        let whole = text.contains(['#', ',', ';', ' ', '[']);
        match field.component {
            Some(component) if !whole => {
                edit::set_component(scene, &field.subject, &field.property.key, component, text)
            }
            _ => edit::set(scene, &field.subject, &field.property.key, text),
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
            let FieldLine { subject, property, component, .. } = &field;
            let edit = edit::step(self.scene(), subject, &property.key, *component, steps);
            self.commit(edit, Coalesce::Repeat);
        }
    }

    /// Sets the property under the cursor; an empty text stands for the default.
    pub(super) fn fill_field(&mut self, value: &str) {
        if let Some(field) = self.field() {
            let edit = edit::set(self.scene(), &field.subject, &field.property.key, value);
            self.commit(edit, Coalesce::Single);
        }
    }
}
