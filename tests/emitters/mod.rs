//! Lights with a size against closed forms, in single and double precision.

mod forms;
mod irradiance;
mod many;
mod mirrors;
mod objects;
mod on_surfaces;
