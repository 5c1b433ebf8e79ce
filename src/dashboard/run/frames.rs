//! From the model to the terminal's bytes: a frame is drawn, thinned out, encoded, sent.

use super::terminal::Tty;
use super::writer::{Writer, Written};
use crate::dashboard::model::Model;
use crate::dashboard::pacing::Pacing;
use crate::dashboard::view::View;
use crossbeam_channel::Receiver;
use ratatui::backend::{Backend, CrosstermBackend};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Frames on their way to the terminal, one at a time.
pub struct Frames {
    view: View,
    pacing: Pacing,
    writer: Writer,
    wanted: Buffer,
    /// Where the cursor is shown, if it is.
    cursor: Option<Position>,
}

impl Frames {
    /// For a terminal that shows nothing.
    pub(super) fn new(tty: Arc<Tty>) -> io::Result<Self> {
        // Which colours there are is the dashboard's to say, not that of a library that looks at the
        // environment by itself.
        crossterm::style::force_color_output(true);
        Ok(Self {
            view: View::default(),
            pacing: Pacing::new(),
            writer: Writer::new(tty)?,
            wanted: Buffer::empty(Rect::ZERO),
            cursor: None,
        })
    }

    /// Whether the terminal has taken the last frame.
    pub fn ready(&self) -> bool {
        self.writer.ready()
    }

    /// See [`Pacing::due`].
    pub fn due(&self, now: Duration, answers: bool) -> Duration {
        self.pacing.due(now, answers)
    }

    /// Draws the model and sends what has to change, if anything has; whether that is so. Only when
    /// [`Frames::ready`].
    pub fn draw(&mut self, model: &Model, now: Duration) -> io::Result<bool> {
        let [width, height] = model.screen;
        self.wanted.resize(Rect { x: 0, y: 0, width, height });
        self.wanted.reset();
        let cursor = self.view.draw(model, &mut self.wanted);
        let outgoing = self.pacing.outgoing(&self.wanted, now);
        if !outgoing.clear && outgoing.cells.is_empty() && cursor == self.cursor {
            return Ok(false);
        }
        self.cursor = cursor;
        let mut bytes = self.writer.buffer();
        let mut encoder = CrosstermBackend::new(&mut bytes);
        encoder.hide_cursor()?;
        if outgoing.clear {
            encoder.clear()?;
        }
        encoder.draw(outgoing.cells.iter().map(|(x, y, cell)| (*x, *y, cell)))?;
        if let Some(position) = cursor {
            encoder.set_cursor_position(position)?;
            encoder.show_cursor()?;
        }
        self.writer.send(bytes);
        Ok(true)
    }

    /// Tells when the frame on its way has been written.
    pub fn written(&self) -> &Receiver<Written> {
        self.writer.written()
    }

    /// Takes note that the frame on its way has been written; when that was.
    pub fn written_at(&mut self, frame: Written) -> io::Result<Instant> {
        self.writer.done(frame)
    }
}
