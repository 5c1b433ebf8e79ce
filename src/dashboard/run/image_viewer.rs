//! Reading and encoding of exported images for the image viewer, and reports on their upload.

use crate::dashboard::message::Message;
use crate::dashboard::overlay::Overlay;
use crate::dashboard::run::frames::FramePipeline;
use crate::dashboard::run::image_upload::ImageUpload;
use crate::dashboard::run::shrink::shrunk;
use crate::dashboard::run::{Dashboard, STATUS_INTERVAL};
use crossbeam_channel::Sender;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;
use zerkalo_render::film::Display;
use zerkalo_render::image_file::{png_of_rgb, read_exr, read_png};
use zerkalo_terminal::cells::Raster;
use zerkalo_terminal::image::{ImageViewport, Protocol, ViewerImage};
use zerkalo_terminal::{Capabilities, cell_px};

/// Longest time in which an image may be sent to the terminal. On slow connections the image is
/// downscaled to keep within this time.
const MAX_TRANSFER_TIME: Duration = Duration::from_secs(8);

/// Returns the viewport of the image viewer: the image protocol, the size of the screen, and the
/// largest number of bytes of an image. `screen` is the number of columns and rows of the terminal,
/// to which `frames` are sent.
pub fn viewport(frames: &FramePipeline, screen: [u16; 2]) -> ImageViewport {
    let terminal = &frames.terminal;
    // The user may have changed the font size, and thereby the cell size, since the start.
    let cell_px = cell_px().or(terminal.cell_px);
    let protocol = Protocol::of(&Capabilities { cell_px, ..terminal.clone() });
    // A local terminal has no limit.
    let rate = frames.flow.reading().map(|link| link.rate);
    let max_bytes = rate.map(|rate| rate * MAX_TRANSFER_TIME.as_secs_f64());
    ImageViewport { protocol, screen, cell_px, sixel_px: terminal.sixel_px, max_bytes }
}

/// Reads the image at `path` and encodes it for `viewport` in a separate thread. The result is a
/// [`Message::ViewerImage`], sent to `results`. `display` is the display transform for linear
/// images.
pub fn prepare(path: PathBuf, display: Display, viewport: ImageViewport, results: Sender<Message>) {
    let (requested, failed) = (path.clone(), results.clone());
    let started = thread::Builder::new().name("image viewer".into()).spawn(move || {
        let image = viewer_image(&path, &display, &viewport).map(Arc::new);
        // Sending fails only at the end of the program, when the receiver is gone.
        let _ = results.send(Message::ViewerImage(path, image));
    });
    if let Err(error) = started {
        let _ = failed.send(Message::ViewerImage(requested, Err(error.to_string())));
    }
}

/// Reads the image at `path`, then scales and encodes it for `viewport`. `display` converts the
/// linear light of an EXR file to 8-bit levels.
fn viewer_image(
    path: &Path,
    display: &Display,
    viewport: &ImageViewport,
) -> Result<ViewerImage, String> {
    let (size, pixels) = if path.extension().is_some_and(|e| e == "exr") {
        let picture = read_exr(path)?;
        (picture.size, picture.pixels.iter().copied().map(display.to_8()).collect())
    } else {
        read_png(path)?
    };
    let layout = viewport.layout(size)?;
    let shown = shrunk(&Raster { width: size[0], height: size[1], pixels }, layout.shown);
    let halves = shrunk(&shown, layout.halves);
    ViewerImage::encode(viewport, layout, &shown, halves, |image| {
        let size = layout.shown.map(|n| n as u32);
        png_of_rgb(size, image.pixels.as_flattened()).map_err(|error| error.to_string())
    })
}

impl Dashboard {
    /// Reports the progress of an image transfer to the model, at most once per
    /// [`STATUS_INTERVAL`]. The end of the transfer is reported at once.
    pub(super) fn report_upload(&mut self, now: Duration) {
        let Some(sent) = self.frames.upload.as_ref().map(ImageUpload::share) else { return };
        let known = match &self.model.overlay {
            Some(Overlay::ViewerImage(viewed)) => viewed.sent,
            _ => return,
        };
        if sent != known && (sent == 1.0 || self.status_sent_at + STATUS_INTERVAL <= now) {
            self.status_sent_at = now;
            self.dispatch(Message::ImageSent(sent));
        }
    }
}
