//! Decoder of terminal input: bytes to keys, mouse reports, pasted text and replies.
//!
//! `vte` divides the input into characters, control sequences and strings (ECMA-48), and
//! [`Interpreter`] interprets each of them as a unit. An unknown reply is therefore skipped as a
//! whole: none of its bytes is decoded as a key, and no key after it is lost. `vte` is made for the
//! output of programs, not for keyboard input. The decoder therefore handles these cases before
//! `vte` does:
//!
//! - A lone ESC is the key Escape and `ESC c` is Alt-c for any `c`. After ESC `vte` waits without
//!   limit, executes a control character at once, and takes `ESC X` and `ESC ^` for the start of a
//!   string. The decoder passes ESC to `vte` only after later bytes have proved that a sequence
//!   begins.
//! - `ESC O c` (SS3), `ESC [ [ c` (Linux console) and `ESC [ M b x y` (X10 mouse) have further
//!   bytes after the byte that `vte` takes for the final one.
//! - Pasted text may hold any bytes and may arrive with pauses. Its end sequence (`ESC [ 201 ~`)
//!   ends the paste. After a pause the key Escape or Ctrl-C ends the paste too, because the end
//!   sequence may have been lost.
//! - `vte` discards the data of APC strings (`ESC _`), in which kitty replies. The decoder passes
//!   them on as DCS strings (`ESC P`).
//! - `vte` ends a DCS string at the byte 9C, which is also part of UTF-8 characters such as Ü.
//! - `vte` keeps a control sequence open across control characters. Without special treatment, a
//!   key typed after an incomplete sequence would be lost.

use crate::event::Code;
use crate::sequence::{Interpreter, console_key, single_shift, x10_mouse};
use crate::{Event, Key, Reply};
use std::time::Duration;

/// Longest pause after the first two bytes of an escape sequence (`ESC [`, `ESC O`, …). After a
/// longer pause the two bytes are decoded as a key pressed with Alt.
const INTRODUCER_WAIT: Duration = Duration::from_millis(500);
/// Longest pause inside of an escape sequence, except for its first two bytes and for pasted text.
const SEQUENCE_WAIT: Duration = Duration::from_secs(2);
/// Longest pause inside of pasted text. After a longer pause the text so far is reported; later
/// bytes are still pasted text.
const PASTE_WAIT: Duration = Duration::from_secs(10);
/// Largest number of bytes of a control string (reply of the terminal) that are kept. Further bytes
/// are skipped.
const MAX_STRING: usize = 4096;
/// Largest number of bytes of pasted text that are kept. Further bytes are skipped.
const MAX_PASTE: usize = 1 << 20;

const ETX: u8 = 0x03;
const ESC: u8 = 0x1b;
const BEL: u8 = 0x07;
const CAN: u8 = 0x18;
const SUB: u8 = 0x1a;
const PASTE_END: &[u8] = b"\x1b[201~";

/// State of the input decoder: the kind of character or escape sequence that the next byte belongs
/// to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Ground,
    /// State inside of a UTF-8 character of several bytes.
    Character,
    Escape,
    /// State after ESC and this byte. Both together either begin a sequence or are a key pressed
    /// with Alt.
    Introducer(u8),
    /// State after `ESC O` and decimal digits. The value is the number that the digits form, 0
    /// without digits. It encodes the modifiers of the key that follows.
    SingleShift(u16),
    /// State inside of a control sequence, which began with `ESC [`.
    ControlSequence,
    /// State after `ESC [ [`, with which function keys begin on the Linux console.
    Console,
    /// State after `ESC [ M`, with which mouse reports of the X10 protocol begin.
    X10Mouse,
    /// State inside of a control string, which began with ESC and this byte.
    String(u8),
    /// State after an ESC inside of a control string. A backslash after this ESC ends the string.
    /// The value is the byte after the ESC with which the string began.
    StringEscape(u8),
    Paste,
    /// State inside of pasted text whose first part was reported after a pause.
    PausedPaste,
}

/// Decoder of terminal input. The caller measures time: if no byte arrives within
/// [`Decoder::patience`], it calls [`Decoder::give_up`].
#[derive(Default)]
pub struct Decoder {
    parser: vte::Parser,
    interpreter: Interpreter,
    state: State,
    /// Bytes of the pasted text or of the X10 mouse report that is being decoded.
    taken: Vec<u8>,
    /// Number of bytes of the current control string (a reply of the terminal) that have been read
    /// so far.
    string_length: usize,
    escape_wait: Duration,
    /// `true` if the last byte was an ESC that was reported as the key Escape after a pause.
    escape_given_up: bool,
}

impl Decoder {
    /// Creates a decoder. `escape_wait` is the longest pause between ESC and the next byte of its
    /// sequence. After a longer pause, ESC is the key Escape.
    pub fn new(escape_wait: Duration) -> Self {
        Self { escape_wait, ..Self::default() }
    }

    /// Decodes `bytes`, the result of one read, and returns the events that they complete.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<Event> {
        if std::mem::take(&mut self.escape_given_up) && is_reply_without_escape(bytes) {
            self.state = State::Escape;
        }
        for byte in bytes {
            self.byte(*byte);
        }
        std::mem::take(&mut self.interpreter.events)
    }

    /// Returns the longest time to wait for the next byte of the current sequence. After this time
    /// the caller calls [`Decoder::give_up`]. Returns `None` between sequences, and after a pause
    /// in a paste until more of the paste arrives.
    pub fn patience(&self) -> Option<Duration> {
        match self.state {
            State::Ground => None,
            State::Escape => Some(self.escape_wait),
            State::Introducer(_) => Some(INTRODUCER_WAIT),
            State::Paste => Some(PASTE_WAIT),
            State::PausedPaste if self.taken.is_empty() => None,
            State::PausedPaste => Some(INTRODUCER_WAIT),
            _ => Some(SEQUENCE_WAIT),
        }
    }

    /// Ends an incomplete sequence after a pause. Returns the events decoded from its bytes.
    pub fn give_up(&mut self) -> Vec<Event> {
        match self.state {
            State::Escape => {
                self.escape_given_up = true;
                self.interpreter.press(Key::plain(Code::Esc));
            }
            State::Paste | State::PausedPaste => {
                self.pause_paste();
                return std::mem::take(&mut self.interpreter.events);
            }
            _ => self.abandon(),
        }
        self.restart();
        std::mem::take(&mut self.interpreter.events)
    }

    fn byte(&mut self, byte: u8) {
        match (self.state, byte) {
            (State::Paste | State::PausedPaste, _) => self.paste(byte),
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
            // `byte` does not continue the UTF-8 character, which is incomplete and produces no
            // key.
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
                // Another sequence interrupts the string.
                self.restart();
                self.state = State::Escape;
                self.byte(byte);
            }
        }
    }

    fn parse(&mut self, bytes: &[u8]) {
        self.parser.advance(&mut self.interpreter, bytes);
    }

    /// Resets the decoder and the parser to the state between escape sequences.
    fn restart(&mut self) {
        self.parser = vte::Parser::new();
        self.interpreter.alt = false;
        self.state = State::Ground;
        self.taken.clear();
    }

    /// Resets the decoder, except for a pending Alt modifier, and decodes `byte` as the first one
    /// of a new character or escape sequence.
    fn in_ground(&mut self, byte: u8) {
        let alt = self.interpreter.alt;
        self.restart();
        self.interpreter.alt = alt;
        self.byte(byte);
    }

    /// Ends an escape sequence that `vte` does not parse, and adds its event.
    fn complete(&mut self, event: Option<Event>) {
        self.interpreter.events.extend(event);
        self.restart();
    }

    /// Ends a control string, which is a reply of the terminal, and adds the event of this reply.
    /// `terminator` ends the string for the parser.
    fn end_string(&mut self, terminator: &[u8]) {
        self.parse(terminator);
        let reply = std::mem::take(&mut self.interpreter.reply);
        self.complete(Some(Event::Reply(reply)));
    }

    fn paste(&mut self, byte: u8) {
        // Bytes of the paste after the first `MAX_PASTE` are skipped. The latest of them are kept
        // here only to recognise the end sequence.
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

    /// Reports the pasted text so far. The caller calls this after a pause in the paste. From the
    /// second pause on, the key Escape or Ctrl-C ends the paste if its byte is the last one before
    /// the pause. This key is then reported too.
    fn pause_paste(&mut self) {
        let is_paused = self.state == State::PausedPaste;
        let key = self.taken.pop_if(|last| is_paused && [ESC, ETX].contains(last));
        if !self.taken.is_empty() {
            self.end_paste();
        }
        self.restart();
        match key {
            Some(ESC) => {
                self.escape_given_up = true;
                self.interpreter.press(Key::plain(Code::Esc));
            }
            Some(key) => self.byte(key),
            None => self.state = State::PausedPaste,
        }
    }

    /// Ends an incomplete escape sequence. If only its first two bytes have arrived, reports the
    /// key Alt-`[`, Alt-`O` or a similar one.
    fn abandon(&mut self) {
        if let State::Introducer(introducer) = self.state {
            self.interpreter.alt = true;
            self.interpreter.press(Key::plain(Code::Char(char::from(introducer))));
        }
    }
}

/// Returns `true` if `bytes`, the result of one read, can only be the remainder of a reply of the
/// terminal. The first byte of the reply, an ESC, was the result of an earlier read. Typed
/// characters would not arrive together in one read.
fn is_reply_without_escape(bytes: &[u8]) -> bool {
    matches!(
        bytes,
        [b'[', b'?' | b'>' | b'0'..=b'9', _, ..]
            | [b']' | b'P', b'0'..=b'9' | b'>', _, ..]
            | [b'_', b'G', _, ..]
    )
}
