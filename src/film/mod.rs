//! The film: integer sums of samples, and what is read from them.
//!
//! Two independent replicates, A and B, of the same picture are kept apart: their mean is the
//! picture, their difference measures the error that is left. Sums are integers, so that no order of
//! adding changes a bit. Each light (group) has its own sums, taken as if it were white and of unit
//! strength; a [`Mix`] gives it colour and strength afterwards.

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
pub use downsample::{Raster, Stale};
pub use exr_read::{ReadPicture, read_exr};
pub use film::{Film, Header, Mismatch, Slot};
pub use invalid::{BAD_REMEMBERED, BadSample, BadSamples};
pub use light_weights::{Mix, Part};
pub use linear_image::Linear;
pub use noise::{Estimator, Mse, Noise, TileNoise};
pub use output::{Depth, Picture, Target, WriteError};
pub use png::png_of_rgb;
pub use png_read::read_png;
pub use probe::Probe;
pub use tile::{MAX_FILM_GROUPS, TILE_PIXELS, Tile, lattice_pixels};

/// Side of a tile, in pixels.
pub const TILE: usize = 16;
