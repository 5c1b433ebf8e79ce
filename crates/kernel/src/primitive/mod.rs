//! Primitives: compiled geometry that rays intersect. Each kind has one file with its canonical
//! form, its intersection kernel and its tests. Primitives are compiled from the shapes of a scene
//! file, which the module `shape` describes. Several kinds of shapes become the same kind of
//! primitive.

mod aggregate;
pub(crate) mod batch;
mod bounding;
mod canonical;
pub(crate) mod conical_frustum;
pub(crate) mod convex_polyhedron;
pub(crate) mod csg;
mod csg_interval;
pub(crate) mod csg_tree;
pub(crate) mod ellipsoid;
pub(crate) mod form;
pub mod mesh;
mod parallelogram;
mod plane;
pub(crate) mod primitive_box;
mod scene_bvh;
mod shading_normal;
pub(crate) mod solid;
pub(crate) mod sphere;
mod torus;

pub use aggregate::{AccelerationStructure, Aggregate, BVH_MIN_PRIMITIVES, PrimitiveSet};
pub use batch::{PrimitiveId, SurfacePoint, UvGradients};
pub use bounding::{BoundingSphere, BoundingVolume, F32_RAY_ERROR, Frustum, LightTarget};
pub use canonical::{
    Bounds, CanonicalShape, DefaultMapping, HalfSpace, Proxy, ProxyFace, box_distance,
};
pub use conical_frustum::ConicalFrustumForm;
pub use convex_polyhedron::ConvexPolyhedronForm;
pub use csg_tree::{CsgSolid, CsgTree};
pub use ellipsoid::EllipsoidForm;
pub use form::Form;
pub use mesh::instance::MeshForm;
pub use mesh::{Mesh, TriangleMesh};
pub use parallelogram::ParallelogramForm;
pub use plane::PlaneForm;
pub use shading_normal::keep_visible;
pub use sphere::SphereForm;
pub use torus::TorusForm;
