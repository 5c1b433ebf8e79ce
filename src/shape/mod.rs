//! Shapes: what users describe, one kind a file, and what rays meet, one batch per form.

mod batch;
mod cast;
mod cube;
mod cuboid;
mod form;
mod geometry;
mod kinds;
mod plane;
mod platform;
mod prism;
mod pyramid;
mod rectangle;
mod sphere;
mod tree;
mod upright;

pub use batch::{Hit, Ray, Surface};
pub use cube::Cube;
pub use cuboid::Cuboid;
pub use form::{Form, HalfSpace};
pub use geometry::{Geometry, Seen, TREE_FROM};
pub use kinds::{EXAMPLES, KINDS, Kind, Shape};
pub use plane::Plane;
pub use platform::Platform;
pub use prism::Prism;
pub use pyramid::Pyramid;
pub use rectangle::Rectangle;
pub use sphere::Sphere;
