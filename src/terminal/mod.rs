//! The terminal at the other end of the line: what it sends, what it can do, how it is taken and given
//! back. Nothing here knows what is shown.

mod area;
mod capabilities;
pub mod cells;
mod clipboard;
mod decode;
pub mod diff;
pub mod event;
pub mod flow;
pub mod image;
mod keyboard;
mod probe;
mod screen;
mod sequence;
#[cfg(test)]
mod tests;

use crate::terminal::event::{Key, Mouse};
pub use area::Area;
pub use capabilities::{Capabilities, Environment, Multiplexer};
pub(crate) use clipboard::copied;
pub use decode::Decoder;
pub use keyboard::{Keyboard, Timed};
pub(crate) use probe::cursor_question;
pub use probe::probe;
pub use screen::{ENTER, LEAVE, Screen, Tty, cell_px, size};

/// What a terminal sends.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A key was pressed.
    Key(Key),
    /// The mouse did something.
    Mouse(Mouse),
    /// Text was pasted.
    Paste(String),
    /// An answer to a question.
    Reply(Reply),
}

/// An answer of a terminal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Where the cursor is, from 1 (CPR).
    Cursor {
        /// Row.
        row: u16,
        /// Column.
        column: u16,
    },
    /// What it is and can do (DA1), such as 4: sixel.
    Attributes(Vec<u16>),
    /// Whether a private mode is known (DECRPM): 0 no, 1 set, 2 reset, 3 always set, 4 never.
    Mode {
        /// The mode.
        mode: u16,
        /// What is known about it.
        setting: u16,
    },
    /// The colour of the background, sRGB.
    Background([u8; 3]),
    /// Name and version (XTVERSION).
    Version(String),
    /// A valid answer to DECRQSS.
    Setting(String),
    /// An answer to a question about kitty's graphics: whether it was `OK`.
    Graphics(bool),
    /// Width and height of a cell in pixels.
    CellSize([u16; 2]),
    /// How many colours a sixel picture has (XTSMGRAPHICS).
    SixelColors(u16),
    /// How many pixels in a row and in a column of it.
    SixelSize([u16; 2]),
    /// Anything else.
    Other,
}
