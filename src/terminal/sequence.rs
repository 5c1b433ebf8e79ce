//! Whole escape sequences, read: ECMA-48 and what xterm and kitty have added ("Control Sequences",
//! invisible-island.net/xterm/ctlseqs; sw.kovidgoyal.net/kitty/keyboard-protocol).

use crate::terminal::event::{Button, Code, Key, Mouse, MouseKind};
use crate::terminal::{Event, Reply};

/// The key of a character as it comes over the line.
pub fn character(c: char) -> Option<Key> {
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

/// What follows `ESC [`, up to its final byte.
pub fn control(sequence: &[u8]) -> Option<Event> {
    let (last, parameters) = sequence.split_last()?;
    let text = std::str::from_utf8(parameters).ok()?;
    let reply = |reply| Some(Event::Reply(reply));
    match (text.as_bytes().first(), last) {
        (Some(b'<'), b'M' | b'm') => return mouse(&text[1..], *last == b'm').map(Event::Mouse),
        (Some(b'?'), b'c') => {
            return reply(Reply::Attributes(numbers(&text[1..]).into_iter().flatten().collect()));
        }
        (Some(b'?'), b'y') => {
            let [mode, setting] = pair(text[1..].strip_suffix('$')?)?;
            return reply(Reply::Mode { mode, setting });
        }
        (Some(b'?'), b'S') => {
            return reply(match numbers(&text[1..])[..] {
                [Some(1), Some(0), Some(colors)] => Reply::SixelColors(colors),
                [Some(2), Some(0), Some(width), Some(height)] => Reply::SixelSize([width, height]),
                _ => Reply::Other,
            });
        }
        (Some(b'?' | b'>' | b'=' | b'<'), _) => return reply(Reply::Other),
        _ => {}
    }
    match last {
        b'I' | b'O' if text.is_empty() => None,
        b'R' => match pair(text) {
            Some([row, column]) => reply(Reply::Cursor { row, column }),
            None => key(Code::F(3), text),
        },
        b'n' | b't' | b'y' | b'x' | b'c' => reply(match numbers(text)[..] {
            [Some(6), Some(height), Some(width)] if *last == b't' => {
                Reply::CellSize([width, height])
            }
            _ => Reply::Other,
        }),
        b'u' => unicode_key(text),
        b'~' => {
            let code = match numbers(text)[..] {
                // modifyOtherKeys of xterm: 27 ; modifiers ; character.
                [Some(27), Some(modifiers), Some(c)] => {
                    return character(char::from_u32(u32::from(c))?)
                        .map(|key| Event::Key(modified(key, modifiers)));
                }
                [Some(n), ..] => match n {
                    1 | 7 => Code::Home,
                    3 => Code::Delete,
                    4 | 8 => Code::End,
                    5 => Code::PageUp,
                    6 => Code::PageDown,
                    11..=15 => Code::F(n as u8 - 10),
                    17..=21 => Code::F(n as u8 - 11),
                    23 | 24 => Code::F(n as u8 - 12),
                    _ => return None,
                },
                _ => return None,
            };
            key(code, text)
        }
        b'Z' => Some(Event::Key(Key { shift: true, ..Key::plain(Code::Tab) })),
        _ => key(named(*last)?, text),
    }
}

/// What follows `ESC O`.
pub fn single(last: u8, parameters: &[u8]) -> Option<Event> {
    let code = match last {
        b'M' => Code::Enter,
        b'I' => Code::Tab,
        // Keys of a number pad in application mode.
        b'j'..=b'y' => Code::Char(char::from(last - b'j' + b'*')),
        b'R' => Code::F(3),
        _ => named(last)?,
    };
    let modifiers = std::str::from_utf8(parameters).ok()?.parse().unwrap_or(1);
    Some(Event::Key(modified(Key::plain(code), modifiers)))
}

/// What follows `ESC [ [` on the Linux console.
pub fn console(last: u8) -> Option<Event> {
    (b'A'..=b'E').contains(&last).then(|| Event::Key(Key::plain(Code::F(last - b'A' + 1))))
}

/// The three bytes after `ESC [ M`.
pub fn old_mouse(bytes: &[u8]) -> Option<Event> {
    let [button, column, row] =
        bytes.iter().map(|b| b.checked_sub(32)).collect::<Option<Vec<_>>>()?[..]
    else {
        return None;
    };
    let released = button & 0b11 == 3 && button & 64 == 0;
    let button = if released { button & !0b11 } else { button };
    let place = [u16::from(column), u16::from(row)];
    decoded_mouse(u16::from(button), place, released).map(Event::Mouse)
}

/// The contents of a string that `ESC` and `kind` have begun.
pub fn text(kind: u8, contents: &[u8]) -> Option<Event> {
    let text = String::from_utf8_lossy(contents);
    let reply = match kind {
        b']' => match text.strip_prefix("11;").and_then(color) {
            Some(rgb) => Reply::Background(rgb),
            None => Reply::Other,
        },
        b'P' => {
            if let Some(version) = text.strip_prefix(">|") {
                Reply::Version(version.to_string())
            } else if let Some(setting) = text.strip_prefix("1$r") {
                Reply::Setting(setting.to_string())
            } else {
                Reply::Other
            }
        }
        _ if text.starts_with('G') => Reply::Graphics(text.ends_with(";OK")),
        _ => Reply::Other,
    };
    Some(Event::Reply(reply))
}

/// Keys that are told by the last byte alone.
fn named(last: u8) -> Option<Code> {
    Some(match last {
        b'A' => Code::Up,
        b'B' => Code::Down,
        b'C' => Code::Right,
        b'D' => Code::Left,
        b'H' => Code::Home,
        b'F' => Code::End,
        b'P' => Code::F(1),
        b'Q' => Code::F(2),
        b'S' => Code::F(4),
        _ => return None,
    })
}

/// A key whose second parameter tells its modifiers; `None` for what is not a press.
fn key(code: Code, parameters: &str) -> Option<Event> {
    let second = parameters.split(';').nth(1).unwrap_or("1");
    with_modifiers(Key::plain(code), second).map(Event::Key)
}

/// `codepoint ; modifiers` as kitty and xterm tell it, each with parts that do not matter here.
fn unicode_key(parameters: &str) -> Option<Event> {
    let mut fields = parameters.split(';');
    let code: u32 = fields.next()?.split(':').next()?.parse().ok()?;
    let key = match code {
        27 => Key::plain(Code::Esc),
        57_344.. => return None,
        code => character(char::from_u32(code)?)?,
    };
    with_modifiers(key, fields.next().unwrap_or("1")).map(Event::Key)
}

/// `modifiers` or `modifiers:kind`, where kind 3 is a release.
fn with_modifiers(key: Key, text: &str) -> Option<Key> {
    let (modifiers, kind) = text.split_once(':').unwrap_or((text, "1"));
    let modifiers = if modifiers.is_empty() { 1 } else { modifiers.parse().ok()? };
    (kind != "3").then(|| modified(key, modifiers))
}

/// Modifiers are told as 1 more than their bits: Shift 1, Alt 2, Control 4.
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

/// `button ; column ; row` of the mouse protocol 1006.
fn mouse(parameters: &str, released: bool) -> Option<Mouse> {
    match numbers(parameters)[..] {
        [Some(button), Some(column), Some(row)] => decoded_mouse(button, [column, row], released),
        _ => None,
    }
}

/// Bits of the button: 0 to 2 which, 4 Shift, 8 Alt, 16 Control, 32 motion, 64 wheel. Places count
/// from 1.
fn decoded_mouse(button: u16, [column, row]: [u16; 2], released: bool) -> Option<Mouse> {
    let which = match button & 0b11 {
        0 => Button::Left,
        1 => Button::Middle,
        2 => Button::Right,
        _ => return None,
    };
    let kind = match (button & 64 != 0, button & 32 != 0, which) {
        (true, _, Button::Left) => MouseKind::Scroll(1),
        (true, _, Button::Middle) => MouseKind::Scroll(-1),
        (true, ..) => return None,
        (false, true, which) => MouseKind::Drag(which),
        (false, false, which) if released => MouseKind::Release(which),
        (false, false, which) => MouseKind::Press(which),
    };
    if button >= 128 {
        return None;
    }
    let modified = button & (8 | 16) != 0;
    Some(Mouse { kind, column: column.checked_sub(1)?, row: row.checked_sub(1)?, modified })
}

/// Parameters between semicolons; what comes after a colon in one does not matter.
fn numbers(text: &str) -> Vec<Option<u16>> {
    text.split(';').map(|field| field.split(':').next()?.parse().ok()).collect()
}

fn pair(text: &str) -> Option<[u16; 2]> {
    match numbers(text)[..] {
        [Some(first), Some(second)] => Some([first, second]),
        _ => None,
    }
}

/// `rgb:RRRR/GGGG/BBBB`, each with 1 to 4 digits, as sRGB.
fn color(text: &str) -> Option<[u8; 3]> {
    let channel = |digits: &str| {
        let most = 16u32.checked_pow(digits.len() as u32).filter(|_| digits.len() <= 4)? - 1;
        let value = u32::from_str_radix(digits, 16).ok()?;
        Some(((value * 255 + most / 2) / most) as u8)
    };
    let mut channels = text.strip_prefix("rgb:")?.split('/').map(channel);
    let rgb = [channels.next()??, channels.next()??, channels.next()??];
    channels.next().is_none().then_some(rgb)
}
