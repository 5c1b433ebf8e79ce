//! Primitives: compiled geometry that rays intersect. Each kind has one file with its canonical
//! form, its intersection kernel and its tests. Primitives are compiled from the shapes of a scene
//! file, which the module `shape` describes. Several kinds of shapes become the same kind of
//! primitive.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

mod aggregate;
mod bounding;
mod canonical;
mod compiled;
mod conical_frustum;
mod convex_polyhedron;
mod csg;
mod ellipsoid;
mod form;
pub mod mesh;
mod parallelogram;
mod plane;
mod shading_normal;
mod sphere;
mod torus;
mod unit_space;

pub use aggregate::{
    AccelerationStructure, Aggregate, BVH_MIN_PRIMITIVES, PrimitiveId, PrimitiveSet,
};
pub use bounding::{BoundingSphere, BoundingVolume, F32_RAY_ERROR, Frustum, LightTarget};
pub use canonical::{
    Bounds, CanonicalShape, HalfSpace, Projection, Proxy, ProxyFace, UNBOUNDED, box_distance,
};
pub use compiled::{SurfacePoint, TexCoord};
pub use conical_frustum::{AROUND_TIP, ConicalFrustumForm};
pub use convex_polyhedron::ConvexPolyhedronForm;
pub use csg::{CsgSolid, CsgTree, Solid};
pub use ellipsoid::EllipsoidForm;
pub use form::Form;
pub use mesh::instance::{MeshForm, MeshNormals};
pub use mesh::{Mesh, TriangleMesh};
pub use parallelogram::ParallelogramForm;
pub use plane::PlaneForm;
pub use shading_normal::keep_visible;
pub use sphere::SphereForm;
pub use torus::TorusForm;
