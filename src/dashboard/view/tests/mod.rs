//! Tests of screens in each state of the model at several sizes.
//!
//! The files in `tests/screens` contain the text of every screen. If the environment variable
//! `ZERKALO_BLESS` is 1, the golden test rewrites these files.

mod golden;
mod paint;
mod robust;
mod states;
mod styles;

use crate::dashboard::Model;
use crate::dashboard::view::View;
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};

/// Returns the screen of `model`, and the position of its text cursor: `None` if it is hidden.
fn drawn(model: &Model) -> (Buffer, Option<Position>) {
    let [width, height] = model.screen;
    let mut buffer = Buffer::empty(Rect { x: 0, y: 0, width, height });
    let cursor = View::default().draw(model, &mut buffer);
    (buffer, cursor)
}

/// Returns the text of a row without trailing blanks.
fn row_text(buffer: &Buffer, y: u16) -> String {
    let mut text = String::new();
    let mut hidden = 0;
    for x in buffer.area.left()..buffer.area.right() {
        // Cells covered by a wide character are skipped.
        if hidden > 0 {
            hidden -= 1;
            continue;
        }
        let symbol = buffer[(x, y)].symbol();
        hidden = crate::dashboard::text::columns(symbol).saturating_sub(1);
        text += symbol;
    }
    text.trim_end().to_string()
}
