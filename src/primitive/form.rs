//! What a description becomes before it is compiled for a lane type: a few geometric forms into
//! which every kind of shape and every transform collapses.

use crate::asset::Mesh;
use crate::primitive::csg_tree::CsgSolid;
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// One side of a plane: the points p with `normal . p <= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Outward unit normal.
    pub normal: DVec3,
    /// Signed distance of the plane from the origin along `normal`.
    pub offset: f64,
}

/// Geometry, in double precision, in the space of the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// A sphere.
    Sphere {
        /// Centre.
        center: DVec3,
        /// Radius, greater than zero.
        radius: f64,
    },
    /// The image of the unit sphere at the origin under an invertible affine map.
    Ellipsoid {
        /// From the unit sphere's space to the scene's.
        scene_from_unit: DAffine3,
    },
    /// A bounded convex solid: the intersection of half-spaces, with its corners.
    ConvexPolyhedron {
        /// The faces' half-spaces.
        faces: Vec<HalfSpace>,
        /// The corners (for bounds and faces' sanity).
        corners: Vec<DVec3>,
    },
    /// The image under an invertible affine map of the solid with x^2 + y^2 <= (1 + (top - 1) z)^2 and
    /// 0 <= z <= 1. [`Form::conical_frustum`] makes one of any proportions.
    ConicalFrustum {
        /// From that solid's space to the scene's.
        scene_from_unit: DAffine3,
        /// Radius at z = 1 over radius at z = 0: from 0, a cone, to 1, a cylinder.
        top_radius: f64,
    },
    /// Solids joined, intersected, cut out of each other.
    Csg(CsgSolid),
    /// The image of a mesh under an invertible affine map.
    Mesh {
        /// The triangles.
        mesh: Arc<Mesh>,
        /// From the space of the mesh's coordinates to the scene's.
        scene_from_mesh: DAffine3,
        /// Whether light sees normals interpolated between vertices, not the triangles' own.
        smooth: bool,
    },
    /// The flat parallelogram `corner + a u + b v`, 0 <= a, b <= 1. Its front is the side of u x v.
    Parallelogram {
        /// The corner that both edges leave.
        corner: DVec3,
        /// First edge.
        u: DVec3,
        /// Second edge.
        v: DVec3,
    },
    /// An infinite plane. Its front is the side that `normal` points to.
    Plane {
        /// Unit normal.
        normal: DVec3,
        /// `normal . p` of its points.
        offset: f64,
    },
}

/// The unit normal and offset of a plane through `point` with a normal along `normal`.
fn half_space(point: DVec3, normal: DVec3) -> HalfSpace {
    let normal = normal.normalize();
    HalfSpace { normal, offset: normal.dot(point) }
}

impl Form {
    /// The image under `scene_from_canonical` of the solid with x^2 + y^2 <= (1 + (s - 1) z)^2 and
    /// 0 <= z <= 1, for any s >= 0.
    pub fn conical_frustum(scene_from_canonical: DAffine3, s: f64) -> Self {
        if s <= 1.0 {
            return Self::ConicalFrustum { scene_from_unit: scene_from_canonical, top_radius: s };
        }
        // Upside down, with the wider end as the base.
        let flip =
            DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::new(s, s, -1.0)), DVec3::Z);
        Self::ConicalFrustum { scene_from_unit: scene_from_canonical * flip, top_radius: 1.0 / s }
    }

    /// The form after the invertible affine map `map`. Similarities keep a sphere a sphere; any other
    /// map makes it an ellipsoid. The other forms stay what they are.
    pub fn transformed(self, map: &DAffine3) -> Self {
        let linear = map.matrix3;
        let normals = linear.inverse().transpose();
        match self {
            Self::Sphere { center, radius } => match similarity(&linear) {
                Some(scale) => {
                    Self::Sphere { center: map.transform_point3(center), radius: radius * scale }
                }
                None => Self::Ellipsoid {
                    scene_from_unit: *map
                        * DAffine3::from_translation(center)
                        * DAffine3::from_scale(DVec3::splat(radius)),
                },
            },
            Self::Ellipsoid { scene_from_unit } => {
                Self::Ellipsoid { scene_from_unit: *map * scene_from_unit }
            }
            Self::ConvexPolyhedron { faces, corners } => Self::ConvexPolyhedron {
                faces: faces
                    .iter()
                    .map(|f| {
                        let on_plane = map.transform_point3(f.normal * f.offset);
                        half_space(on_plane, normals * f.normal)
                    })
                    .collect(),
                corners: corners.iter().map(|c| map.transform_point3(*c)).collect(),
            },
            Self::ConicalFrustum { scene_from_unit, top_radius } => {
                Self::ConicalFrustum { scene_from_unit: *map * scene_from_unit, top_radius }
            }
            Self::Csg(compound) => Self::Csg(compound.transformed(map)),
            Self::Mesh { mesh, scene_from_mesh, smooth } => {
                Self::Mesh { mesh, scene_from_mesh: *map * scene_from_mesh, smooth }
            }
            Self::Parallelogram { corner, u, v } => {
                let (u, v) = (linear * u, linear * v);
                let corner = map.transform_point3(corner);
                // A map that mirrors space would turn the front to the back: exchange the edges.
                if linear.determinant() < 0.0 {
                    Self::Parallelogram { corner, u: v, v: u }
                } else {
                    Self::Parallelogram { corner, u, v }
                }
            }
            Self::Plane { normal, offset } => {
                let moved = half_space(map.transform_point3(normal * offset), normals * normal);
                Self::Plane { normal: moved.normal, offset: moved.offset }
            }
        }
    }

    /// Number of parts that can have a finish of their own: 1 but for compounds.
    pub fn parts(&self) -> usize {
        match self {
            Self::Csg(compound) => compound.parts.len(),
            _ => 1,
        }
    }

    /// Corners of an axis-parallel box around the form, the smallest but for compounds; `None` if it has no end.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let around = |points: &[DVec3]| {
            let low = points.iter().copied().reduce(DVec3::min)?;
            let high = points.iter().copied().reduce(DVec3::max)?;
            Some((low, high))
        };
        match self {
            Self::Sphere { center, radius } => Some((center - radius, center + radius)),
            Self::Ellipsoid { scene_from_unit: m } => {
                // Half-widths of the image of the unit sphere: the lengths of the matrix's rows.
                let rows = m.matrix3.transpose();
                let half =
                    DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length());
                Some((m.translation - half, m.translation + half))
            }
            Self::ConvexPolyhedron { corners, .. } => around(corners),
            Self::ConicalFrustum { scene_from_unit: m, top_radius } => {
                // Half-widths of the base's disc: lengths of the rows of the first two columns.
                let rows = m.matrix3.transpose();
                let half = DVec3::new(
                    rows.x_axis.truncate().length(),
                    rows.y_axis.truncate().length(),
                    rows.z_axis.truncate().length(),
                );
                let (base, cap) = (m.translation, m.translation + m.matrix3.z_axis);
                let narrow = half * *top_radius;
                around(&[base - half, base + half, cap - narrow, cap + narrow])
            }
            Self::Csg(compound) => compound.bounds(),
            Self::Mesh { mesh, scene_from_mesh: m, .. } => {
                let rows = m.matrix3.transpose();
                let rows = [rows.x_axis, rows.y_axis, rows.z_axis].map(|r| r.to_array());
                let high = rows.map(|r| mesh.support(r));
                let low = rows.map(|r| -mesh.support(r.map(|x| -x)));
                Some((m.translation + DVec3::from(low), m.translation + DVec3::from(high)))
            }
            Self::Parallelogram { corner, u, v } => {
                around(&[*corner, corner + u, corner + v, corner + u + v])
            }
            Self::Plane { .. } => None,
        }
    }
}

/// The factor by which a linear map scales every length, if it is the same for all directions (to
/// within rounding).
fn similarity(linear: &DMat3) -> Option<f64> {
    let gram = linear.transpose() * *linear;
    let square = (gram.x_axis.x + gram.y_axis.y + gram.z_axis.z) / 3.0;
    let rest = gram - DMat3::from_diagonal(DVec3::splat(square));
    let largest = rest.to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    (largest <= 1e-13 * square).then(|| square.sqrt())
}
