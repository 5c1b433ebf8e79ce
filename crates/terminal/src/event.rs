//! Keys and mouse events, independent of the terminal's protocol.

use std::fmt;
use std::str::FromStr;

/// Key without modifiers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Code {
    /// Character as typed, such as `a` or `A`, never with `shift`.
    Char(char),
    Enter,
    Esc,
    /// Tab, with `shift` back-tab.
    Tab,
    Backspace,
    Delete,
    Left,
    Right,
    Up,
    Down,
    Home,
    End,
    PageUp,
    PageDown,
    /// Function key, 1 for F1.
    F(u8),
}

/// Key press.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key {
    pub code: Code,
    pub ctrl: bool,
    pub alt: bool,
    /// `true` if Shift is pressed; always `false` for characters.
    pub shift: bool,
}

impl Key {
    /// Creates a key press without modifiers.
    pub fn plain(code: Code) -> Self {
        Self { code, ctrl: false, alt: false, shift: false }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MouseKind {
    Press(Button),
    /// Movement while this button is pressed.
    Drag(Button),
    Release(Button),
    /// Ticks of the wheel, positive if away from the user.
    Scroll(i32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    Left,
    Middle,
    Right,
}

/// Mouse event with the cell under the pointer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mouse {
    pub kind: MouseKind,
    /// Column, counted from 0.
    pub column: u16,
    /// Row, counted from 0.
    pub row: u16,
    /// `true` if Control or Alt is pressed. Shift does not count, because most terminals use it
    /// themselves.
    pub modified: bool,
}

/// Names of the keys that are not written as their character.
const NAMED: &[(&str, Code)] = &[
    ("Enter", Code::Enter),
    ("Esc", Code::Esc),
    ("Tab", Code::Tab),
    ("Backspace", Code::Backspace),
    ("Delete", Code::Delete),
    ("Left", Code::Left),
    ("Right", Code::Right),
    ("Up", Code::Up),
    ("Down", Code::Down),
    ("Home", Code::Home),
    ("End", Code::End),
    ("PageUp", Code::PageUp),
    ("PageDown", Code::PageDown),
    ("Space", Code::Char(' ')),
];

/// Formats a key as in help: `Ctrl-s`, `Shift-Left`, `a`, `?`, `Space`.
impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (on, name) in [(self.ctrl, "Ctrl-"), (self.alt, "Alt-"), (self.shift, "Shift-")] {
            if on {
                f.write_str(name)?;
            }
        }
        if let Some((name, _)) = NAMED.iter().find(|(_, code)| *code == self.code) {
            return f.write_str(name);
        }
        match self.code {
            Code::Char(c) => write!(f, "{c}"),
            Code::F(n) => write!(f, "F{n}"),
            _ => Ok(()),
        }
    }
}

impl FromStr for Key {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (mut key, mut name) = (Self::plain(Code::Esc), text);
        for (prefix, flag) in
            [("Ctrl-", &mut key.ctrl), ("Alt-", &mut key.alt), ("Shift-", &mut key.shift)]
        {
            if let Some(after) = name.strip_prefix(prefix) {
                *flag = true;
                name = after;
            }
        }
        let mut chars = name.chars();
        let code = match (chars.next(), chars.next()) {
            (Some(only), None) => Some(Code::Char(only)),
            (Some('F'), Some('0'..='9')) => name[1..].parse().ok().map(Code::F),
            _ => NAMED.iter().find(|(known, _)| *known == name).map(|(_, code)| *code),
        };
        let code = code.ok_or_else(|| format!("no key is called {text:?}"))?;
        Ok(Self { code, ..key })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn key_names_round_trip() {
        for name in [
            "a",
            "A",
            "?",
            "Space",
            "Ctrl-s",
            "Shift-Left",
            "Alt-Up",
            "F1",
            "F12",
            "Shift-Tab",
            "PageUp",
            "Esc",
            "-",
            "Ctrl-Alt-Delete",
        ] {
            assert_eq!(name.parse::<Key>().unwrap().to_string(), name);
        }
        for wrong in ["", "Meta-x", "Hyper", "Fx"] {
            assert!(wrong.parse::<Key>().is_err(), "{wrong}");
        }
    }
}
