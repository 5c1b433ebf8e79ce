//! Integrators: radiance along camera rays.

pub(crate) mod chosen_lights;
pub(crate) mod coincident_surfaces;
pub(crate) mod direct_lighting;
pub(crate) mod emitter_lighting;
pub(crate) mod environment_lighting;
pub(crate) mod first_hit;
pub(crate) mod indirect_diffuse;
pub(crate) mod interaction;
pub(crate) mod interface_lighting;
pub(crate) mod nested_dielectrics;
pub(crate) mod opaque;
pub(crate) mod path;
pub(crate) mod surface_textures;
pub(crate) mod transmission;
