//! Kernels of zerkalo: SIMD numbers, random numbers, primitives that rays intersect, hierarchies.

pub mod bvh;
pub mod lanes;
pub mod primitive;
pub mod sampling;
