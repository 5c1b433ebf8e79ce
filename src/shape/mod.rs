//! Shapes: what users describe, one kind a file, and what rays meet, one batch per form.

mod batch;
mod form;
mod geometry;
mod tree;

pub use batch::{Hit, Ray, Surface};
pub use form::{Form, HalfSpace};
pub use geometry::Geometry;
