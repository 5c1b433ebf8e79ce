//! Integrators: radiance along camera rays.

pub(crate) mod coincident_surfaces;
pub(crate) mod first_hit;
pub(crate) mod nested_dielectrics;
pub(crate) mod opaque;
pub(crate) mod surface_textures;
pub(crate) mod transmission;
