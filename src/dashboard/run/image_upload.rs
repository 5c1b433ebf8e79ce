//! Upload of a viewer image to the terminal in slices.

use crate::terminal::image::ViewerImage;
use std::sync::Arc;

/// Largest size of a slice in bytes. It bounds the latency of keys, because no frame can be sent
/// while a slice is being written.
const SLICE: usize = 1 << 18;
/// String terminator (ST), which ends an incomplete escape sequence.
const END: &[u8] = b"\x1b\\";

/// An image and the progress of its upload.
#[derive(Debug)]
pub struct ImageUpload {
    image: Arc<ViewerImage>,
    /// Number of bytes sent.
    sent: usize,
    /// `true` if the bytes sent so far end inside of an escape sequence, whose remainder must be
    /// sent next.
    open: bool,
    /// `true` if the image is already visible as half blocks.
    pub seen: bool,
}

impl ImageUpload {
    /// Creates the upload of `image`; nothing has been sent.
    pub fn new(image: Arc<ViewerImage>) -> Self {
        Self { image, sent: 0, open: false, seen: false }
    }

    /// Returns `true` if `image` is the image of this upload.
    pub fn is_of(&self, image: &Arc<ViewerImage>) -> bool {
        Arc::ptr_eq(&self.image, image)
    }

    /// Returns `true` if the bytes sent so far end inside of an escape sequence, so that no other
    /// output may follow.
    pub fn is_open(&self) -> bool {
        self.open
    }

    /// Returns `true` if the upload has begun. The half blocks under the image must not be sent
    /// from then on.
    pub fn has_begun(&self) -> bool {
        self.sent > 0
    }

    /// Returns `true` if the upload is incomplete.
    pub fn is_unfinished(&self) -> bool {
        self.sent < self.image.transfer.bytes.len()
    }

    /// Returns `true` if the uploaded image replaces its half blocks already, or may be sent next.
    /// `waits` is `true` if half blocks still differ visibly from the screen.
    pub fn follows(&self, waits: bool) -> bool {
        self.has_begun() || self.is_unfinished() && (self.seen || !waits)
    }

    /// Returns the transferred fraction of the image, 0..=1.
    pub fn share(&self) -> f64 {
        let all = self.image.transfer.bytes.len().max(1);
        self.sent as f64 / all as f64
    }

    /// Appends the next slice, of about `room` bytes, to `out`.
    pub fn next(&mut self, room: usize, out: &mut Vec<u8>) {
        let transfer = &self.image.transfer;
        let (range, open) = transfer.slice(self.sent, room.min(SLICE));
        out.extend(&transfer.bytes[range.clone()]);
        (self.sent, self.open) = (range.end, open);
    }

    /// Returns the sequence that removes the transferred part of the image, and `true` if the cells
    /// below must be redrawn after it.
    pub fn removal(&self) -> (Vec<u8>, bool) {
        let transfer = &self.image.transfer;
        if !self.has_begun() {
            return (Vec::new(), false);
        }
        let end = if self.open { END } else { b"" };
        ([end, &transfer.remove].concat(), transfer.destroys)
    }

    /// Returns a sequence that removes the image at any stage of the upload.
    pub fn any_removal(&self) -> Vec<u8> {
        let clear: &[u8] = if self.image.transfer.destroys { b"\x1b[2J" } else { b"" };
        [END, &self.image.transfer.remove, clear].concat()
    }
}
