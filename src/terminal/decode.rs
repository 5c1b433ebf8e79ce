//! From the bytes of a terminal to keys, mouse, pasted text and replies.
//!
//! First the stream is cut into characters and escape sequences by their framing (ECMA-48, with the
//! strings of DCS, OSC and APC), then whole sequences are read. So a reply that nobody knows is
//! passed over whole: it never becomes keys, and never keeps later keys from being seen.

use crate::terminal::event::Code;
use crate::terminal::sequence;
use crate::terminal::{Event, Key};
use std::time::Duration;

/// How long the rest of a sequence may take that begins like a key with Alt (`ESC [`, `ESC O`, …).
const INTRODUCER_WAIT: Duration = Duration::from_millis(500);
/// How long the rest of any other sequence may take before what there is of it is given up.
const SEQUENCE_WAIT: Duration = Duration::from_secs(2);
/// How long pasted text may pause before what there is of it is taken for all.
const PASTE_WAIT: Duration = Duration::from_secs(10);
/// Bytes of a sequence that are kept; of a longer one the rest is passed over.
const LONGEST: usize = 4096;
/// Bytes of pasted text that are kept; of a longer one the rest is passed over.
const LONGEST_PASTE: usize = 1 << 20;

const ESC: u8 = 0x1b;
const BEL: u8 = 0x07;
const CAN: u8 = 0x18;
const SUB: u8 = 0x1a;
const PASTE_BEGIN: &[u8] = b"200~";
const PASTE_END: &[u8] = b"\x1b[201~";

/// Where in the stream the next byte is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Ground,
    /// After a leading byte of UTF-8: so many more follow.
    Character(u8),
    Escape,
    /// After `ESC [`.
    Control,
    /// After `ESC [ [`: a function key of the Linux console.
    Console,
    /// After `ESC [ M`: three bytes of the old mouse protocol, so many of which are to come.
    OldMouse(u8),
    /// After `ESC O`.
    Single,
    /// In a string that `ESC P`, `ESC ]` or `ESC _` has begun.
    Text(u8),
    /// After ESC in such a string.
    TextEscape(u8),
    Paste,
}

/// Reads the bytes of a terminal. Time is told to it: after [`Decoder::patience`] without a byte
/// comes [`Decoder::give_up`].
#[derive(Debug)]
pub struct Decoder {
    state: State,
    /// What has come of the sequence after its introducer, or of a character, or of pasted text.
    taken: Vec<u8>,
    /// Whether the character that comes was announced by ESC.
    alt: bool,
    escape_wait: Duration,
    /// The last byte was an ESC for whose followers nobody waited any more.
    parted: bool,
    events: Vec<Event>,
}

impl Decoder {
    /// `escape_wait`: how long after ESC a byte may come that belongs to it; the key Escape is known
    /// for certain only then.
    pub fn new(escape_wait: Duration) -> Self {
        Self {
            state: State::Ground,
            taken: Vec::new(),
            alt: false,
            escape_wait,
            parted: false,
            events: Vec::new(),
        }
    }

    /// Takes bytes that came together; what they say, with what has come before.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<Event> {
        if std::mem::take(&mut self.parted) && is_rest_of_reply(bytes) {
            self.state = State::Escape;
        }
        for byte in bytes {
            self.byte(*byte);
        }
        std::mem::take(&mut self.events)
    }

    /// How long to wait for more bytes; `None`: nothing is half-way.
    pub fn patience(&self) -> Option<Duration> {
        match self.state {
            State::Ground => None,
            State::Escape => Some(self.escape_wait),
            State::Control | State::Single | State::Text(_) if self.taken.is_empty() => {
                Some(INTRODUCER_WAIT)
            }
            State::Paste => Some(PASTE_WAIT),
            _ => Some(SEQUENCE_WAIT),
        }
    }

    /// No byte has come for so long: what there is counts as it is.
    pub fn give_up(&mut self) -> Vec<Event> {
        match self.state {
            State::Escape => {
                self.parted = true;
                self.key(Key::plain(Code::Esc));
            }
            State::Paste => self.pasted(),
            _ => self.abandon(),
        }
        self.state = State::Ground;
        self.taken.clear();
        self.alt = false;
        std::mem::take(&mut self.events)
    }

    fn byte(&mut self, byte: u8) {
        match self.state {
            State::Ground => self.ground(byte),
            State::Character(left) => self.character(byte, left),
            State::Escape => self.escape(byte),
            State::Control => self.control(byte),
            State::Console => {
                self.state = State::Ground;
                self.events.extend(sequence::console(byte));
            }
            State::OldMouse(left) => {
                self.taken.push(byte);
                self.state = State::OldMouse(left - 1);
                if left == 1 {
                    self.state = State::Ground;
                    self.events.extend(sequence::old_mouse(&self.taken));
                }
            }
            State::Single => self.single(byte),
            State::Text(kind) => match byte {
                ESC => self.state = State::TextEscape(kind),
                BEL if kind == b']' => self.text_ends(kind),
                CAN | SUB => self.state = State::Ground,
                _ => self.keep(byte),
            },
            State::TextEscape(kind) if byte == b'\\' => self.text_ends(kind),
            State::TextEscape(_) => {
                // The string was cut off; something else has begun.
                self.state = State::Escape;
                self.escape(byte);
            }
            State::Paste => self.paste(byte),
        }
    }

    fn ground(&mut self, byte: u8) {
        self.taken.clear();
        match byte {
            ESC => self.state = State::Escape,
            0xc2..=0xf4 => {
                self.taken.push(byte);
                // A leading byte tells by its upper bits how many follow.
                self.state = State::Character((byte.leading_ones() - 1) as u8);
            }
            0x80.. => self.alt = false,
            _ => {
                if let Some(key) = sequence::character(char::from(byte)) {
                    self.key(key);
                }
                self.alt = false;
            }
        }
    }

    fn character(&mut self, byte: u8, left: u8) {
        if byte & 0xc0 != 0x80 {
            // No character after all.
            self.state = State::Ground;
            self.alt = false;
            return self.ground(byte);
        }
        self.taken.push(byte);
        self.state = State::Character(left - 1);
        if left == 1 {
            self.state = State::Ground;
            let read = std::str::from_utf8(&self.taken).ok().and_then(|text| text.chars().next());
            if let Some(key) = read.and_then(sequence::character) {
                self.key(key);
            }
            self.alt = false;
        }
    }

    fn escape(&mut self, byte: u8) {
        self.taken.clear();
        self.state = match byte {
            b'[' => State::Control,
            b'O' => State::Single,
            b'P' | b']' | b'_' => State::Text(byte),
            ESC => {
                self.key(Key::plain(Code::Esc));
                State::Escape
            }
            _ => {
                self.state = State::Ground;
                self.alt = true;
                return self.ground(byte);
            }
        };
    }

    fn control(&mut self, byte: u8) {
        match byte {
            b'[' if self.taken.is_empty() => self.state = State::Console,
            b'M' if self.taken.is_empty() => self.state = State::OldMouse(3),
            0x40..=0x7e => {
                self.keep(byte);
                self.state = State::Ground;
                if self.taken == PASTE_BEGIN {
                    self.taken.clear();
                    self.state = State::Paste;
                } else {
                    self.events.extend(sequence::control(&self.taken));
                }
            }
            0x20..=0x3f => self.keep(byte),
            _ => {
                self.abandon();
                self.state = State::Ground;
                self.ground(byte);
            }
        }
    }

    fn single(&mut self, byte: u8) {
        match byte {
            b'0'..=b'9' => self.keep(byte),
            0x40..=0x7e => {
                self.state = State::Ground;
                self.events.extend(sequence::single(byte, &self.taken));
            }
            _ => {
                self.abandon();
                self.state = State::Ground;
                self.ground(byte);
            }
        }
    }

    fn text_ends(&mut self, kind: u8) {
        self.state = State::Ground;
        self.events.extend(sequence::text(kind, &self.taken));
    }

    fn paste(&mut self, byte: u8) {
        // What is too much still has to be looked through for the end.
        if self.taken.len() >= LONGEST_PASTE + PASTE_END.len() {
            self.taken.remove(LONGEST_PASTE);
        }
        self.taken.push(byte);
        if self.taken.ends_with(PASTE_END) {
            let length = self.taken.len() - PASTE_END.len();
            self.taken.truncate(length);
            self.pasted();
            self.state = State::Ground;
        }
    }

    fn pasted(&mut self) {
        let text = String::from_utf8_lossy(&self.taken).into_owned();
        self.events.push(Event::Paste(text));
        self.taken.clear();
    }

    /// A sequence ends before it is complete. If it had just begun it was a key with Alt.
    fn abandon(&mut self) {
        let introducer = match self.state {
            State::Control => b'[',
            State::Single => b'O',
            State::Text(kind) => kind,
            _ => return,
        };
        if self.taken.is_empty() {
            self.alt = true;
            self.key(Key::plain(Code::Char(char::from(introducer))));
        }
    }

    fn keep(&mut self, byte: u8) {
        if self.taken.len() < LONGEST {
            self.taken.push(byte);
        }
    }

    fn key(&mut self, key: Key) {
        let alt = std::mem::take(&mut self.alt);
        self.events.push(Event::Key(Key { alt: key.alt | alt, ..key }));
    }
}

/// Whether bytes that came together after a lone ESC can only be the rest of a reply: nobody types
/// these so fast.
fn is_rest_of_reply(bytes: &[u8]) -> bool {
    matches!(
        bytes,
        [b'[', b'?' | b'>' | b'0'..=b'9', _, ..]
            | [b']' | b'P', b'0'..=b'9' | b'>', _, ..]
            | [b'_', b'G', _, ..]
    )
}
