//! Numbers for samples: a sample is a pure function of (seed, pixel, replicate, index), never of
//! thread, order or time.

mod hash;
mod packet_sampler;
mod sobol;
pub mod warp;

pub use packet_sampler::{PacketSampler, SampleBlock, SampleSettings, Sampler, SamplerKind};
