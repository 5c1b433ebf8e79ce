//! Primitives: what rays intersect. One kind a file, with its bounds and its intersection.

mod aggregate;
pub(crate) mod batch;
mod bounding;
pub(crate) mod conical_frustum;
pub(crate) mod convex_polyhedron;
pub(crate) mod csg;
mod csg_interval;
pub(crate) mod csg_tree;
pub(crate) mod ellipsoid;
pub(crate) mod form;
pub(crate) mod item_box;
pub(crate) mod mesh_instance;
pub(crate) mod normals_at;
pub(crate) mod planar;
mod ray_query;
mod scene_bvh;
mod shading_normal;
pub(crate) mod solid;
pub(crate) mod sphere;
pub mod triangle_mesh;

pub use aggregate::{Geometry, Selection, TREE_FROM};
pub use batch::{OwnUv, Source, Surface};
pub use bounding::{Ball, Bound, Pencil, STRAY, Towards};
pub use csg_tree::{Compound, Tree as CompoundTree};
pub use form::{Form, HalfSpace};
pub use item_box::Acceleration;
pub use shading_normal::facing;
