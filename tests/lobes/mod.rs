//! Lobes, physical properties, samples, SIMD types and whole paths, against closed forms and by
//! statistics with fixed seeds.

mod albedo;
mod chi_square;
pub(crate) mod closed_forms;
mod conservation;
mod highlights;
mod lanes;
mod properties;
mod rough;
mod sampler;
mod setup;
mod stats;
mod transmission;
mod worlds;
