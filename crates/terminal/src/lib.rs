//! Terminal driver for full-screen programs that show pictures, also over slow connections.
//!
//! - [`Screen`] starts full-screen use and restores the terminal, even after a crash; [`SignalQueue`]
//!   turns signals into events.
//! - [`query_capabilities`] asks what the terminal supports; [`InputReader`] decodes keys, mouse
//!   events, pasted text and replies.
//! - [`cells`] converts images to glyphs with colours; [`image`] encodes them by kitty's protocol and
//!   sixel.
//! - [`diff`] encodes the differences between two ratatui buffers, within a byte budget that [`flow`]
//!   derives from the rate of the connection.
//!
//! The crate knows no scene and no renderer.

// Many variants and fields speak for themselves.
#![allow(missing_docs)]

mod capabilities;
mod capability_query;
pub mod cells;
mod clipboard;
mod decode;
pub mod diff;
mod download;
pub mod event;
pub mod flow;
mod hyperlink;
pub mod image;
mod input_reader;
mod restorer;
mod screen;
mod sequence;
mod signals;
#[cfg(test)]
mod tests;

use crate::event::{Key, Mouse};
pub use capabilities::{Capabilities, Environment, Multiplexer};
pub use capability_query::{ATTRIBUTES, query_capabilities, query_passthrough};
pub use clipboard::copied;
pub use decode::Decoder;
pub use download::{file_transfer, stores_files};
pub use hyperlink::hyperlink;
pub use input_reader::{InputReader, TimedEvent};
pub use restorer::supervised;
pub use screen::{ENTER, LEAVE, Screen, Tty, cell_px, size};
pub use signals::{HUNG_UP, INTERRUPTED, SignalEvent, SignalQueue, Signals, is_in_foreground};

/// Event that was decoded from terminal input.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    Key(Key),
    Mouse(Mouse),
    Paste(String),
    Reply(Reply),
}

/// Reply of the terminal to a request of the program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Reply {
    /// Report that the terminal works (DSR).
    Status,
    /// Numbers of the supported features, such as 4 for sixel (DA1).
    Attributes(Vec<u16>),
    /// State of a private mode of the terminal (DECRPM).
    Mode {
        mode: u16,
        /// 0 unknown, 1 set, 2 reset, 3 permanently set, 4 permanently reset.
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
    /// Width and height of a cell in pixels.
    CellSize([u16; 2]),
    /// Largest number of colours of a sixel image (XTSMGRAPHICS).
    SixelColors(u16),
    /// Largest width and height of a sixel image in pixels (XTSMGRAPHICS).
    SixelSize([u16; 2]),
    /// Reply that the program does not use.
    #[default]
    Other,
}
