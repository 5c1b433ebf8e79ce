//! Solids that stand on a regular base: what cube, box, pyramid and prism have in common.

use crate::primitive::{ConvexPolyhedronForm, Form, HalfSpace};
use crate::value::{round_nice, sin_cos_degrees};
use glam::{DVec2, DVec3};

/// A convex solid over a horizontal base.
///
/// `base`: the base's corners as (x, z) offsets from `corner`, in order around it. `top_over_base`:
/// size of the top over that of the base, 0 (an apex) to 1 (upright sides). `rotation`: degrees
/// about the vertical through the base's centroid, counter-clockwise seen from above.
///
/// The sides' normals come from the base and the heights, never from differences of corners, so
/// that a tiny top or a place far from the origin costs them no digits.
pub(super) fn prismoid(
    corner: DVec3,
    base: &[DVec2],
    height: f64,
    top_over_base: f64,
    rotation: f64,
) -> Form {
    let centroid = base.iter().sum::<DVec2>() / base.len() as f64;
    let (sin, cos) = sin_cos_degrees(rotation);
    let turned = |v: DVec2| DVec2::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin);
    // (b - c) + c is exact where (b + corner - c) + c would not be: an unturned cube keeps its
    // corner.
    let place = |scale: f64, b: DVec2, y: f64| {
        let at = centroid + turned(b - centroid) * scale;
        corner + DVec3::new(at.x, y, at.y)
    };
    let mut corners: Vec<DVec3> = base.iter().map(|b| place(1.0, *b, 0.0)).collect();
    if top_over_base > 0.0 {
        corners.extend(base.iter().map(|b| place(top_over_base, *b, height)));
    } else {
        corners.push(place(0.0, centroid, height));
    }

    let through = |point: DVec3, normal: DVec3| HalfSpace { normal, offset: normal.dot(point) };
    let mut faces = vec![through(corner, DVec3::NEG_Y)];
    if top_over_base > 0.0 {
        faces.push(through(corner + DVec3::Y * height, DVec3::Y));
    }
    for (i, from) in base.iter().enumerate() {
        let to = base[(i + 1) % base.len()];
        let across = (to - from).perp().normalize();
        let reach = across.dot(from - centroid);
        let outward = turned(across * reach.signum());
        // At height y the side is `reach (1 - (1 - top_over_base) y / height)` from the axis.
        let up = reach.abs() * (1.0 - top_over_base) / height;
        let normal = DVec3::new(outward.x, up, outward.y).normalize();
        faces.push(through(corners[i], normal));
    }
    Form::ConvexPolyhedron(ConvexPolyhedronForm { faces, corners })
}

/// The corner of a base whose middle is `base`, `width` wide and `depth` deep: half of both away
/// towards -x and +z, in numbers that read well.
pub(super) fn corner_of_centered(base: DVec3, width: f64, depth: f64) -> [f64; 3] {
    let scale = width.min(depth);
    [round_nice(base.x - width / 2.0, scale), base.y, round_nice(base.z + depth / 2.0, scale)]
}

#[cfg(test)]
mod tests {
    use crate::primitive::{ConvexPolyhedronForm, Form, HalfSpace};
    use crate::shape::{Cube, Cuboid, Prism, Pyramid, ShapeDesc};
    use glam::DVec3;

    fn parts(form: Form) -> (Vec<HalfSpace>, Vec<DVec3>) {
        match form {
            Form::ConvexPolyhedron(ConvexPolyhedronForm { faces, corners }) => (faces, corners),
            other => panic!("{other:?}"),
        }
    }

    fn has_corner(form: &Form, x: f64, y: f64, z: f64) -> bool {
        let at = DVec3::new(x, y, z);
        parts(form.clone()).1.iter().any(|c| (c - at).length() < 1e-12)
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
    fn corners_are_where_faces_meet() {
        for (name, count, form) in solids() {
            let (faces, corners) = parts(form);
            assert_eq!(faces.len(), count, "{name}");
            for face in &faces {
                assert!((face.normal.length() - 1.0).abs() < 1e-15, "{name}: {face:?}");
                let on =
                    corners.iter().filter(|c| (face.normal.dot(**c) - face.offset).abs() < 1e-12);
                assert!(on.count() >= 3, "{name}: {face:?} has too few corners");
                for corner in &corners {
                    assert!(face.normal.dot(*corner) <= face.offset + 1e-12, "{name}: {corner}");
                }
            }
            for corner in &corners {
                let meet =
                    faces.iter().filter(|f| (f.normal.dot(*corner) - f.offset).abs() < 1e-12);
                assert!(meet.count() >= 3, "{name}: {corner}");
            }
        }
    }

    #[test]
    fn normals_survive_a_place_far_from_the_origin() {
        let here = Prism { corner: [0.0; 3], side: 1.0, height: 1.0, rotation: 10.0 }.form();
        let there = Prism { corner: [1e9; 3], side: 1.0, height: 1.0, rotation: 10.0 }.form();
        let normals = |form| parts(form).0.iter().map(|f| f.normal).collect::<Vec<_>>();
        assert_eq!(normals(here), normals(there));
    }

    #[test]
    fn an_unturned_cube_spans_exactly_what_it_says() {
        let cube = Cube { corner: [0.1, 0.2, 0.3], edge: 0.7, rotation: 0.0 }.form();
        let (low, high) = cube.bounds().unwrap();
        assert_eq!((low.x, low.y, high.z), (0.1, 0.2, 0.3));
        assert_eq!((high.x, high.y, low.z), (0.1 + 0.7, 0.2 + 0.7, 0.3 - 0.7));
    }

    #[test]
    fn turns_are_counter_clockwise_seen_from_above() {
        let prism = |rotation| Prism { corner: [0.0; 3], side: 1.0, height: 1.0, rotation }.form();
        let h = 0.75f64.sqrt();
        // The centroid is (0.5, -h / 3); the third vertex points away, then to the left.
        assert!(has_corner(&prism(0.0), 0.5, 0.0, -h));
        assert!(has_corner(&prism(90.0), 0.5 - 2.0 / 3.0 * h, 0.0, -h / 3.0));
        assert!(has_corner(&prism(180.0), 0.5, 0.0, h / 3.0));
        assert!(has_corner(&prism(-90.0), 0.5 + 2.0 / 3.0 * h, 0.0, -h / 3.0));
    }

    #[test]
    fn pyramids_are_cut_only_below_their_apex() {
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
