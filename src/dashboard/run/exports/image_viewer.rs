//! Reading and encoding of exported images for the image viewer.

use crate::dashboard::Message;
use crate::dashboard::run::frames::FramePipeline;
use crossbeam_channel::Sender;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;
use std::{fs, thread};
use zerkalo_render::film::{Display, box_means};
use zerkalo_render::image_file::{ReadPicture, png_of_rgb, read_exr, read_png};
use zerkalo_terminal::cells::{Raster, level, linear};
use zerkalo_terminal::image::{ImageViewport, Protocol, ViewerImage};
use zerkalo_terminal::{Capabilities, cell_px, file_transfer};

/// Longest time for sending an image, which is downscaled if the connection is slow.
const MAX_TRANSFER_TIME: Duration = Duration::from_secs(8);

/// Returns the viewport of the image viewer on a screen of these columns and rows.
pub fn viewport(frames: &FramePipeline, screen: [u16; 2]) -> ImageViewport {
    let terminal = &frames.terminal;
    // The user may have changed the size of cells since the start.
    let cell_px = cell_px().or(terminal.cell_px);
    let protocol = Protocol::of(&Capabilities { cell_px, ..terminal.clone() });
    // A local terminal has no limit.
    let rate = frames.flow.rate();
    let max_bytes = rate.map(|rate| rate * MAX_TRANSFER_TIME.as_secs_f64());
    ImageViewport { protocol, screen, cell_px, sixel_px: terminal.sixel_px, max_bytes }
}

/// Reads and encodes the image at `path` in a separate thread, which sends a
/// [`Message::ViewerImage`] to `results`.
pub fn prepare(
    path: PathBuf,
    display: Display,
    viewport: ImageViewport,
    downloads: bool,
    results: Sender<Message>,
) {
    let (requested, failed) = (path.clone(), results.clone());
    let started = thread::Builder::new().name("image viewer".into()).spawn(move || {
        let image = match downloads {
            true => download(&path, &display, viewport),
            false => viewer_image(&path, &display, &viewport),
        };
        let image = image.map(Arc::new);
        // Sending fails only at the end of the program, when the receiver is gone.
        let _ = results.send(Message::ViewerImage(path, image));
    });
    if let Err(error) = started {
        let _ = failed.send(Message::ViewerImage(requested, Err(error.to_string())));
    }
}

/// Reads the image at `path` and encodes the file for a terminal that stores it.
fn download(
    path: &Path,
    display: &Display,
    viewport: ImageViewport,
) -> Result<ViewerImage, String> {
    let viewport = ImageViewport { protocol: Protocol::Blocks, ..viewport };
    let image = viewer_image(path, display, &viewport)?;
    let contents = fs::read(path).map_err(|error| error.to_string())?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    Ok(ViewerImage { transfer: file_transfer(&name, &contents), ..image })
}

/// Reads, scales and encodes the image at `path`. `display` converts the linear light of an EXR
/// file.
fn viewer_image(
    path: &Path,
    display: &Display,
    viewport: &ImageViewport,
) -> Result<ViewerImage, String> {
    let image = if path.extension().is_some_and(|e| e == "exr") {
        let ReadPicture { size: [width, height], pixels, .. } = read_exr(path)?;
        Raster { width, height, pixels: pixels.into_iter().map(display.to_8()).collect() }
    } else {
        let image = read_png(path)?;
        let [width, height] = [image.width(), image.height()].map(|n| n as usize);
        Raster { width, height, pixels: image.as_raw().as_chunks::<3>().0.to_vec() }
    };
    let layout = viewport.layout([image.width, image.height])?;
    let shown = shrunk(&image, layout.shown);
    let halves = shrunk(&shown, layout.halves);
    ViewerImage::encode(viewport, layout, &shown, halves, |image| {
        let size = layout.shown.map(|n| n as u32);
        png_of_rgb(size, image.pixels.as_flattened(), None).map_err(|error| error.to_string())
    })
}

/// Downscales `image` to `size` (width, height), which is not larger. A new pixel is the mean of an
/// area of the old image in linear light.
fn shrunk(image: &Raster, [width, height]: [usize; 2]) -> Raster {
    if [image.width, image.height] == [width, height] {
        return image.clone();
    }
    let light = |pixel: usize| linear(image.pixels[pixel]).map(f64::from);
    let means = box_means([image.width, image.height], [width, height], light);
    let pixels = means.into_iter().map(|mean| mean.map(|c| level(c as f32))).collect();
    Raster { width, height, pixels }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_linear() {
        let checkers = vec![[0; 3], [255; 3], [255; 3], [0; 3]];
        let checkers = Raster { width: 2, height: 2, pixels: checkers };
        // The mean of black and white in linear light is 0.5, which is the 8-bit level 188.
        assert_eq!(shrunk(&checkers, [1, 1]).pixels, [[188; 3]]);
        assert_eq!(shrunk(&checkers, [2, 2]), checkers);
        let empty = Raster::default();
        assert_eq!(shrunk(&empty, [0, 0]), empty);
    }

    #[test]
    fn constant_pictures_stay_constant() {
        for (from, to) in [(7, 3), (640, 417), (1000, 999), (5, 1), (9, 9)] {
            let plain = |width, height| Raster::from_fn(width, height, |_| [3, 99, 250]);
            assert_eq!(shrunk(&plain(from, 2), [to, 1]), plain(to, 1));
        }
    }
}
