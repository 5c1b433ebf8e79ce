//! Random numbers of camera samples. They are pure functions of seed, pixel, replicate and sample
//! index, and do not depend on threads, order or time. The replicates A and B are two independent
//! halves of the samples, from whose difference the film estimates the error.

mod hash;
mod packet_sampler;
mod piecewise_linear_2d;
mod sobol;
pub mod warp;

pub use packet_sampler::{
    CameraDimensions, PacketSampler, SampleBlock, SampleSettings, Sampler, SamplerKind,
};
pub use piecewise_linear_2d::PiecewiseLinear2D;
