//! Shapes: descriptions of geometry in scene files, one kind per file. Each becomes a canonical
//! form of the module `primitive`, which rays intersect.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

mod axial;
mod cone;
mod csg;
mod cube;
mod cuboid;
mod cylinder;
mod horizontal_rectangle;
mod mesh;
mod plane;
mod prism;
mod prismoid;
mod pyramid;
mod rectangle;
mod registry;
mod sphere;
mod tapered_cylinder;
mod texture_space;
mod torus;
mod transform;
mod unit_frustum;

pub use cone::Cone;
pub(crate) use csg::unfit_reason;
pub use csg::{CsgOperand, Difference, Intersection, MAX_DEPTH, Union};
pub use cube::Cube;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use horizontal_rectangle::HorizontalRectangle;
pub use mesh::{MeshDesc, Normals};
pub use plane::Plane;
pub use prism::Prism;
pub use pyramid::Pyramid;
pub use rectangle::Rectangle;
pub(crate) use registry::wrapped_angle;
pub use registry::{EXAMPLES, KINDS, Shape, ShapeDesc};
pub use sphere::Sphere;
pub use tapered_cylinder::TaperedCylinder;
pub use texture_space::TextureSpace;
pub use torus::Torus;
pub use transform::{Rotate, Scale, TransformOp, compose, ill_conditioned};
pub use unit_frustum::UnitFrustum;

#[cfg(test)]
mod normals_at_test;
#[cfg(test)]
mod ray_query_test;
