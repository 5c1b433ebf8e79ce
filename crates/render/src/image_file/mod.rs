//! Image files: PNG and OpenEXR files of rendered pictures and their metadata, written row by row
//! and read back.

mod exr_header;
mod exr_reader;
mod exr_writer;
mod metadata;
mod output;
mod png_reader;
mod png_writer;

pub use exr_reader::{ReadPicture, read_exr};
pub use metadata::FileMetadata;
pub use output::{Bands, Depth, ImageOutput};
pub use png_reader::read_png;
pub use png_writer::png_of_rgb;
