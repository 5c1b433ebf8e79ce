//! Culling: candidate primitives per tile for camera rays, possible occluders per light.

pub(crate) mod light_buffer;
pub(crate) mod light_projection;
pub(crate) mod screen_grid;
pub(crate) mod tile;
