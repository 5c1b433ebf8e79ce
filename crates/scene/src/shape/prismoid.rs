//! Polygonal prisms and frusta on a horizontal base: shared code of cube, box, pyramid and prism.

use crate::value::{round_nice, sin_cos_degrees};
use glam::{DVec2, DVec3};
use zerkalo_kernel::primitive::{ConvexPolyhedronForm, Form, HalfSpace};

/// Methods of [`ShapeDesc`](crate::shape::ShapeDesc) that depend only on `corner` and `rotation`.
macro_rules! by_corner_and_rotation {
    () => {
        fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
            vec![&mut self.corner]
        }

        fn rotate_y(&mut self, degrees: f64) -> bool {
            self.rotation = $crate::shape::wrapped_angle(self.rotation, degrees);
            true
        }

        fn rotation(&self) -> f64 {
            self.rotation
        }

        fn texture_axes(&self) -> glam::DMat3 {
            $crate::shape::texture_space::axes_rotated_y(self.rotation)
        }
    };
}
pub(super) use by_corner_and_rotation;

/// Returns the convex solid over a horizontal polygon: a prism, a pyramid or a frustum.
///
/// `base` has the polygon's corners in order, as (x, z) offsets from `corner`. `top_over_base` is
/// the ratio of their side lengths, from 0 (an apex) to 1. `rotation` is about the base's centroid,
/// in degrees, counter-clockwise seen from above.
///
/// Normals are computed from the base and the height, not from differences of corners, so that they
/// keep full precision with a tiny top or far from the origin.
pub(super) fn prismoid(
    corner: DVec3,
    base: &[DVec2],
    height: f64,
    top_over_base: f64,
    rotation: f64,
) -> Form {
    let centroid = base.iter().sum::<DVec2>() / base.len() as f64;
    let (sin, cos) = sin_cos_degrees(rotation);
    let rotated = |v: DVec2| DVec2::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin);
    // Relative to `corner`, (b - centroid) + centroid is exact: an unrotated cube stays exact.
    let corner_at = |scale: f64, b: DVec2, y: f64| {
        let offset = centroid + rotated(b - centroid) * scale;
        corner + DVec3::new(offset.x, y, offset.y)
    };
    let mut corners: Vec<DVec3> = base.iter().map(|b| corner_at(1.0, *b, 0.0)).collect();
    if top_over_base > 0.0 {
        corners.extend(base.iter().map(|b| corner_at(top_over_base, *b, height)));
    } else {
        corners.push(corner_at(0.0, centroid, height));
    }

    let through = |point: DVec3, normal: DVec3| HalfSpace { normal, offset: normal.dot(point) };
    let mut faces = vec![through(corner, DVec3::NEG_Y)];
    if top_over_base > 0.0 {
        faces.push(through(corner + DVec3::Y * height, DVec3::Y));
    }
    for (i, start) in base.iter().enumerate() {
        let end = base[(i + 1) % base.len()];
        let across = (end - start).perp().normalize();
        let apothem = across.dot(start - centroid);
        let outward = rotated(across * apothem.signum());
        // At height y a side is `apothem (1 - (1 - top_over_base) y / height)` away from the axis.
        let up = apothem.abs() * (1.0 - top_over_base) / height;
        let normal = DVec3::new(outward.x, up, outward.y).normalize();
        faces.push(through(corners[i], normal));
    }
    Form::ConvexPolyhedron(ConvexPolyhedronForm { faces, corners })
}

/// Returns the lower left near corner (towards -x and +z) of a horizontal rectangle about `base`,
/// with short decimals.
pub(super) fn corner_of_centered(base: DVec3, width: f64, depth: f64) -> [f64; 3] {
    let scale = width.min(depth);
    [round_nice(base.x - width / 2.0, scale), base.y, round_nice(base.z + depth / 2.0, scale)]
}

#[cfg(test)]
mod tests {
    use crate::shape::{Cube, Cuboid, Prism, Pyramid, ShapeDesc};
    use glam::DVec3;
    use zerkalo_kernel::primitive::{ConvexPolyhedronForm, Form, HalfSpace};

    fn parts(form: Form) -> (Vec<HalfSpace>, Vec<DVec3>) {
        match form {
            Form::ConvexPolyhedron(ConvexPolyhedronForm { faces, corners }) => (faces, corners),
            other => panic!("{other:?}"),
        }
    }

    fn has_corner(form: &Form, x: f64, y: f64, z: f64) -> bool {
        let corner = DVec3::new(x, y, z);
        parts(form.clone()).1.iter().any(|c| (c - corner).length() < 1e-12)
    }

    fn solids() -> Vec<(&'static str, usize, Form)> {
        let corner = [0.3, -1.0, 2.0];
        let pyramid = |apex_height, height| {
            Pyramid { corner, side: 0.9, apex_height, height, rotation: 20.0 }.form()
        };
        vec![
            ("cube", 6, Cube { corner, edge: 0.7, rotation: 33.0 }.form()),
            ("box", 6, Cuboid { center: corner, size: [0.1, 20.0, 3.0] }.form()),
            ("prism", 5, Prism { corner, side: 2.0, height: 0.1, rotation: -70.0 }.form()),
            ("truncated pyramid", 6, pyramid(1.26, 0.7)),
            ("pyramid with a tiny top", 6, pyramid(1.0, 1.0 - 1e-15)),
            ("whole pyramid", 5, pyramid(1.0, 1.0)),
        ]
    }

    #[test]
    fn corners_lie_on_three_faces() {
        for (name, count, form) in solids() {
            let (faces, corners) = parts(form);
            assert_eq!(faces.len(), count, "{name}");
            for face in &faces {
                assert!((face.normal.length() - 1.0).abs() < 1e-15, "{name}: {face:?}");
                let on_face =
                    corners.iter().filter(|c| (face.normal.dot(**c) - face.offset).abs() < 1e-12);
                assert!(on_face.count() >= 3, "{name}: {face:?} has too few corners");
                for corner in &corners {
                    assert!(face.normal.dot(*corner) <= face.offset + 1e-12, "{name}: {corner}");
                }
            }
            for corner in &corners {
                let at_corner =
                    faces.iter().filter(|f| (f.normal.dot(*corner) - f.offset).abs() < 1e-12);
                assert!(at_corner.count() >= 3, "{name}: {corner}");
            }
        }
    }

    #[test]
    fn normals_are_exact_far_from_origin() {
        let near = Prism { corner: [0.0; 3], side: 1.0, height: 1.0, rotation: 10.0 }.form();
        let far = Prism { corner: [1e9; 3], side: 1.0, height: 1.0, rotation: 10.0 }.form();
        let normals = |form| parts(form).0.iter().map(|f| f.normal).collect::<Vec<_>>();
        assert_eq!(normals(near), normals(far));
    }

    #[test]
    fn cube_without_rotation_has_exact_bounds() {
        let cube = Cube { corner: [0.1, 0.2, 0.3], edge: 0.7, rotation: 0.0 }.form();
        let (low, high) = cube.bounds().unwrap();
        assert_eq!((low.x, low.y, high.z), (0.1, 0.2, 0.3));
        assert_eq!((high.x, high.y, low.z), (0.1 + 0.7, 0.2 + 0.7, 0.3 - 0.7));
    }

    #[test]
    fn rotation_is_counter_clockwise_from_above() {
        let prism = |rotation| Prism { corner: [0.0; 3], side: 1.0, height: 1.0, rotation }.form();
        let h = 0.75f64.sqrt();
        // The centroid is (0.5, -h / 3). Without a rotation the third vertex points away from the
        // viewer (to -z); after a rotation by 90 degrees it points to the left (to -x).
        assert!(has_corner(&prism(0.0), 0.5, 0.0, -h));
        assert!(has_corner(&prism(90.0), 0.5 - 2.0 / 3.0 * h, 0.0, -h / 3.0));
        assert!(has_corner(&prism(180.0), 0.5, 0.0, h / 3.0));
        assert!(has_corner(&prism(-90.0), 0.5 + 2.0 / 3.0 * h, 0.0, -h / 3.0));
    }

    #[test]
    fn pyramid_is_truncated_only_below_apex() {
        let corner = [0.0; 3];
        let form = |apex_height, height| {
            Pyramid { corner, side: 0.9, apex_height, height, rotation: 0.0 }.form()
        };
        let cut = form(1.26, 0.7);
        assert_eq!(parts(cut.clone()).1.len(), 8);
        assert!(has_corner(&cut, 0.25, 0.7, -0.25) && has_corner(&cut, 0.65, 0.7, -0.65));
        for (apex_height, height) in [(0.7, 1.26), (0.7, 0.7)] {
            let whole = form(apex_height, height);
            assert_eq!(parts(whole.clone()).1.len(), 5);
            assert!(has_corner(&whole, 0.45, 0.7, -0.45), "{apex_height} {height}");
        }
    }
}
