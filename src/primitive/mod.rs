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

pub use aggregate::{Aggregate, BVH_MIN_PRIMITIVES, PrimitiveSet};
pub use batch::{PrimitiveId, SurfacePoint, UvGradients};
pub use bounding::{BoundingSphere, BoundingVolume, F32_RAY_ERROR, Frustum, LightTarget};
pub use csg_tree::{CsgSolid, CsgTree};
pub use form::{Form, HalfSpace};
pub use item_box::Acceleration;
pub use shading_normal::keep_visible;
