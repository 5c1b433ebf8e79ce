//! Eight-wide bounding volume hierarchies: build, packet traversal, single-ray traversal.

pub(crate) mod build;
pub(crate) mod packet;
mod ray;
pub(crate) mod single;

pub use build::{BVH_WIDTH, Bvh8, Bvh8Build, Bvh8Node, LEAF_FLAG};
pub use ray::{Hit, Ray};
