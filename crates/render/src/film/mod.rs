//! Film: integer sums of samples, and the pictures and noise estimates computed from them.
//!
//! The film divides the samples into two independent halves, the *replicates* A and B. The mean of
//! both is the picture; their difference is a measure of the remaining error. Sums are integers;
//! the order of addition therefore changes no bit of them. A *light group* is a set of lights with
//! sums of its own, for white light of unit intensity. When a picture is computed, [`LightWeights`]
//! multiply the sums of each group by its colour and intensity.

mod box_filter;
mod captures;
mod detail;
mod display;
mod downsample;
pub mod file;
mod light_weights;
mod linear_image;
mod noise;
#[cfg(test)]
mod noise_test;
mod pixel_probe;
mod srgb_table;
mod store;
#[doc(hidden)]
pub mod testing;
mod tile;

pub use box_filter::box_means;
pub(crate) use captures::Stratum;
pub use captures::{Captures, Class};
pub use detail::{Detail, Window};
pub use display::{Display, quantised_16};
pub use downsample::{IncrementalDownsample, Thumbnail};
pub use light_weights::{LightWeights, Replicates, Sums};
pub use linear_image::LinearImage;
pub(crate) use noise::NoiseSums;
pub use noise::{ByMeasure, Estimator, Noise, TileNoise};
pub use pixel_probe::PixelProbe;
pub use srgb_table::quantised_8;
pub use store::{Film, Header, TileHandle};
pub use tile::{MAX_FILM_GROUPS, SampleFault, TILE_PIXELS, Tile, lattice_pixels};

/// Side of a film tile in pixels. The pixels of a tile are stored and sampled together.
pub const TILE: usize = 16;
