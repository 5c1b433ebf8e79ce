//! Eight-wide bounding volume hierarchies: build, packet traversal, single-ray traversal.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

mod binary;
pub mod build;
mod clustering;
mod morton;
pub mod packet;
mod ray;
mod reinsertion;
pub mod single;

pub use build::{BVH_WIDTH, BuildQuality, Bvh8, Bvh8Build, Bvh8Node, LEAF_FLAG};
pub use morton::morton_code;
pub use ray::{Hit, Ray};
