//! Upload of an image for the viewer, in parts of limited size.

use std::sync::Arc;
use zerkalo_terminal::image::ViewerImage;

/// Largest number of bytes of a part. It bounds the latency of keys, because no frame can be sent
/// during a part.
const SLICE: usize = 1 << 18;
/// String terminator (ST), which ends an incomplete escape sequence.
const END: &[u8] = b"\x1b\\";

/// Image for the viewer, and the progress of its upload to the terminal.
#[derive(Debug)]
pub struct ImageUpload {
    pub image: Arc<ViewerImage>,
    sent: usize,
    /// `true` if the bytes sent so far end inside an escape sequence, whose remainder must be sent
    /// before any other output.
    pub open: bool,
    /// `true` if the preview of the image, half blocks in terminal cells, is visible.
    pub seen: bool,
}

impl ImageUpload {
    pub fn new(image: Arc<ViewerImage>) -> Self {
        Self { image, sent: 0, open: false, seen: false }
    }

    /// Returns `true` if the upload has begun. From then on, the preview must not be sent.
    pub fn has_begun(&self) -> bool {
        self.sent > 0
    }

    pub fn is_unfinished(&self) -> bool {
        self.sent < self.image.transfer.bytes.len()
    }

    /// Returns `true` if the next output may be a part of the image: if the upload has begun, the
    /// preview is visible, or no cells of the screen wait to be sent. `waits` is `true` if some do.
    pub fn follows(&self, waits: bool) -> bool {
        self.has_begun() || self.is_unfinished() && (self.seen || !waits)
    }

    /// Returns the fraction of the bytes sent, 0..=1.
    pub fn share(&self) -> f64 {
        let all = self.image.transfer.bytes.len().max(1);
        self.sent as f64 / all as f64
    }

    /// Appends the next part to `out`. `room` is the number of bytes that the connection accepts
    /// now.
    pub fn next(&mut self, room: usize, out: &mut Vec<u8>) {
        let transfer = &self.image.transfer;
        let (range, open) = transfer.slice(self.sent, room.min(SLICE));
        out.extend(&transfer.bytes[range.clone()]);
        (self.sent, self.open) = (range.end, open);
    }

    /// Returns the escape sequence that removes the parts of the image that have been sent.
    pub fn removal(&self) -> Vec<u8> {
        let end = if self.open { END } else { b"" };
        [end, &self.image.transfer.remove].concat()
    }

    /// Returns an escape sequence that removes the image at any progress of its upload, and clears
    /// the screen if the image has overwritten cells.
    pub fn any_removal(&self) -> Vec<u8> {
        let clear: &[u8] = if self.image.transfer.is_divisible { b"\x1b[2J" } else { b"" };
        [END, &self.image.transfer.remove, clear].concat()
    }
}
