//! The film: integer sums of samples, and what is read from them.
//!
//! Two independent replicates, A and B, of the same picture are kept apart: their mean is the
//! picture, their difference measures the error that is left. Sums are integers, so that no order of
//! adding changes a bit. Each light (group) has its own sums, taken as if it were white and of unit
//! strength; a [`LightWeights`] gives it colour and strength afterwards.

mod box_filter;
mod canonical_bytes;
mod display;
mod downsample;
mod exr;
mod exr_header;
mod exr_read;
mod film;
mod invalid;
mod light_weights;
mod linear_image;
mod noise;
#[cfg(test)]
mod noise_test;
mod output;
mod png;
mod png_read;
mod probe;
mod srgb_table;
#[cfg(test)]
mod testing;
mod tile;

pub use box_filter::Thumbnail;
pub use display::{Display, Tone, quantised_8, quantised_16};
pub use downsample::{DirtyTile, IncrementalDownsample};
pub use exr_read::{ReadPicture, read_exr};
pub use film::{Film, Header, Mismatch, TileHandle};
pub use invalid::{INVALID_REMEMBERED, InvalidSample, InvalidSamples};
pub use light_weights::{LightWeights, Replicates};
pub use linear_image::LinearImage;
pub use noise::{Estimator, Mse, Noise, TileNoise};
pub use output::{Depth, ImageData, ImageOutput, WriteError};
pub use png::png_of_rgb;
pub use png_read::read_png;
pub use probe::Probe;
pub use tile::{MAX_FILM_GROUPS, TILE_PIXELS, Tile, lattice_pixels};

/// Side of a tile, in pixels.
pub const TILE: usize = 16;
