//! Single rays against single forms, in double precision: for placing things, not for pictures.

use super::{Form, Geometry, Ray};
use crate::lanes::V3;
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
            Self::Convex { faces, .. } => {
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
            Self::Tapered { .. } | Self::Compound(_) | Self::Mesh { .. } => {
                let length = direction.length();
                let vector = |v: DVec3| V3::<f64>::of(v.to_array());
                let ray = Ray { origin: vector(origin), direction: vector(direction / length) };
                let alone = Geometry::with_tree(std::slice::from_ref(self), false);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{EXAMPLES, Shape};
    use glam::{DAffine3, DQuat};
    use std::f64::consts::FRAC_PI_4;

    /// What is met lies on the way between outside and inside, or on the surface's plane.
    #[test]
    fn every_kind_is_met_from_above_its_middle() {
        for (key, _) in EXAMPLES {
            let base = DVec3::new(1.0, 0.5, -2.0);
            let shape = Shape::standing(key, base, DVec3::new(1.0, 1.5, 2.0)).unwrap();
            let form = shape.form();
            let up = form.bounds().map_or(base, |(low, high)| (low + high) / 2.0);
            let from = up + DVec3::new(0.3, 7.0, 0.2);
            let t = form.cast(from, up - from);
            if *key == "rectangle" {
                // Seen from its side there is something, from above only an edge.
                let front = up + DVec3::Z;
                assert_eq!(form.cast(front, DVec3::NEG_Z), Some(1.0));
                assert_eq!(form.cast(front, DVec3::Z), None);
                continue;
            }
            let t = t.unwrap_or_else(|| panic!("{key} is not met"));
            assert!(t > 0.0 && t <= 1.0 + 1e-12, "{key}: {t}");
            assert_eq!(form.cast(from, from - up), None, "{key}: away from it");
        }
    }

    #[test]
    fn known_distances() {
        let ball = Form::Sphere { center: DVec3::ZERO, radius: 2.0 };
        assert_eq!(ball.cast(DVec3::Y * 5.0, DVec3::NEG_Y), Some(3.0));
        assert_eq!(ball.cast(DVec3::ZERO, DVec3::NEG_Y), Some(2.0), "from inside");
        assert_eq!(ball.cast(DVec3::new(3.0, 5.0, 0.0), DVec3::NEG_Y), None);
        let pressed = ball.transformed(&DAffine3::from_scale(DVec3::new(1.0, 0.5, 1.0)));
        assert_eq!(pressed.cast(DVec3::Y * 5.0, DVec3::NEG_Y), Some(4.0));
        let cube = Shape::standing("cube", DVec3::ZERO, DVec3::ONE).unwrap().form();
        assert_eq!(cube.cast(DVec3::Y * 3.0, DVec3::NEG_Y), Some(2.0));
        assert_eq!(cube.cast(DVec3::Y * 0.5, DVec3::NEG_Y), Some(0.5), "from inside");
        assert_eq!(cube.cast(DVec3::new(0.6, 3.0, 0.0), DVec3::NEG_Y), None);
        let turned = cube.transformed(&DAffine3::from_quat(DQuat::from_rotation_y(FRAC_PI_4)));
        let t = turned.cast(DVec3::new(0.6, 3.0, 0.0), DVec3::NEG_Y).unwrap();
        assert!((t - 2.0).abs() < 1e-12, "a turned cube reaches further: {t}");
    }
}
