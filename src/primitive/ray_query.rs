//! Single rays against single forms, in double precision: for placing things, not for pictures.

use crate::bvh::Ray;
use crate::lanes::Vec3;
use crate::primitive::{Aggregate, Form};
use glam::DVec3;

impl Form {
    /// The smallest t > 0 at which `origin + t direction` lies on the form's surface; `None`: never.
    /// Units of t are lengths of `direction`.
    pub fn cast(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        match self {
            Self::Sphere { center, radius } => {
                unit_sphere((origin - center) / radius, direction / radius)
            }
            Self::Ellipsoid { scene_from_unit } => {
                let unit_from_scene = scene_from_unit.inverse();
                unit_sphere(
                    unit_from_scene.transform_point3(origin),
                    unit_from_scene.transform_vector3(direction),
                )
            }
            Self::ConvexPolyhedron { faces, .. } => {
                let (mut enter, mut leave) = (f64::NEG_INFINITY, f64::INFINITY);
                for face in faces {
                    let height = face.normal.dot(origin) - face.offset;
                    let rise = face.normal.dot(direction);
                    if rise < 0.0 {
                        enter = enter.max(-height / rise);
                    } else if rise > 0.0 {
                        leave = leave.min(-height / rise);
                    } else if height > 0.0 {
                        return None;
                    }
                }
                let t = if enter > 0.0 { enter } else { leave };
                (enter <= leave && t > 0.0 && t.is_finite()).then_some(t)
            }
            Self::Parallelogram { corner, u, v } => {
                let normal = u.cross(*v);
                let t = normal.dot(corner - origin) / normal.dot(direction);
                let at = origin + direction * t - corner;
                // Coordinates along u and v by Cramer's rule in the parallelogram's plane.
                let area = normal.length_squared();
                let a = at.cross(*v).dot(normal) / area;
                let b = u.cross(at).dot(normal) / area;
                let inside = (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b);
                (t > 0.0 && t.is_finite() && inside).then_some(t)
            }
            Self::ConicalFrustum { .. } | Self::Csg(_) | Self::Mesh { .. } => {
                let length = direction.length();
                let vector = |v: DVec3| Vec3::<f64>::of(v.to_array());
                let ray = Ray { origin: vector(origin), direction: vector(direction / length) };
                let alone = Aggregate::with_tree(std::slice::from_ref(self), false);
                let t = alone.closest(&ray, alone.all()).t;
                (t < f64::MAX).then_some(t / length)
            }
            Self::Plane { normal, offset } => {
                let t = (offset - normal.dot(origin)) / normal.dot(direction);
                (t > 0.0 && t.is_finite()).then_some(t)
            }
        }
    }
}

/// The smallest t > 0 with |o + t d| = 1.
fn unit_sphere(o: DVec3, d: DVec3) -> Option<f64> {
    let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
    let root = (b * b - a * c).sqrt();
    // NaN (no crossing) compares false.
    [(-b - root) / a, (-b + root) / a].into_iter().find(|t| *t > 0.0 && t.is_finite())
}
