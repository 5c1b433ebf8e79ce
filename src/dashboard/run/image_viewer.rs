//! Written pictures made ready to be looked at.

use crate::dashboard::message::Message;
use crate::dashboard::overlay::Overlay;
use crate::dashboard::run::{Dashboard, TELL_INTERVAL};
use crate::film::Display;
use crate::terminal::cell_px;
use crate::terminal::image::{ImageViewport, Protocol, ViewerImage};
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// A still takes no longer than this to be sent, whatever the line carries.
const LONGEST: Duration = Duration::from_secs(8);

impl Dashboard {
    /// Reads the picture at `path` and makes it ready for a screen, in a thread of its own.
    pub(super) fn prepare_still(&self, path: &Path, display: Display, screen: [u16; 2]) {
        // The terminal's font may have another size than at the start.
        let cell_px = cell_px().or(self.terminal.cell_px);
        let mut terminal = self.terminal.clone();
        terminal.cell_px = cell_px;
        let most_bytes = self.frames.reading().map(|line| line.rate * LONGEST.as_secs_f64());
        let protocol = Protocol::of(&terminal);
        let window = ImageViewport {
            protocol,
            screen,
            cell_px,
            sixel_px: terminal.sixel_px,
            max_bytes: most_bytes,
        };
        let (path, results) = (path.to_path_buf(), self.hands.results());
        let failed = results.clone();
        let asked = path.clone();
        let started = thread::Builder::new().name("still".into()).spawn(move || {
            let still = ViewerImage::read(&path, &display, &window).map(Arc::new);
            // Nobody listens any more when the program ends.
            let _ = results.send(Message::ViewerImage(path, still));
        });
        if let Err(error) = started {
            let _ = failed.send(Message::ViewerImage(asked, Err(error.to_string())));
        }
    }

    /// Tells the model now and then how much of a still has been sent.
    pub(super) fn tell_of_still(&mut self, now: Duration) {
        let Some(sent) = self.frames.still_sent() else { return };
        let known = match &self.model.overlay {
            Some(Overlay::ViewerImage(looked)) => looked.sent,
            _ => return,
        };
        if sent != known && (sent == 1.0 || self.status_sent_at + TELL_INTERVAL <= now) {
            self.status_sent_at = now;
            self.dispatch(Message::StillSent(sent));
        }
    }
}
