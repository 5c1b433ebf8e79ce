//! Random numbers of samples. They are pure functions of seed, pixel, replicate and sample index,
//! and do not depend on threads, order or time.

mod hash;
mod packet_sampler;
mod sobol;
pub mod warp;

pub use packet_sampler::{
    CameraDimensions, PacketSampler, SampleBlock, SampleSettings, Sampler, SamplerKind,
};
