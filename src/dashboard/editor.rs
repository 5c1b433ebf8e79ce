//! Text editor for one line.

use tui_input::{Input, InputRequest};
use zerkalo_terminal::event::{Code, Key};

/// Largest length of the text in characters. It suffices for a path and keeps editing fast.
const MOST: usize = 400;

/// Editor of a line of text.
#[derive(Clone, Debug, Default)]
pub struct Editor {
    pub input: Input,
    /// `true` until the first key: a typed character then replaces the whole text.
    pub untouched: bool,
    /// Reason why the text was refused, shown until the text changes.
    pub problem: Option<String>,
}

impl Editor {
    pub fn new(text: impl Into<String>) -> Self {
        Self { input: Input::new(text.into()), ..Self::default() }
    }

    /// Creates an editor whose `text` is replaced by the first character that is typed.
    pub fn replacing(text: impl Into<String>) -> Self {
        Self { untouched: true, ..Self::new(text) }
    }

    pub fn text(&self) -> &str {
        self.input.value()
    }

    /// Applies a key. Returns `true` if the editor uses it, `false` for Enter, Esc, Tab, Up, Down
    /// and other keys that it does not use.
    pub fn key(&mut self, key: Key) -> bool {
        let request = match (key.code, key.ctrl, key.alt) {
            (Code::Char(c), false, false) => return self.insert(c),
            (Code::Backspace, false, false) | (Code::Char('h'), true, false) => {
                InputRequest::DeletePrevChar
            }
            (Code::Backspace, _, _) | (Code::Char('w'), true, false) => {
                InputRequest::DeletePrevWord
            }
            (Code::Delete, false, false) => InputRequest::DeleteNextChar,
            (Code::Delete, _, _) => InputRequest::DeleteNextWord,
            (Code::Left, false, false) => InputRequest::GoToPrevChar,
            (Code::Right, false, false) => InputRequest::GoToNextChar,
            (Code::Left, _, _) => InputRequest::GoToPrevWord,
            (Code::Right, _, _) => InputRequest::GoToNextWord,
            (Code::Home, _, _) | (Code::Char('a'), true, false) => InputRequest::GoToStart,
            (Code::End, _, _) | (Code::Char('e'), true, false) => InputRequest::GoToEnd,
            (Code::Char('u'), true, false) => InputRequest::DeleteFromStart,
            (Code::Char('k'), true, false) => InputRequest::DeleteTillEnd,
            (Code::Char('y'), true, false) => InputRequest::Yank,
            _ => return false,
        };
        self.untouched = false;
        if self.input.handle(request).is_some_and(|changed| changed.value) {
            self.problem = None;
        }
        true
    }

    /// Inserts the first line of the pasted `text` at the cursor, without its control characters.
    pub fn paste(&mut self, text: &str) {
        let line = text.trim_start_matches(['\n', '\r']).lines().next().unwrap_or_default();
        for c in line.chars() {
            self.insert(if c == '\t' { ' ' } else { c });
        }
    }

    fn insert(&mut self, c: char) -> bool {
        if std::mem::take(&mut self.untouched) {
            self.input.reset();
        }
        if !c.is_control() && self.text().chars().count() < MOST {
            self.input.handle(InputRequest::InsertChar(c));
            self.problem = None;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(editor: &mut Editor, keys: &str) {
        keys.split(' ').for_each(|key| assert!(editor.key(key.parse().unwrap()), "{key}"));
    }

    #[test]
    fn editor_applies_editing_keys() {
        let mut editor = Editor::new("0.5 red");
        press(&mut editor, "Backspace Left x Home 1 Delete End Ctrl-w");
        assert_eq!(editor.text(), "1.5 ");
        press(&mut editor, "Ctrl-u é 鏡");
        assert_eq!((editor.text(), editor.input.visual_cursor()), ("é鏡", 3));
        for key in ["Enter", "Esc", "Tab", "Up", "Down", "F2", "Ctrl-s", "Alt-x"] {
            assert!(!editor.key(key.parse().unwrap()), "{key}");
        }
    }

    #[test]
    fn pasted_text_is_first_line_without_control_characters() {
        let mut editor = Editor { problem: Some("empty".into()), ..Editor::default() };
        editor.paste("\n1\t2\u{1b}[31m 3\nq\n");
        assert_eq!(editor.text(), "1 2[31m 3");
        assert_eq!(editor.problem, None);
        editor.paste(&"x".repeat(10_000));
        assert_eq!(editor.text().chars().count(), MOST);
    }
}
