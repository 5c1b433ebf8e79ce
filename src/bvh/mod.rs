//! Eight-wide bounding volume hierarchies: build, packet traversal, single-ray traversal.

pub mod build;
mod clustering;
pub mod packet;
mod ray;
mod reinsertion;
pub mod single;

pub use build::{BVH_WIDTH, BuildQuality, Bvh8, Bvh8Build, Bvh8Node, LEAF_FLAG};
pub use ray::{Hit, Ray};
