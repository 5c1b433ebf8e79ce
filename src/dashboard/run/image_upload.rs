//! Upload of an image for the viewer to the terminal, in parts of limited size.

use std::sync::Arc;
use zerkalo_terminal::image::ViewerImage;

/// Largest size of a slice of the image in bytes. It bounds the latency of keys, because no frame
/// can be sent while a slice is being written.
const SLICE: usize = 1 << 18;
/// String terminator (ST), which ends an incomplete escape sequence.
const END: &[u8] = b"\x1b\\";

/// Image for the viewer, and the progress of its upload to the terminal.
#[derive(Debug)]
pub struct ImageUpload {
    /// Image that is uploaded.
    pub image: Arc<ViewerImage>,
    /// Number of bytes of the image sent so far.
    sent: usize,
    /// `true` if the bytes sent so far end inside of an escape sequence. The remainder of the
    /// sequence must be sent next, before any other output.
    pub open: bool,
    /// `true` if the coarse preview of the image (half blocks in terminal cells) is already
    /// visible.
    pub seen: bool,
}

impl ImageUpload {
    /// Creates the upload of `image`, of which nothing has been sent.
    pub fn new(image: Arc<ViewerImage>) -> Self {
        Self { image, sent: 0, open: false, seen: false }
    }

    /// Returns `true` if the upload of the image has begun. From then on, the coarse preview under
    /// the image (half blocks in terminal cells) must not be sent.
    pub fn has_begun(&self) -> bool {
        self.sent > 0
    }

    /// Returns `true` if the upload of the image is incomplete.
    pub fn is_unfinished(&self) -> bool {
        self.sent < self.image.transfer.bytes.len()
    }

    /// Returns `true` if the next output may be a part of the image. This is so if the upload has
    /// begun, or if the image's coarse preview (half blocks in terminal cells) is visible. `waits`
    /// is `true` if some cells of the screen have not been sent yet; without such cells the preview
    /// is visible.
    pub fn follows(&self, waits: bool) -> bool {
        self.has_begun() || self.is_unfinished() && (self.seen || !waits)
    }

    /// Returns the fraction of the image's bytes that have been sent to the terminal, 0..=1.
    pub fn share(&self) -> f64 {
        let all = self.image.transfer.bytes.len().max(1);
        self.sent as f64 / all as f64
    }

    /// Appends the next slice of the image's bytes to `out`. `room` is the number of bytes that the
    /// connection accepts now. The slice has about `room` bytes, at most about `SLICE`.
    pub fn next(&mut self, room: usize, out: &mut Vec<u8>) {
        let transfer = &self.image.transfer;
        let (range, open) = transfer.slice(self.sent, room.min(SLICE));
        out.extend(&transfer.bytes[range.clone()]);
        (self.sent, self.open) = (range.end, open);
    }

    /// Returns two values. The first is the escape sequence that removes the sent part of the
    /// image; it is empty if nothing was sent. The second is `true` if the cells under the image
    /// must be drawn again after the removal.
    pub fn removal(&self) -> (Vec<u8>, bool) {
        let transfer = &self.image.transfer;
        if !self.has_begun() {
            return (Vec::new(), false);
        }
        let end = if self.open { END } else { b"" };
        ([end, &transfer.remove].concat(), transfer.destroys)
    }

    /// Returns an escape sequence that removes the image at any progress of its upload. It also
    /// clears the screen if the image has overwritten the cells under it.
    pub fn any_removal(&self) -> Vec<u8> {
        let clear: &[u8] = if self.image.transfer.destroys { b"\x1b[2J" } else { b"" };
        [END, &self.image.transfer.remove, clear].concat()
    }
}
