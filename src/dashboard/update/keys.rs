//! Key dispatch: an open text editor receives a key first, then the command table.

use crate::dashboard::update::commands::{Command, HintLine, lookup};
use crate::dashboard::{Editor, FieldList, KeyContext, Model, Overlay, UpdateContext};
use zerkalo_scene::edit::Widget;
use zerkalo_terminal::event::{Code, Key};

/// Returns the character that `key` types; `None` for all other keys and with Ctrl or Alt.
fn typed(key: Key) -> Option<char> {
    match key {
        Key { code: Code::Char(c), ctrl: false, alt: false, .. } => Some(c),
        _ => None,
    }
}

impl Model {
    /// Returns the text editor that receives the keys.
    pub(super) fn editor_mut(&mut self) -> Option<&mut Editor> {
        match &mut self.overlay {
            Some(Overlay::Pick(pick)) => Some(&mut pick.editor),
            Some(Overlay::Prompt(prompt)) => Some(&mut prompt.editor),
            Some(Overlay::Form(form)) => form.fields.typing(),
            Some(_) => None,
            None => self.inspector.typing(),
        }
    }

    pub(super) fn field_list_mut(&mut self) -> &mut FieldList {
        match &mut self.overlay {
            Some(Overlay::Form(form)) => &mut form.fields,
            _ => &mut self.inspector,
        }
    }
}

impl UpdateContext<'_> {
    pub(super) fn key(&mut self, key: Key) {
        self.follow = true;
        self.model.first_time = false;
        self.model.notice.take_if(|notice| notice.until.is_none());
        if let Some(Overlay::ViewerImage(_)) = self.model.overlay {
            // Ctrl-Z and Ctrl-C suspend and quit the program. All other keys close the viewer.
            match lookup(self.model.preferences.commands, KeyContext::Overlay, key)
                .filter(|_| key.ctrl)
            {
                Some(command) => self.run(command),
                None => self.close_viewer(),
            }
            return;
        }
        if let Some(editor) = self.model.editor_mut()
            && editor.key(key)
        {
            self.search();
            return;
        }
        if let Some(c) = typed(key)
            && self.typed_on_row(c)
        {
            return;
        }
        let Some(command) = lookup(self.model.preferences.commands, self.model.context(), key)
        else {
            if !self.model.is_busy() {
                self.say(format!("{key} does nothing here · ? all keys"));
            }
            return;
        };
        // An invalid value that is being typed prevents the command. The commands of Enter, Esc and
        // Tab handle the value themselves.
        if matches!(self.model.overlay, None | Some(Overlay::Form(_)))
            && self.model.field_list().editor.is_some()
            && !matches!(key.code, Code::Enter | Code::Esc | Code::Tab)
            && !self.apply_field()
        {
            return;
        }
        // Another command on objects accepts a move or rotation first.
        let is_of_mode =
            |context: &KeyContext| matches!(context, KeyContext::Moving | KeyContext::Rotating);
        if self.moves_or_rotates()
            && command.chapter == "objects"
            && !command.keys.iter().any(|(context, _)| is_of_mode(context))
            && !command
                .hints
                .iter()
                .any(|hint| hint.lines.contains(&HintLine::In(KeyContext::Moving)))
        {
            self.end_mode();
        }
        self.typed = typed(key);
        self.run(command);
    }

    /// Runs a command, or shows why it is not available.
    pub(super) fn run(&mut self, command: &Command) {
        if (command.available)(self.model) {
            (command.run)(self);
        } else if self.model.watch.is_some() {
            self.refuse("Read-only: `zerkalo watch` edits and renders nothing · ? keys");
        } else {
            self.refuse("No scene: fix the errors in its file first");
        }
    }

    /// Inserts pasted text into the open text editor. Pasted characters never run commands.
    pub(super) fn paste(&mut self, text: &str) {
        self.follow = true;
        self.model.first_time = false;
        match self.model.editor_mut() {
            Some(editor) => {
                editor.paste(text);
                self.search();
            }
            None => self.say("Pasted text goes into fields: open one first (Enter)"),
        }
    }

    /// Applies the character `c` to the open question, or to the row of the form or inspector under
    /// the cursor: it begins a value there, or in a form the words that find another row. Returns
    /// `false` if the character may run a command.
    fn typed_on_row(&mut self, c: char) -> bool {
        match &self.model.overlay {
            Some(Overlay::Question(question)) => {
                let has_letter = |(letter, ..): &(char, _, _)| letter.eq_ignore_ascii_case(&c);
                if let Some(at) = question.answers.iter().position(has_letter) {
                    self.answer(at);
                }
                return true;
            }
            Some(Overlay::Form(_)) => {}
            Some(_) => return true,
            None if self.model.context() == KeyContext::Inspector => {}
            None => return false,
        }
        let widget = self.field().map(|field| field.property.widget);
        let begins_number = "0123456789.-+*#".contains(c);
        match widget {
            Some(Widget::Text) if self.in_form() && c.is_alphanumeric() => self.type_value(c),
            Some(Widget::Color) if self.in_form() && c.is_alphabetic() => self.type_value(c),
            _ if c == 'x' && !self.in_form() => {
                self.say(
                    "x deletes in the outline and in the picture · Backspace sets the default",
                );
            }
            Some(Widget::Numbers | Widget::Color) if begins_number => self.type_value(c),
            _ if begins_number => self.say("This row takes no number · Enter edits it"),
            _ if !self.in_form() => return false,
            Some(Widget::Switch | Widget::Choice | Widget::Kind) if c == ' ' => {
                self.step_field(1.0);
            }
            _ if c == '/' => self.open_filter(""),
            _ if c != ' ' => self.open_filter(c),
            _ => {}
        }
        true
    }
}
