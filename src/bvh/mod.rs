//! Eight-wide bounding volume hierarchies: build, packet traversal, single-ray traversal.

pub(crate) mod build;
pub(crate) mod packet;
mod ray;
pub(crate) mod single;

pub use build::{Boxes, Branch, Built, LEAF, WIDE};
pub use ray::{Hit, Ray};
