//! Image files: PNG, OpenEXR and Radiance HDR files of rendered pictures and their metadata, written
//! row by row and read back.

mod exr_header;
mod exr_reader;
mod exr_writer;
mod hdr_writer;
mod metadata;
mod output;
mod png_reader;
mod png_writer;

pub use exr_reader::{ReadPicture, read_exr};
pub use metadata::FileMetadata;
pub use output::{Bands, Depth, ImageOutput};
pub use png_reader::read_png;
pub use png_writer::png_of_rgb;
use zerkalo_scene::process_memory::missing_memory;

/// Largest number of pixels of a file that is read: 8192 x 8192.
const MAX_PIXELS: u64 = 1 << 26;

/// Checks that a picture of `count` pixels may be read, which needs this memory \[bytes\].
fn check_pixels(count: u64, bytes: u64) -> Result<(), String> {
    if count > MAX_PIXELS {
        return Err(format!("it has {count} pixels; expected at most {MAX_PIXELS}"));
    }
    check_picture_memory(bytes)
}

/// Checks that this memory \[bytes\] is available for a picture.
///
/// # Errors
/// Fails with a sentence about the file, without its name.
pub fn check_picture_memory(bytes: u64) -> Result<(), String> {
    missing_memory(bytes).map_or(Ok(()), |missing| {
        Err(format!("it {missing}; expected a smaller picture, or more free memory"))
    })
}
