//! Keys: first to a line of text that is open, then through the key table.

use crate::dashboard::editor::Editor;
use crate::dashboard::key_context::KeyContext;
use crate::dashboard::model::Model;
use crate::dashboard::overlay::Overlay;
use crate::dashboard::update::UpdateContext;
use crate::dashboard::update::commands::{Command, lookup};
use crate::terminal::event::{Code, Key};

/// The character that a key types, if it is one that types.
fn typed(key: Key) -> Option<char> {
    match key {
        Key { code: Code::Char(c), ctrl: false, alt: false, .. } => Some(c),
        _ => None,
    }
}

impl Model {
    /// The line of text that keys go to.
    pub(super) fn editor_mut(&mut self) -> Option<&mut Editor> {
        match &mut self.overlay {
            Some(Overlay::Palette(palette)) => Some(&mut palette.editor),
            Some(Overlay::Prompt(prompt)) => Some(&mut prompt.editor),
            Some(Overlay::Form(form)) => form.editor.as_mut(),
            Some(_) => None,
            None => self.inspector.editor.as_mut(),
        }
    }
}

impl UpdateContext<'_> {
    pub(super) fn key(&mut self, key: Key) {
        self.model.first_time = false;
        if self.model.notice.as_ref().is_some_and(|notice| notice.until.is_none()) {
            self.model.notice = None;
        }
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
        // A value being typed is applied before anything else is done, or holds it back.
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

    /// Carries out a command, or refuses it if the model does not have what it needs.
    pub(super) fn run(&mut self, command: &Command) {
        if (command.available)(self.model) {
            (command.run)(self);
        } else {
            self.refuse("There is no scene to work on until its file can be read: mend it");
        }
    }

    /// Pasted text goes to a line of text; anywhere else it would be forty shortcuts.
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

    /// Something was typed or pasted.
    fn text_changed(&mut self) {
        if let Some(Overlay::Palette(_)) = self.model.overlay {
            self.search();
        }
    }

    /// A character where a list, a form or a question has the keys. Whether it meant something.
    fn typed_in_overlay(&mut self, c: char) -> bool {
        match &self.model.overlay {
            Some(Overlay::Question(question)) => {
                let of = |(letter, ..): &(char, _, _)| letter.eq_ignore_ascii_case(&c);
                if let Some(at) = question.answers.iter().position(of) {
                    self.answer(at);
                }
            }
            Some(Overlay::Form(form)) if form.editor.is_none() => self.open_field(Some(c)),
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
