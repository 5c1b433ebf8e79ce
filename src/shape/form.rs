//! What a description becomes before it is compiled for a lane type: a few geometric forms into
//! which every kind of shape and every transform collapses.

use glam::{DAffine3, DMat3, DVec3};

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
    Convex {
        /// The faces' half-spaces.
        faces: Vec<HalfSpace>,
        /// The corners (for bounds and faces' sanity).
        corners: Vec<DVec3>,
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
            Self::Convex { faces, corners } => Self::Convex {
                faces: faces
                    .iter()
                    .map(|f| {
                        let on_plane = map.transform_point3(f.normal * f.offset);
                        half_space(on_plane, normals * f.normal)
                    })
                    .collect(),
                corners: corners.iter().map(|c| map.transform_point3(*c)).collect(),
            },
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

    /// Corners of the smallest axis-parallel box around the form; `None` if it has no end.
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
            Self::Convex { corners, .. } => around(corners),
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
