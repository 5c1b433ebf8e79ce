//! Independent, slow reference path tracer that shares only the scene description with the program,
//! and comparisons of pictures and first hits with it.

mod compare;
mod compounds;
mod emission;
mod exact;
mod lamps;
mod meshes;
mod paint;
mod reflection;
mod surfaces;
mod tracer;
mod transmission;

pub use compare::*;
pub use exact::*;
pub use reflection::{facet_density, lambda};
pub use tracer::{Mutation, Tracer};
pub use transmission::reflectance;
