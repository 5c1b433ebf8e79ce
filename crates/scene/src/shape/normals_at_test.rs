//! Tests of `Form::normals_at` with every shape.

use crate::shape::{EXAMPLES, Shape};
use glam::{DAffine3, DVec3};
use std::f64::consts::PI;
use zerkalo_kernel::primitive::AROUND_TIP;

/// Checks `normals_at` for rays from all sides. At the point where a ray hits the shape, it must
/// return a normal that is not perpendicular to the ray. At the origin of the ray, which is not on
/// the shape, it must return none.
#[test]
fn normals_at_hit_points_face_ray() {
    for (key, _) in EXAMPLES {
        let shape = Shape::fitted_to(key, DVec3::new(1.0, 0.5, -2.0), DVec3::new(1.0, 1.5, 2.0));
        let form = shape.unwrap().form();
        let (low, high) = form.bounds().unwrap_or((DVec3::splat(-1.0), DVec3::splat(1.0)));
        let (middle, size) = (0.5 * (low + high), (high - low).length());
        let mut hits = 0;
        for i in 0..200 {
            let angle = f64::from(i) * 2.4;
            let direction = DVec3::new(angle.cos(), (f64::from(i) * 1.7).sin(), angle.sin());
            let origin = middle + direction.normalize() * size;
            let aim = middle + DVec3::new(0.11, 0.07, -0.05) * (high - low);
            let Some(t) = form.cast(origin, aim - origin) else { continue };
            hits += 1;
            let point = origin + (aim - origin) * t;
            let normals = form.normals_at(point, 1e-6);
            assert!(!normals.is_empty() && !normals[0].is_empty(), "{key}: {point}");
            let facing = normals.iter().flatten().any(|n| n.dot(origin - point).abs() > 1e-9);
            assert!(facing, "{key}: {normals:?} at {point}");
            assert!(form.normals_at(origin, 1e-6).is_empty(), "{key}: {origin}");
        }
        assert!(hits > 20, "{key}: {hits}");
    }
}

#[test]
fn normals_at_corners_and_tips_are_several() {
    let cube = Shape::fitted_to("cube", DVec3::ZERO, DVec3::ONE).unwrap().form();
    let count_at = |p: DVec3| cube.normals_at(p, 1e-9).concat().len();
    assert_eq!(count_at(DVec3::new(0.5, 1.0, 0.5)), 3);
    assert_eq!(count_at(DVec3::new(0.5, 1.0, 0.2)), 2);
    assert_eq!(count_at(DVec3::new(0.1, 1.0, 0.2)), 1);
    assert_eq!(count_at(DVec3::new(0.1, 0.5, 0.2)), 0);
    assert_eq!(count_at(DVec3::new(0.6, 1.0, 0.2)), 0);
    let cone = Shape::fitted_to("cone", DVec3::ZERO, DVec3::ONE).unwrap().form();
    assert_eq!(cone.normals_at(DVec3::Y, 1e-9).concat().len(), AROUND_TIP as usize);
}

#[test]
fn normals_at_points_beside_a_turned_rectangle_are_none() {
    let platform = Shape::fitted_to("platform", DVec3::ZERO, DVec3::ONE).unwrap().form();
    let (low, high) = platform.bounds().unwrap();
    let rotation = DAffine3::from_rotation_y(0.25 * PI);
    let rotated =
        platform.transformed(&(rotation * DAffine3::from_translation(-0.5 * (low + high))));
    let count_at = |x: f64, z: f64| rotated.normals_at(DVec3::new(x, 0.0, z), 1e-9).concat().len();
    let half_diagonal = 0.5f64.sqrt();
    for (x, z) in [(0.0, 0.0), (0.35, -0.35), (half_diagonal, 0.0), (0.0, -half_diagonal)] {
        assert_eq!(count_at(x, z), 1, "{x} {z}");
    }
    for (x, z) in [(0.36, 0.36), (-0.6, 0.2), (half_diagonal + 1e-6, 0.0)] {
        assert_eq!(count_at(x, z), 0, "{x} {z}");
    }
}
