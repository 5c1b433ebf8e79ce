//! Image files: PNG and OpenEXR files of rendered pictures and their metadata, written row by row
//! and read back.

mod bands;
mod exr_header;
mod exr_reader;
mod exr_writer;
mod image_data;
mod metadata;
mod output;
mod png_reader;
mod png_writer;

pub use bands::Bands;
pub use exr_reader::{ReadPicture, read_exr};
pub use image_data::Depth;
pub use metadata::FileMetadata;
pub use output::ImageOutput;
pub use png_reader::read_png;
pub use png_writer::png_of_rgb;
