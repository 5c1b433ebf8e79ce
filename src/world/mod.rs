//! The world: a scene compiled for one lane type, holding only what this scene requires, and the
//! paths traced in it.

mod clearance;
mod compile;
mod culling;
mod integrator;
mod inventory;
mod light_groups;
mod lights_on_surfaces;
mod precision;
mod radiance_range;
mod reuse;
mod truncation_bias;

pub use crate::world::culling::tile::TileCandidates;
pub use crate::world::integrator::first_hit::FirstHit;
pub use crate::world::integrator::opaque::{Counts, Radiance};
pub use compile::{AnyWorld, Options, Precision, World};
pub use inventory::Inventory;
pub use light_groups::{LightGroupSource, LightGroups, MAX_GROUPS};
