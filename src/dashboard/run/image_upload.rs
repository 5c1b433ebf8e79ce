//! A still on its way to the terminal, slice by slice, or there.

use crate::terminal::image::ViewerImage;
use std::sync::Arc;

/// The most bytes at once, so that a key takes effect soon however fast the line seems to be.
const SLICE: usize = 1 << 18;
/// What ends a sequence that was cut.
const END: &[u8] = b"\x1b\\";

/// A still of which something may have been sent.
#[derive(Debug)]
pub struct ImageUpload {
    still: Arc<ViewerImage>,
    sent: usize,
    /// A sequence is open: nothing else can be sent.
    open: bool,
    /// The still has been seen in half blocks, if coarsely.
    pub seen: bool,
}

impl ImageUpload {
    /// Nothing has been sent.
    pub fn new(still: Arc<ViewerImage>) -> Self {
        Self { still, sent: 0, open: false, seen: false }
    }

    /// Whether it is this one.
    pub fn is_of(&self, still: &Arc<ViewerImage>) -> bool {
        Arc::ptr_eq(&self.still, still)
    }

    /// Whether a sequence is open.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Whether something was sent: the cells below must not be sent any more.
    pub fn has_begun(&self) -> bool {
        self.sent > 0
    }

    /// Whether there is something to be sent still.
    pub fn is_unfinished(&self) -> bool {
        self.sent < self.still.transfer.bytes.len()
    }

    /// Whether it comes, or lies, over the picture in half blocks. `waits`: differences of that can
    /// still be seen.
    pub fn follows(&self, waits: bool) -> bool {
        self.has_begun() || self.is_unfinished() && (self.seen || !waits)
    }

    /// How much has been sent, 0..=1.
    pub fn share(&self) -> f64 {
        let all = self.still.transfer.bytes.len().max(1);
        self.sent as f64 / all as f64
    }

    /// Writes the next slice, about as large as there is `room`.
    pub fn next(&mut self, room: usize, out: &mut Vec<u8>) {
        let transfer = &self.still.transfer;
        let (range, open) = transfer.slice(self.sent, room.min(SLICE));
        out.extend(&transfer.bytes[range.clone()]);
        (self.sent, self.open) = (range.end, open);
    }

    /// What takes away what has been sent; and whether what is below has to be drawn again.
    pub fn removal(&self) -> (Vec<u8>, bool) {
        let transfer = &self.still.transfer;
        if !self.has_begun() {
            return (Vec::new(), false);
        }
        let end = if self.open { END } else { b"" };
        ([end, &transfer.remove].concat(), transfer.destroys)
    }

    /// The same whatever will have been sent.
    pub fn any_removal(&self) -> Vec<u8> {
        let clear: &[u8] = if self.still.transfer.destroys { b"\x1b[2J" } else { b"" };
        [END, &self.still.transfer.remove, clear].concat()
    }
}
