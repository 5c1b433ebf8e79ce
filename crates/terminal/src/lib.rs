//! Terminal driver: decoding of input, query of capabilities, raw mode and its restoration,
//! encoding of cells and images, frame differences, flow control. The module is independent of
//! scenes and of the renderer.

mod capabilities;
mod capability_query;
pub mod cells;
mod clipboard;
mod decode;
pub mod diff;
pub mod event;
pub mod flow;
pub mod image;
mod input_reader;
mod restorer;
mod screen;
mod sequence;
#[cfg(test)]
mod tests;

use crate::event::{Key, Mouse};
pub use capabilities::{Capabilities, Environment, Multiplexer};
pub use capability_query::cursor_request;
pub use capability_query::query_capabilities;
pub use clipboard::copied;
pub use decode::Decoder;
pub use input_reader::{InputReader, TimedEvent};
pub use screen::{ENTER, LEAVE, Screen, Tty, cell_px, size};

/// Event to which terminal input is decoded.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Key press by the user.
    Key(Key),
    /// Mouse button, drag or wheel event.
    Mouse(Mouse),
    /// Pasted text.
    Paste(String),
    /// Reply of the terminal to a request of the program.
    Reply(Reply),
}

/// Reply of the terminal to a request of the program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Reply {
    /// Position of the cursor, counted from 1 (CPR).
    Cursor {
        /// Row of the cursor, counted from 1.
        row: u16,
        /// Column of the cursor, counted from 1.
        column: u16,
    },
    /// Device attributes (DA1): numbers of the supported features, such as 4 for sixel.
    Attributes(Vec<u16>),
    /// State of a private mode of the terminal (DECRPM).
    Mode {
        /// Number of the terminal's private mode (DEC).
        mode: u16,
        /// State of the mode: 0 unknown, 1 set, 2 reset, 3 permanently set, 4 permanently reset.
        setting: u16,
    },
    /// Default background colour, 8-bit sRGB (OSC 11).
    Background([u8; 3]),
    /// Name and version of the terminal (XTVERSION).
    Version(String),
    /// Current value of a terminal setting, in a valid reply to DECRQSS.
    Setting(String),
    /// Result of a command of kitty's graphics protocol. `true` means `OK`.
    Graphics(bool),
    /// Width and height of a terminal cell in pixels.
    CellSize([u16; 2]),
    /// Largest number of colours of a sixel image (XTSMGRAPHICS).
    SixelColors(u16),
    /// Largest width and height of a sixel image in pixels (XTSMGRAPHICS).
    SixelSize([u16; 2]),
    /// Reply that the program does not use.
    #[default]
    Other,
}
