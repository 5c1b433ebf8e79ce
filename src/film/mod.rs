//! The film: integer sums of samples, and what is read from them.
//!
//! Two independent replicates, A and B, of the same picture are kept apart: their mean is the
//! picture, their difference measures the error that is left. Sums are integers, so that no order of
//! adding changes a bit. Each light (group) has its own sums, taken as if it were white and of unit
//! strength; a [`Mix`] gives it colour and strength afterwards.

mod bad;
mod bytes;
mod curve;
mod display;
mod exr;
mod exr_header;
mod exr_read;
mod linear;
mod mix;
mod noise;
#[cfg(test)]
mod noise_test;
mod png;
mod png_read;
mod probe;
mod raster;
mod resample;
mod storage;
mod target;
#[cfg(test)]
mod testing;
mod tile;

pub use bad::{BAD_REMEMBERED, BadSample, BadSamples};
pub use display::{Display, Tone, quantised_8, quantised_16};
pub use exr_read::{ReadPicture, read_exr};
pub use linear::Linear;
pub use mix::{Mix, Part};
pub use noise::{Estimator, Mse, Noise, TileNoise};
pub use png::png_of_rgb;
pub use png_read::read_png;
pub use probe::Probe;
pub use raster::{Raster, Stale};
pub use resample::Thumbnail;
pub use storage::{Film, Header, Mismatch, Slot};
pub use target::{Depth, Picture, Target, WriteError};
pub use tile::{MAX_FILM_GROUPS, TILE_PIXELS, Tile, lattice_pixels};

/// Side of a tile, in pixels.
pub const TILE: usize = 16;
