//! Commands on the fields of inspector and forms: moving the cursor, stepping and typing values.

use crate::dashboard::editor::Editor;
use crate::dashboard::layout::Focus;
use crate::dashboard::overlay::{Overlay, Pick, PickFor};
use crate::dashboard::panel_lines::{FieldLine, walk_fields};
use crate::dashboard::update::{Coalesce, UpdateContext};
use crate::scene::edit::{self, Edit, EditError, Property, Widget};

impl UpdateContext<'_> {
    fn cursor(&self) -> usize {
        match &self.model.overlay {
            Some(Overlay::Form(form)) => form.cursor,
            _ => self.model.inspector.cursor,
        }
    }

    pub(super) fn set_cursor(&mut self, cursor: usize) {
        match &mut self.model.overlay {
            Some(Overlay::Form(form)) => form.cursor = cursor,
            _ => self.model.inspector.cursor = cursor,
        }
    }

    fn set_editor(&mut self, editor: Option<Editor>) {
        match &mut self.model.overlay {
            Some(Overlay::Form(form)) => {
                form.editor = editor;
                form.problem = None;
            }
            _ => self.model.inspector.editor = editor,
        }
    }

    pub(super) fn move_field_cursor(&mut self, steps: isize) {
        let lines = self.model.field_lines();
        self.set_cursor(walk_fields(&lines, self.cursor(), steps));
    }

    /// Returns the field under the cursor. Returns `None` if there is none.
    pub(super) fn field(&self) -> Option<FieldLine> {
        self.model.field_lines().get(self.cursor())?.field().cloned()
    }

    /// Returns the property of the scene to which `field` belongs. A property that is a list of
    /// numbers has one field for each number.
    fn row(&self, field: &FieldLine) -> Option<Property> {
        let rows = edit::rows(self.scene(), &field.subject).ok()?;
        rows.into_iter().find(|row| row.key == field.key)
    }

    /// Opens a text editor for the field under the cursor, with the text `typed`, or with the
    /// field's value if `typed` is `None`. A switch is toggled instead, and a choice opens its
    /// list.
    pub(super) fn open_field(&mut self, typed: Option<char>) {
        let Some(field) = self.field() else { return };
        let words = self.row(&field).map(|row| row.words).unwrap_or_default();
        let chosen = !words.is_empty();
        match typed {
            None if field.entry == Widget::Switch => self.step_field(1.0),
            None if chosen && !self.in_form() => {
                let cursor = words.iter().position(|word| word.name == field.value);
                self.model.overlay = Some(Overlay::Pick(Pick {
                    purpose: PickFor::Word(field.subject.clone(), field.key.clone()),
                    title: field.label.clone(),
                    entries: words
                        .into_iter()
                        .map(|word| (word.name, word.doc.to_string()))
                        .collect(),
                    cursor: cursor.unwrap_or(0),
                    scroll: 0,
                }));
            }
            Some(' ') if chosen || field.entry == Widget::Switch => self.step_field(1.0),
            Some(' ') => {}
            Some(c) => self.set_editor(Some(Editor::new(c))),
            None => self.set_editor(Some(Editor::new(field.value))),
        }
    }

    pub(super) fn in_form(&self) -> bool {
        matches!(self.model.overlay, Some(Overlay::Form(_)))
    }

    /// Applies the typed value and closes the editor. Returns `false` if the value is not valid;
    /// the editor then stays open and shows the reason.
    pub(super) fn apply_field(&mut self) -> bool {
        let Some(field) = self.field() else {
            self.set_editor(None);
            return true;
        };
        let Some(text) = self.model.editor().map(|editor| editor.text().trim().to_string()) else {
            return true;
        };
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
                if let Some(editor) = self.model.editor_mut() {
                    editor.problem = Some(error.to_string());
                }
                false
            }
        }
    }

    /// Returns the edit that sets a field to `text`. If the field is one number of a list, `text`
    /// may also be the whole list, or a colour in hexadecimal digits.
    fn set_field(&self, field: &FieldLine, text: &str) -> Result<Edit, EditError> {
        let scene = self.scene();
        let whole = text.contains(['#', ',', ';', ' ', '[']);
        match field.component {
            Some(component) if !whole => {
                edit::set_component(scene, &field.subject, &field.key, component, text)
            }
            _ => edit::set(scene, &field.subject, &field.key, text),
        }
    }

    pub(super) fn step_field(&mut self, steps: f64) {
        if matches!(self.model.overlay, Some(Overlay::Pick(_) | Overlay::Question(_))) {
            self.move_cursor(if steps > 0.0 { 1 } else { -1 });
            return;
        }
        if self.model.overlay.is_some() && !self.in_form() {
            return;
        }
        if let Some(field) = self.field() {
            let FieldLine { subject, key, component, .. } = &field;
            let edit = edit::step(self.scene(), subject, key, *component, steps);
            self.commit(edit, Coalesce::Repeat);
        }
    }

    pub(super) fn clear_field(&mut self) {
        if let Some(field) = self.field() {
            let edit = edit::set(self.scene(), &field.subject, &field.key, "");
            self.commit(edit, Coalesce::Single);
        }
    }

    /// Sets `key` of `subject` to the value `word`, which was chosen from a list.
    pub(super) fn set_word(&mut self, subject: &edit::Target, key: &str, word: &str) {
        let edit = edit::set(self.scene(), subject, key, word);
        self.commit(edit, Coalesce::Single);
    }

    /// Gives the focus to the inspector.
    pub(super) fn inspect(&mut self) {
        self.set_focus(Focus::Inspector);
    }
}
