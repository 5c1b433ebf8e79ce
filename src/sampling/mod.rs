//! Numbers for samples: a sample is a pure function of (seed, pixel, replicate, index), never of
//! thread, order or time.

mod draws;
mod hash;
mod sobol;
pub mod warp;

pub use draws::{Draws, Points, SampleSettings, Sampler, SamplerKind};
