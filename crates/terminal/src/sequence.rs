//! Interpretation of characters and escape sequences: ECMA-48 and the extensions of xterm and kitty
//! ("Control Sequences", invisible-island.net/xterm/ctlseqs;
//! sw.kovidgoyal.net/kitty/keyboard-protocol).

use crate::event::{Button, Code, Key, Mouse, MouseKind};
use crate::{Event, Reply};
use vte::{Params, Perform};

/// Converter of the results of [`vte::Parser`] to events.
#[derive(Debug, Default)]
pub struct Interpreter {
    pub events: Vec<Event>,
    /// `true` if ESC preceded the next key.
    pub alt: bool,
    /// `true` if the last byte completed a UTF-8 character or made it invalid.
    pub is_character_complete: bool,
    /// `true` if the last control sequence begins a bracketed paste.
    pub is_paste: bool,
    /// `true` if the last control sequence is a key, a mouse report or a reply.
    pub is_known: bool,
    /// `true` if the control string began as an APC string (`ESC _`), which the parser gets as a
    /// device control string.
    pub is_apc: bool,
    /// Reply in the last control string.
    pub reply: Reply,
    /// Data of the device control string.
    data: Vec<u8>,
    /// Conversion of `data` to a reply; `None` if it is not a known reply.
    to_reply: Option<fn(String) -> Reply>,
}

impl Interpreter {
    pub fn press(&mut self, key: Key) {
        let alt = std::mem::take(&mut self.alt);
        self.events.push(Event::Key(Key { alt: key.alt | alt, ..key }));
    }
}

impl Perform for Interpreter {
    fn print(&mut self, c: char) {
        self.is_character_complete = true;
        // Invalid UTF-8 produces no key.
        if let Some(key) = character(c).filter(|_| c != char::REPLACEMENT_CHARACTER) {
            self.press(key);
        }
        self.alt = false;
    }

    fn execute(&mut self, byte: u8) {
        self.print(char::from(byte));
    }

    fn csi_dispatch(&mut self, params: &Params, intermediates: &[u8], _: bool, last: char) {
        let params: Vec<_> = params.iter().collect();
        self.is_paste = intermediates.is_empty() && last == '~' && *params == [[200]];
        let event = control_sequence(&params, intermediates, last);
        self.is_known = self.is_paste || event.is_some();
        self.events.extend(event);
    }

    fn hook(&mut self, params: &Params, intermediates: &[u8], _: bool, last: char) {
        let first = params.iter().next().map_or(0, |param| param[0]);
        self.data.clear();
        self.to_reply = match (self.is_apc, first, intermediates, last) {
            (true, 0, b"", 'G') => Some(|data| Reply::Graphics(data.ends_with(";OK"))),
            (false, 0, b">", '|') => Some(Reply::Version),
            (false, 1, b"$", 'r') => Some(Reply::Setting),
            _ => None,
        };
    }

    fn put(&mut self, byte: u8) {
        self.data.push(byte);
    }

    fn unhook(&mut self) {
        let data = String::from_utf8_lossy(&self.data).into_owned();
        self.reply = self.to_reply.map_or(Reply::Other, |to_reply| to_reply(data));
    }

    fn osc_dispatch(&mut self, params: &[&[u8]], _: bool) {
        self.reply = match params {
            [b"11", color] => parse_color(color).map_or(Reply::Other, Reply::Background),
            _ => Reply::Other,
        };
    }
}

/// Returns the key that sends `c`; `None` for control characters that no key sends.
fn character(c: char) -> Option<Key> {
    let ctrl = |c: char| Key { ctrl: true, ..Key::plain(Code::Char(c)) };
    Some(match c {
        '\r' => Key::plain(Code::Enter),
        '\t' => Key::plain(Code::Tab),
        '\u{7f}' => Key::plain(Code::Backspace),
        '\0' => ctrl(' '),
        '\u{1}'..='\u{1a}' => ctrl(char::from(c as u8 - 1 + b'a')),
        '\u{1c}'..='\u{1f}' => ctrl(char::from(c as u8 - 0x1c + b'4')),
        c if c.is_control() => return None,
        c => Key::plain(Code::Char(c)),
    })
}

/// Interprets a control sequence. `params` are its parameters, each with subparameters;
/// `intermediates` are its private marker and intermediate bytes; `last` is its final byte. Returns
/// `None` for an unknown sequence.
fn control_sequence(params: &[&[u16]], intermediates: &[u8], last: char) -> Option<Event> {
    let numbers: Vec<_> = params.iter().map(|param| param[0]).collect();
    let reply = match (intermediates, last, &numbers[..]) {
        (b"<", 'M' | 'm', [button, column, row]) => {
            return mouse(*button, [*column, *row], last == 'm').map(Event::Mouse);
        }
        (b"<", 'M' | 'm', _) => return None,
        (b"?", 'c', _) => Reply::Attributes(numbers),
        (b"?$", 'y', &[mode, setting]) => Reply::Mode { mode, setting },
        (b"?", 'S', &[1, 0, colors]) => Reply::SixelColors(colors),
        (b"?", 'S', &[2, 0, width, height]) => Reply::SixelSize([width, height]),
        (b"", 'n', [0]) => Reply::Status,
        (b"", 't', &[6, height, width]) => Reply::CellSize([width, height]),
        (b"", 'n' | 't' | 'x' | 'c', _) | (b"", 'I' | 'O', [0]) => Reply::Other,
        (b"?", 'n' | 'R' | 'S' | 'u', _) | (b">" | b"=", 'c', _) | (b"$", 'y', _) => Reply::Other,
        // Position of the cursor. For row 1, columns 2 to 16 are decoded as F3 with modifiers.
        (b"", 'R', [(2..), _] | [1, ..2 | 17..]) => Reply::Other,
        (b"", ..) => return key(params, last).map(Event::Key),
        _ => return None,
    };
    Some(Event::Reply(reply))
}

/// Returns the key that a control sequence reports; `None` for a key release or an unknown key.
fn key(params: &[&[u16]], last: char) -> Option<Key> {
    let number = params[0][0];
    let key = match (last, number) {
        // xterm's modifyOtherKeys: 27 ; modifiers ; character.
        ('~', 27) => character(char::from_u32(params.get(2)?[0].into())?)?,
        ('~', 1 | 7) => Key::plain(Code::Home),
        ('~', 3) => Key::plain(Code::Delete),
        ('~', 4 | 8) => Key::plain(Code::End),
        ('~', 5) => Key::plain(Code::PageUp),
        ('~', 6) => Key::plain(Code::PageDown),
        ('~', 11..=15) => Key::plain(Code::F(number as u8 - 10)),
        ('~', 17..=21) => Key::plain(Code::F(number as u8 - 11)),
        ('~', 23 | 24) => Key::plain(Code::F(number as u8 - 12)),
        // Kitty's keyboard protocol: code point, or 57344 and above for keys without a character.
        ('u', 0 | 57_344..) => return None,
        ('u', 27) => Key::plain(Code::Esc),
        ('u', _) => character(char::from_u32(number.into())?)?,
        ('Z', _) => Key { shift: true, ..Key::plain(Code::Tab) },
        _ => Key::plain(named(last)?),
    };
    match params.get(1) {
        Some([_, 3, ..]) => None,
        Some([modifiers, ..]) => Some(modified(key, *modifiers)),
        _ => Some(key),
    }
}

/// Interprets `ESC O modifiers last` (SS3).
pub fn single_shift(modifiers: u16, last: u8) -> Option<Event> {
    let code = match last {
        b'M' => Code::Enter,
        b'I' => Code::Tab,
        // Number pad in application mode.
        b'j'..=b'y' => Code::Char(char::from(last - b'j' + b'*')),
        _ => named(char::from(last))?,
    };
    Some(Event::Key(modified(Key::plain(code), modifiers)))
}

/// Interprets `ESC [ [ last`, by which the Linux console reports F1 to F5.
pub fn console_key(last: u8) -> Option<Event> {
    (b'A'..=b'E').contains(&last).then(|| Event::Key(Key::plain(Code::F(last - b'A' + 1))))
}

/// Interprets an X10 mouse report: button, column and row, each with 32 added.
pub fn x10_mouse(bytes: &[u8]) -> Option<Event> {
    let [button, column, row] =
        bytes.iter().map(|b| b.checked_sub(32).map(u16::from)).collect::<Option<Vec<_>>>()?[..]
    else {
        return None;
    };
    let is_release = button & 0b11 == 3 && button & 64 == 0;
    let button = if is_release { button & !0b11 } else { button };
    mouse(button, [column, row], is_release).map(Event::Mouse)
}

/// Returns the key whose control sequence has the final byte `last`.
fn named(last: char) -> Option<Code> {
    Some(match last {
        'A' => Code::Up,
        'B' => Code::Down,
        'C' => Code::Right,
        'D' => Code::Left,
        'H' => Code::Home,
        'F' => Code::End,
        'P' => Code::F(1),
        'Q' => Code::F(2),
        'R' => Code::F(3),
        'S' => Code::F(4),
        _ => return None,
    })
}

/// Adds `modifiers` to `key`: 1 plus the sum of 1 for Shift, 2 for Alt, 4 for Control.
fn modified(key: Key, modifiers: u16) -> Key {
    let bits = modifiers.saturating_sub(1);
    let is_character = matches!(key.code, Code::Char(_));
    let shift = bits & 1 != 0;
    let code = match key.code {
        Code::Char(c) if shift && c.is_ascii_lowercase() => Code::Char(c.to_ascii_uppercase()),
        code => code,
    };
    Key {
        code,
        shift: key.shift || shift && !is_character,
        alt: key.alt || bits & 2 != 0,
        ctrl: key.ctrl || bits & 4 != 0,
    }
}

/// Interprets a mouse report. The lowest two bits of `button` are the number of the button or the
/// direction of the wheel. The other bits are 4 for Shift, 8 for Alt, 16 for Control, 32 for motion
/// and 64 for the wheel. `column` and `row` count from 1.
fn mouse(button: u16, [column, row]: [u16; 2], is_release: bool) -> Option<Mouse> {
    let pressed = match button & 0b11 {
        0 => Button::Left,
        1 => Button::Middle,
        2 => Button::Right,
        _ => return None,
    };
    let kind = match (button & 64 != 0, button & 32 != 0, pressed) {
        (true, _, Button::Left) => MouseKind::Scroll(1),
        (true, _, Button::Middle) => MouseKind::Scroll(-1),
        (true, ..) => return None,
        (false, true, pressed) => MouseKind::Drag(pressed),
        (false, false, pressed) if is_release => MouseKind::Release(pressed),
        (false, false, pressed) => MouseKind::Press(pressed),
    };
    if button >= 128 {
        return None;
    }
    let modified = button & (8 | 16) != 0;
    Some(Mouse { kind, column: column.checked_sub(1)?, row: row.checked_sub(1)?, modified })
}

/// Parses the colour `rgb:RRRR/GGGG/BBBB` as 8-bit sRGB. Each channel has 1 to 4 hexadecimal
/// digits.
fn parse_color(text: &[u8]) -> Option<[u8; 3]> {
    let channel = |digits: &str| {
        let max = 16u32.checked_pow(digits.len() as u32).filter(|_| digits.len() <= 4)? - 1;
        let value = u32::from_str_radix(digits, 16).ok()?;
        Some(((value * 255 + max / 2) / max) as u8)
    };
    let text = std::str::from_utf8(text).ok()?;
    let mut channels = text.strip_prefix("rgb:")?.split('/').map(channel);
    let rgb = [channels.next()??, channels.next()??, channels.next()??];
    channels.next().is_none().then_some(rgb)
}
