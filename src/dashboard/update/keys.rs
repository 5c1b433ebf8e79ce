//! Key dispatch. An open text editor receives a key first; the command table receives the keys that
//! the editor does not use.

use crate::dashboard::editor::Editor;
use crate::dashboard::key_context::KeyContext;
use crate::dashboard::model::{FieldList, Model};
use crate::dashboard::overlay::Overlay;
use crate::dashboard::update::UpdateContext;
use crate::dashboard::update::commands::{Command, lookup};
use zerkalo_terminal::event::{Code, Key};

/// Returns the character that `key` types. Returns `None` if it types none.
fn typed(key: Key) -> Option<char> {
    match key {
        Key { code: Code::Char(c), ctrl: false, alt: false, .. } => Some(c),
        _ => None,
    }
}

impl Model {
    /// Returns the text editor that receives the keys. Returns `None` if none is open.
    pub(super) fn editor_mut(&mut self) -> Option<&mut Editor> {
        match &mut self.overlay {
            Some(Overlay::CommandPalette(palette)) => Some(&mut palette.editor),
            Some(Overlay::Prompt(prompt)) => Some(&mut prompt.editor),
            Some(Overlay::Form(form)) => form.fields.editor.as_mut(),
            Some(_) => None,
            None => self.inspector.editor.as_mut(),
        }
    }

    /// Returns a mutable reference to the state of the open form's list of properties, or of the
    /// inspector if no form is open.
    pub(super) fn field_list_mut(&mut self) -> &mut FieldList {
        match &mut self.overlay {
            Some(Overlay::Form(form)) => &mut form.fields,
            _ => &mut self.inspector,
        }
    }
}

impl UpdateContext<'_> {
    pub(super) fn key(&mut self, key: Key) {
        self.model.first_time = false;
        self.model.notice.take_if(|notice| notice.until.is_none());
        if let Some(Overlay::ViewerImage(_)) = self.model.overlay {
            match lookup(KeyContext::Overlay, key).filter(|command| command.over_image) {
                Some(command) => self.run(command),
                None => self.close_viewer(),
            }
            return;
        }
        if let Some(editor) = self.model.editor_mut()
            && editor.key(key)
        {
            self.text_changed();
            return;
        }
        if let Some(c) = typed(key)
            && self.typed_in_overlay(c)
        {
            return;
        }
        let Some(command) = lookup(self.model.context(), key) else {
            if self.model.overlay.is_none() && self.model.inspector.editor.is_none() {
                self.say(format!("{key} does nothing here · ? all keys"));
            }
            return;
        };
        // A value that is being typed is applied before another command runs. An invalid value
        // prevents the command.
        if self.model.overlay.is_none()
            && self.model.inspector.editor.is_some()
            && !command.while_typing
            && !self.apply_field()
        {
            return;
        }
        self.typed = typed(key);
        self.run(command);
    }

    /// Runs a command if it is available. Otherwise shows the reason why it is not: there is no
    /// scene, or `zerkalo watch` cannot edit or render.
    pub(super) fn run(&mut self, command: &Command) {
        if self.model.watch.is_some() && !command.while_watching {
            self.refuse("Read-only: `zerkalo watch` edits and renders nothing · ? keys");
        } else if (command.available)(self.model) {
            (command.run)(self);
        } else {
            self.refuse("No scene: fix the errors in its file first");
        }
    }

    /// Inserts pasted text into the open text editor. Without an editor the text is ignored,
    /// because as keys it would run commands.
    pub(super) fn paste(&mut self, text: &str) {
        self.model.first_time = false;
        match self.model.editor_mut() {
            Some(editor) => {
                editor.paste(text);
                self.text_changed();
            }
            None => self.say("Pasted text goes into fields: open one first (Enter)"),
        }
    }

    /// Updates the command palette's list of commands after a change of the search text.
    fn text_changed(&mut self) {
        if let Some(Overlay::CommandPalette(_)) = self.model.overlay {
            self.search();
        }
    }

    /// Applies the typed character `c` to the open list, form or question. Returns `true` if an
    /// overlay is open; the character then runs no command.
    fn typed_in_overlay(&mut self, c: char) -> bool {
        match &self.model.overlay {
            Some(Overlay::Question(question)) => {
                let has_letter = |(letter, ..): &(char, _, _)| letter.eq_ignore_ascii_case(&c);
                if let Some(at) = question.answers.iter().position(has_letter) {
                    self.answer(at);
                }
            }
            Some(Overlay::Form(form)) if form.fields.editor.is_none() => self.open_field(Some(c)),
            Some(Overlay::Pick(_)) => self.jump_to(c),
            Some(Overlay::Help { .. } | Overlay::Inventory { .. }) if "?q ".contains(c) => {
                self.model.overlay = None;
            }
            Some(_) => {}
            None => return false,
        }
        true
    }
}
