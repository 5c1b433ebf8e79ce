//! Culling: candidate primitives per tile for camera rays, possible occluders per light.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

pub(crate) mod light_buffer;
pub(crate) mod light_projection;
pub(crate) mod screen_grid;
pub(crate) mod tile;
