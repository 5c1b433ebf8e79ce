//! Numbers for samples: a sample is a pure function of (seed, pixel, replicate, index), never of
//! thread, order or time.

mod hash;
mod packet_sampler;
mod sobol;
pub mod warp;

pub use packet_sampler::{Draws, Points, SampleSettings, Sampler, SamplerKind};
