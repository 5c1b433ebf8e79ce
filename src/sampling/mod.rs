//! Random numbers of samples: pure functions of (seed, pixel, replicate, index), independent of
//! thread, order and time.

mod hash;
mod packet_sampler;
mod sobol;
pub mod warp;

pub use packet_sampler::{PacketSampler, SampleBlock, SampleSettings, Sampler, SamplerKind};
