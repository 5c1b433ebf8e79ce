//! Terminal driver: decoding of input, probing of capabilities, raw mode and restoration, cells and
//! images as bytes, frame differences, flow control. The module is independent of scenes and of the
//! renderer.

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
mod restorer;
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
pub(crate) use probe::cursor_request;
pub use probe::probe;
pub use screen::{ENTER, LEAVE, Screen, Tty, cell_px, size};

/// Input of a terminal.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Key press.
    Key(Key),
    /// Mouse event.
    Mouse(Mouse),
    /// Pasted text.
    Paste(String),
    /// Reply of the terminal to a request of the program.
    Reply(Reply),
}

/// Reply of a terminal to a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Position of the cursor, counted from 1 (CPR).
    Cursor {
        /// Row.
        row: u16,
        /// Column.
        column: u16,
    },
    /// Device attributes (DA1): numbers of the supported features, such as 4 for sixel.
    Attributes(Vec<u16>),
    /// State of a private mode (DECRPM).
    Mode {
        /// Number of the mode.
        mode: u16,
        /// State: 0 unknown, 1 set, 2 reset, 3 permanently set, 4 permanently reset.
        setting: u16,
    },
    /// Default background colour, 8-bit sRGB (OSC 11).
    Background([u8; 3]),
    /// Name and version (XTVERSION).
    Version(String),
    /// Current value of a setting, in a valid reply to DECRQSS.
    Setting(String),
    /// Reply of kitty's graphics protocol. `true` means `OK`.
    Graphics(bool),
    /// Width and height of a cell in pixels.
    CellSize([u16; 2]),
    /// Largest number of colours of a sixel image (XTSMGRAPHICS).
    SixelColors(u16),
    /// Largest width and height of a sixel image in pixels (XTSMGRAPHICS).
    SixelSize([u16; 2]),
    /// Any other reply.
    Other,
}
