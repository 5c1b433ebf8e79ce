//! Decoder of terminal input: bytes to keys, mouse reports, pasted text and replies.
//!
//! `vte` divides the input into characters, control sequences and strings (ECMA-48), and
//! [`Interpreter`] reads these as a whole. An unknown reply is therefore skipped as a whole: it never
//! becomes keys and never hides later keys. `vte` is made for the output of programs; the decoder
//! handles these parts of keyboard input before it:
//!
//! - A lone ESC is the key Escape and `ESC c` is Alt-c for any `c`. `vte` waits after ESC without
//!   end, executes a control character in place, and takes `ESC X` and `ESC ^` for strings. It gets
//!   ESC together with the byte that proves the sequence.
//! - `ESC O c` (SS3), `ESC [ [ c` (Linux console) and `ESC [ M b x y` (X10 mouse) end after the
//!   final byte that `vte` knows.
//! - Pasted text may hold any bytes.
//! - `vte` discards the data of APC strings, in which kitty replies. It gets `ESC P` for `ESC _`.
//! - `vte` ends a DCS string at the byte 9C, which is also part of UTF-8 characters such as Ü.
//! - `vte` keeps a control sequence open across control characters. A key typed after a cut-off
//!   sequence would be lost.

use crate::terminal::event::Code;
use crate::terminal::sequence::{Interpreter, console_key, single_shift, x10_mouse};
use crate::terminal::{Event, Key, Reply};
use std::time::Duration;

/// Longest pause after an introducer that is also a key with Alt (`ESC [`, `ESC O`, …).
const INTRODUCER_WAIT: Duration = Duration::from_millis(500);
/// Longest pause inside any other sequence.
const SEQUENCE_WAIT: Duration = Duration::from_secs(2);
/// Longest pause inside pasted text.
const PASTE_WAIT: Duration = Duration::from_secs(10);
/// Most bytes of a string that are kept; further ones are skipped.
const MAX_STRING: usize = 4096;
/// Most bytes of pasted text that are kept; further ones are skipped.
const MAX_PASTE: usize = 1 << 20;

const ESC: u8 = 0x1b;
const BEL: u8 = 0x07;
const CAN: u8 = 0x18;
const SUB: u8 = 0x1a;
const PASTE_END: &[u8] = b"\x1b[201~";

/// Position in the input, as far as the decoder needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Ground,
    /// Inside a UTF-8 character.
    Character,
    Escape,
    /// After ESC and this byte, which begin a sequence or are a key with Alt.
    Introducer(u8),
    /// After `ESC O` and the modifiers.
    SingleShift(u16),
    /// Inside a control sequence.
    ControlSequence,
    /// After `ESC [ [`.
    Console,
    /// After `ESC [ M`.
    X10Mouse,
    /// In a string that ESC and this byte have begun.
    String(u8),
    /// After ESC in such a string.
    StringEscape(u8),
    Paste,
}

/// Decoder of terminal input. The caller measures time: after [`Decoder::patience`] without a byte
/// it calls [`Decoder::give_up`].
pub struct Decoder {
    parser: vte::Parser,
    interpreter: Interpreter,
    state: State,
    /// Pasted text, or the bytes of an X10 mouse report.
    taken: Vec<u8>,
    /// Bytes of the string so far.
    string_length: usize,
    escape_wait: Duration,
    /// `true` if the last byte was an ESC that became the key Escape.
    escape_given_up: bool,
}

impl Decoder {
    /// Creates a decoder. `escape_wait` is the longest pause between ESC and a byte that belongs to
    /// it; only then is it certain that ESC is the key Escape.
    pub fn new(escape_wait: Duration) -> Self {
        Self {
            parser: vte::Parser::new(),
            interpreter: Interpreter::default(),
            state: State::Ground,
            taken: Vec::new(),
            string_length: 0,
            escape_wait,
            escape_given_up: false,
        }
    }

    /// Decodes bytes that were read together. Returns the events that they complete.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<Event> {
        if std::mem::take(&mut self.escape_given_up) && is_reply_without_escape(bytes) {
            self.state = State::Escape;
        }
        for byte in bytes {
            self.byte(*byte);
        }
        std::mem::take(&mut self.interpreter.events)
    }

    /// Longest time to wait for the next byte; `None` between sequences.
    pub fn patience(&self) -> Option<Duration> {
        match self.state {
            State::Ground => None,
            State::Escape => Some(self.escape_wait),
            State::Introducer(_) => Some(INTRODUCER_WAIT),
            State::Paste => Some(PASTE_WAIT),
            _ => Some(SEQUENCE_WAIT),
        }
    }

    /// Ends the sequence in progress after a pause. Returns the events that its bytes make.
    pub fn give_up(&mut self) -> Vec<Event> {
        match self.state {
            State::Escape => {
                self.escape_given_up = true;
                self.interpreter.press(Key::plain(Code::Esc));
            }
            State::Paste => self.end_paste(),
            _ => self.abandon(),
        }
        self.restart();
        std::mem::take(&mut self.interpreter.events)
    }

    fn byte(&mut self, byte: u8) {
        match (self.state, byte) {
            (State::Paste, _) => self.paste(byte),
            (State::Ground, ESC) => {
                self.restart();
                self.state = State::Escape;
            }
            (State::Ground, _) | (State::Character, 0x80..=0xbf) => {
                self.interpreter.is_character_complete = false;
                self.parse(&[byte]);
                let is_complete = self.interpreter.is_character_complete;
                self.state = if is_complete { State::Ground } else { State::Character };
            }
            // The character was cut off.
            (State::Character, _) => {
                self.restart();
                self.byte(byte);
            }
            (State::Escape, ESC) => self.interpreter.press(Key::plain(Code::Esc)),
            (State::Escape, b'[' | b'O' | b'P' | b']' | b'_') => {
                self.state = State::Introducer(byte);
            }
            (State::Escape, _) => {
                self.interpreter.alt = true;
                self.in_ground(byte);
            }

            (State::Introducer(b'['), b'[') => self.state = State::Console,
            (State::Introducer(b'['), b'M') => self.state = State::X10Mouse,
            (State::Introducer(b'['), 0x20..=0x7e) => {
                self.parse(b"\x1b[");
                self.state = State::ControlSequence;
                self.byte(byte);
            }
            (State::ControlSequence, 0x20..=0x3f) => self.parse(&[byte]),
            (State::ControlSequence, 0x40..=0x7e) => {
                self.parse(&[byte]);
                let is_paste = std::mem::take(&mut self.interpreter.is_paste);
                self.state = if is_paste { State::Paste } else { State::Ground };
            }
            (State::Console, _) => self.complete(console_key(byte)),
            (State::X10Mouse, _) => {
                self.taken.push(byte);
                if self.taken.len() == 3 {
                    let report = std::mem::take(&mut self.taken);
                    self.complete(x10_mouse(&report));
                }
            }

            (State::Introducer(b'O'), b'0'..=b'9' | 0x40..=0x7e) => {
                self.state = State::SingleShift(0);
                self.byte(byte);
            }
            (State::SingleShift(modifiers), b'0'..=b'9') => {
                let digit = u16::from(byte - b'0');
                let modifiers = modifiers.saturating_mul(10).saturating_add(digit);
                self.state = State::SingleShift(modifiers);
            }
            (State::SingleShift(modifiers), 0x40..=0x7e) => {
                self.complete(single_shift(modifiers, byte));
            }

            (
                State::Introducer(b'[' | b'O') | State::ControlSequence | State::SingleShift(_),
                _,
            ) => {
                self.abandon();
                self.in_ground(byte);
            }

            (State::Introducer(introducer), _) => {
                self.interpreter.is_apc = introducer == b'_';
                self.interpreter.reply = Reply::Other;
                self.string_length = 0;
                self.parse(if introducer == b']' { b"\x1b]" } else { b"\x1bP" });
                self.state = State::String(introducer);
                self.byte(byte);
            }
            (State::String(introducer), ESC) => self.state = State::StringEscape(introducer),
            (State::String(b']'), BEL) => self.end_string(b"\x07"),
            (State::String(_), CAN | SUB) => self.restart(),
            (State::String(b'P' | b'_'), 0x80..) => {}
            (State::String(_), _) => {
                self.string_length += 1;
                if self.string_length <= MAX_STRING {
                    self.parse(&[byte]);
                }
            }
            (State::StringEscape(_), b'\\') => self.end_string(b"\x1b\\"),
            (State::StringEscape(_), _) => {
                // The string was cut off by another sequence.
                self.restart();
                self.state = State::Escape;
                self.byte(byte);
            }
        }
    }

    fn parse(&mut self, bytes: &[u8]) {
        self.parser.advance(&mut self.interpreter, bytes);
    }

    /// Returns to the ground state of decoder and parser.
    fn restart(&mut self) {
        self.parser = vte::Parser::new();
        self.interpreter.alt = false;
        self.state = State::Ground;
        self.taken.clear();
    }

    /// Decodes `byte` as if no sequence had begun.
    fn in_ground(&mut self, byte: u8) {
        let alt = self.interpreter.alt;
        self.restart();
        self.interpreter.alt = alt;
        self.byte(byte);
    }

    /// Ends a sequence that `vte` does not parse.
    fn complete(&mut self, event: Option<Event>) {
        self.interpreter.events.extend(event);
        self.restart();
    }

    /// Ends a string with `terminator`, which makes the parser report it.
    fn end_string(&mut self, terminator: &[u8]) {
        self.parse(terminator);
        let reply = std::mem::replace(&mut self.interpreter.reply, Reply::Other);
        self.complete(Some(Event::Reply(reply)));
    }

    fn paste(&mut self, byte: u8) {
        // Skipped bytes are still searched for the end.
        if self.taken.len() >= MAX_PASTE + PASTE_END.len() {
            self.taken.remove(MAX_PASTE);
        }
        self.taken.push(byte);
        if self.taken.ends_with(PASTE_END) {
            self.taken.truncate(self.taken.len() - PASTE_END.len());
            self.end_paste();
        }
    }

    fn end_paste(&mut self) {
        let text = String::from_utf8_lossy(&self.taken).into_owned();
        self.complete(Some(Event::Paste(text)));
    }

    /// Reports an introducer without successor as a key with Alt.
    fn abandon(&mut self) {
        if let State::Introducer(introducer) = self.state {
            self.interpreter.alt = true;
            self.interpreter.press(Key::plain(Code::Char(char::from(introducer))));
        }
    }
}

/// Returns `true` if bytes read together after a lone ESC can only be the remainder of a reply:
/// these are not typed within one read.
fn is_reply_without_escape(bytes: &[u8]) -> bool {
    matches!(
        bytes,
        [b'[', b'?' | b'>' | b'0'..=b'9', _, ..]
            | [b']' | b'P', b'0'..=b'9' | b'>', _, ..]
            | [b'_', b'G', _, ..]
    )
}
