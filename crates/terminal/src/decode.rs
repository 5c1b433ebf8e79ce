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
//! - A reply may be cut off, so that the next key continues its sequence. A key is one character in
//!   a read of its own. It is decoded as a key if the sequence is not completed by it or after it.

use crate::event::Code;
use crate::sequence::{Interpreter, console_key, single_shift, x10_mouse};
use crate::{Event, Key, Reply};
use std::time::Duration;

/// Longest pause after an ESC or Ctrl-C that may end a paste.
const PASTE_KEY_WAIT: Duration = Duration::from_millis(500);
/// Longest pause inside pasted text, after which the text so far is reported.
const PASTE_WAIT: Duration = Duration::from_secs(10);
/// Largest number of bytes of a control string that are kept.
const MAX_STRING: usize = 4096;
/// Largest number of bytes of pasted text that are kept.
const MAX_PASTE: usize = 1 << 20;

const ETX: u8 = 0x03;
const ESC: u8 = 0x1b;
const BEL: u8 = 0x07;
const CAN: u8 = 0x18;
const SUB: u8 = 0x1a;
const PASTE_END: &[u8] = b"\x1b[201~";

/// Kind of character or escape sequence that the next byte belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Ground,
    /// UTF-8 character of several bytes.
    Character,
    Escape,
    /// After ESC and this byte, which begin a sequence or are a key pressed with Alt.
    Introducer(u8),
    /// After `ESC O` and the digits of this number, which encodes the modifiers of the next key.
    SingleShift(u16),
    /// Control sequence, after `ESC [`.
    ControlSequence,
    /// Function key of the Linux console, after `ESC [ [`.
    Console,
    /// Mouse report of the X10 protocol, after `ESC [ M`.
    X10Mouse,
    /// Control string that ESC and this byte began.
    String(u8),
    /// ESC inside a control string. A backslash ends the string.
    StringEscape,
    Paste,
    /// Pasted text whose first part was reported after a pause.
    PausedPaste,
}

/// Decoder of terminal input. If no byte arrives within [`Decoder::patience`], the caller calls
/// [`Decoder::give_up`].
#[derive(Default)]
pub struct Decoder {
    parser: vte::Parser,
    interpreter: Interpreter,
    state: State,
    /// Bytes of the pasted text or of the X10 mouse report.
    taken: Vec<u8>,
    /// Number of bytes of the control string so far.
    string_length: usize,
    /// Longest pause inside an escape sequence.
    sequence_wait: Duration,
    /// Bytes of the current sequence, at most [`MAX_STRING`]. After it was given up, they are kept
    /// until the next read.
    sequence: Vec<u8>,
    /// Characters of the sequence that may be keys: each arrived in a read of its own.
    possible_keys: Vec<u8>,
    /// `true` if the read consists of one character, which may be a key.
    is_possible_key: bool,
}

impl Decoder {
    /// Creates a decoder. `sequence_wait` is the longest pause inside an escape sequence.
    pub fn new(sequence_wait: Duration) -> Self {
        Self { sequence_wait, ..Self::default() }
    }

    /// Decodes the result of one read, and returns the events that it completes.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<Event> {
        if let Some(events) = self.rest_of_reply(bytes) {
            return events;
        }
        let outside = [State::Ground, State::Character, State::Escape];
        let is_one = std::str::from_utf8(bytes).is_ok_and(|text| text.chars().count() == 1);
        self.is_possible_key = is_one && !outside.contains(&self.state);
        for byte in bytes {
            if self.state == State::Ground {
                self.sequence.clear();
            }
            if self.sequence.len() < MAX_STRING {
                self.sequence.push(*byte);
            }
            self.byte(*byte);
        }
        match self.state {
            State::Ground => self.sequence.clear(),
            state if self.is_possible_key && !outside.contains(&state) => {
                self.possible_keys.extend(bytes);
            }
            _ => {}
        }
        std::mem::take(&mut self.interpreter.events)
    }

    /// Returns the events of `bytes` if they can only be the rest of a sequence that was given up:
    /// typed keys would not arrive in one read.
    fn rest_of_reply(&mut self, bytes: &[u8]) -> Option<Vec<Event>> {
        if self.state != State::Ground || self.sequence.first() != Some(&ESC) {
            return None;
        }
        let sequence = std::mem::take(&mut self.sequence);
        let is_modified_key = sequence == [ESC] && matches!(bytes, [b'[', b'0'..=b'9', _, ..]);
        let mut decoder = Self::new(self.sequence_wait);
        decoder.take(&sequence);
        let events = decoder.take(bytes);
        let is_rest = bytes.len() > 1
            && sequence.len() + bytes.len() > 3
            && match events.first() {
                Some(Event::Reply(_) | Event::Mouse(_)) => true,
                Some(Event::Key(_)) => is_modified_key,
                Some(Event::Paste(_)) | None => false,
            };
        is_rest.then(|| {
            *self = decoder;
            events
        })
    }

    /// Returns the longest time to wait for the next byte of the current sequence. Returns `None`
    /// between sequences, and after a pause in a paste until more text arrives.
    pub fn patience(&self) -> Option<Duration> {
        match self.state {
            State::Ground => None,
            State::Paste => Some(PASTE_WAIT),
            State::PausedPaste if self.taken.is_empty() => None,
            State::PausedPaste => Some(PASTE_KEY_WAIT),
            _ => Some(self.sequence_wait),
        }
    }

    /// Ends an incomplete sequence after a pause. Returns its events.
    pub fn give_up(&mut self) -> Vec<Event> {
        match self.state {
            State::Escape => self.give_up_escape(),
            State::Paste | State::PausedPaste => self.pause_paste(),
            _ => {
                self.abandon();
                if self.state == State::Escape {
                    self.give_up_escape();
                }
            }
        }
        std::mem::take(&mut self.interpreter.events)
    }

    /// Decodes one byte according to the state.
    fn byte(&mut self, byte: u8) {
        match self.state {
            State::Paste | State::PausedPaste => self.paste(byte),
            State::Ground | State::Character => self.character(byte),
            State::Escape => self.escape(byte),
            State::Introducer(introducer) => self.introduced(introducer, byte),
            State::ControlSequence
            | State::Console
            | State::X10Mouse
            | State::SingleShift(_)
            | State::String(_) => self.sequence(byte),
            State::StringEscape if byte == b'\\' => self.end_string(b"\x1b\\"),
            State::StringEscape => {
                // Another sequence interrupts the string.
                self.abandon();
                self.state = State::Escape;
                self.byte(byte);
            }
        }
    }

    /// Decodes a byte outside sequences.
    fn character(&mut self, byte: u8) {
        match (self.state, byte) {
            (State::Ground, ESC) => {
                self.restart();
                self.state = State::Escape;
            }
            (State::Ground, _) | (_, 0x80..=0xbf) => {
                self.interpreter.is_character_complete = false;
                self.parse(&[byte]);
                let is_complete = self.interpreter.is_character_complete;
                self.state = if is_complete { State::Ground } else { State::Character };
            }
            // An incomplete UTF-8 character produces no key.
            _ => {
                self.restart();
                self.byte(byte);
            }
        }
    }

    fn escape(&mut self, byte: u8) {
        match byte {
            ESC => self.interpreter.press(Key::plain(Code::Esc)),
            b'[' | b'O' | b'P' | b']' | b'_' => self.state = State::Introducer(byte),
            _ => {
                self.interpreter.alt = true;
                self.in_ground(byte);
            }
        }
    }

    /// Decodes the byte after ESC and `introducer`.
    fn introduced(&mut self, introducer: u8, byte: u8) {
        match (introducer, byte) {
            (b'[', b'[') => self.state = State::Console,
            (b'[', b'M') => self.state = State::X10Mouse,
            (b'[', 0x20..=0x7e) => {
                self.parse(b"\x1b[");
                self.state = State::ControlSequence;
                self.byte(byte);
            }
            (b'O', b'0'..=b'9' | 0x40..=0x7e) => {
                self.state = State::SingleShift(0);
                self.byte(byte);
            }
            (b'[' | b'O', _) => {
                self.abandon();
                self.in_ground(byte);
            }
            _ => {
                self.interpreter.is_apc = introducer == b'_';
                self.interpreter.reply = Reply::Other;
                self.string_length = 0;
                self.parse(if introducer == b']' { b"\x1b]" } else { b"\x1bP" });
                self.state = State::String(introducer);
                self.byte(byte);
            }
        }
    }

    /// Decodes a byte inside a sequence or a control string.
    fn sequence(&mut self, byte: u8) {
        match (self.state, byte) {
            (State::ControlSequence, 0x20..=0x3f) => self.parse(&[byte]),
            (State::ControlSequence, 0x40..=0x7e) => {
                self.interpreter.is_known = false;
                self.parse(&[byte]);
                if self.is_possible_key && !self.interpreter.is_known {
                    self.abandon();
                    return self.byte(byte);
                }
                self.restart();
                if std::mem::take(&mut self.interpreter.is_paste) {
                    self.state = State::Paste;
                }
            }
            (State::Console, _) => self.complete(console_key(byte)),
            (State::X10Mouse, _) => {
                self.taken.push(byte);
                if self.taken.len() == 3 {
                    let report = std::mem::take(&mut self.taken);
                    self.complete(x10_mouse(&report));
                }
            }
            (State::SingleShift(modifiers), b'0'..=b'9') => {
                let digit = u16::from(byte - b'0');
                let modifiers = modifiers.saturating_mul(10).saturating_add(digit);
                self.state = State::SingleShift(modifiers);
            }
            (State::SingleShift(modifiers), 0x40..=0x7e) => {
                self.complete(single_shift(modifiers, byte));
            }
            (State::String(_), ESC) => self.state = State::StringEscape,
            (State::String(b']'), BEL) => self.end_string(b"\x07"),
            (State::String(_), CAN | SUB) => self.abandon(),
            (State::String(b'P' | b'_'), 0x80..) => {}
            (State::String(_), _) => {
                self.string_length += 1;
                if self.string_length <= MAX_STRING {
                    self.parse(&[byte]);
                }
            }
            _ => {
                self.abandon();
                self.byte(byte);
            }
        }
    }

    fn parse(&mut self, bytes: &[u8]) {
        self.parser.advance(&mut self.interpreter, bytes);
    }

    /// Resets the decoder to the state between sequences.
    fn restart(&mut self) {
        self.parser = vte::Parser::new();
        self.interpreter.alt = false;
        self.state = State::Ground;
        self.taken.clear();
        self.possible_keys.clear();
    }

    /// Decodes `byte` as the first byte of a new sequence. A pending Alt modifier applies to it.
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

    /// Ends a control string by `terminator` and adds its reply.
    fn end_string(&mut self, terminator: &[u8]) {
        self.parse(terminator);
        let reply = std::mem::take(&mut self.interpreter.reply);
        self.complete(Some(Event::Reply(reply)));
    }

    fn paste(&mut self, byte: u8) {
        // The last bytes are kept to recognise the end sequence.
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

    /// Reports the pasted text so far after a pause. From the second pause on, a final Escape or
    /// Ctrl-C ends the paste and is reported too.
    fn pause_paste(&mut self) {
        let is_paused = self.state == State::PausedPaste;
        let key = self.taken.pop_if(|last| is_paused && [ESC, ETX].contains(last));
        if !self.taken.is_empty() {
            self.end_paste();
        }
        self.restart();
        match key {
            Some(ESC) => self.give_up_escape(),
            Some(key) => self.byte(key),
            None => self.state = State::PausedPaste,
        }
    }

    fn give_up_escape(&mut self) {
        self.restart();
        self.interpreter.press(Key::plain(Code::Esc));
    }

    /// Ends an incomplete sequence, and decodes the keys that it may have swallowed. The first two
    /// bytes of a sequence alone are a key such as Alt-`[`.
    fn abandon(&mut self) {
        if let State::Introducer(introducer) = self.state {
            self.interpreter.alt = true;
            self.interpreter.press(Key::plain(Code::Char(char::from(introducer))));
        }
        let keys = std::mem::take(&mut self.possible_keys);
        self.restart();
        keys.into_iter().for_each(|byte| self.byte(byte));
    }
}
