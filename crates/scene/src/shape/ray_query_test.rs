//! Tests of `Form::cast` with every shape.

use crate::shape::{EXAMPLES, Shape};
use glam::{DAffine3, DQuat, DVec3};
use std::f64::consts::FRAC_PI_4;
use zerkalo_kernel::primitive::{Form, SphereForm};

/// Checks that a ray from above hits every kind of shape, and that the ray in the opposite
/// direction from the same origin misses. The ray points to the centre of the bounding box. If the
/// shape has a hole, the ray points to a point between the centre and a side.
#[test]
fn ray_from_above_hits_every_kind() {
    for (key, _) in EXAMPLES {
        let base = DVec3::new(1.0, 0.5, -2.0);
        let shape = Shape::fitted_to(key, base, DVec3::new(1.0, 1.5, 2.0)).unwrap();
        let form = shape.form();
        let (low, high) = form.bounds().unwrap_or((base, base));
        let middle = (low + high) / 2.0;
        if *key == "rectangle" {
            // The rectangle is upright; its ray comes from the front instead of from above.
            let front = middle + DVec3::Z;
            assert_eq!(form.cast(front, DVec3::NEG_Z), Some(1.0));
            assert_eq!(form.cast(front, DVec3::Z), None);
            continue;
        }
        let origin = middle + DVec3::new(0.3, 7.0, 0.2);
        let beside = DVec3::new((high.x - middle.x) * 0.75, 0.0, 0.0);
        let targets = [middle, middle + beside];
        let t = targets.iter().find_map(|target| form.cast(origin, target - origin));
        let t = t.unwrap_or_else(|| panic!("no ray hits {key}"));
        assert!(t > 0.0 && t <= 1.0 + 1e-12, "{key}: {t}");
        assert_eq!(form.cast(origin, origin - middle), None, "{key}: away from it");
    }
}

#[test]
fn ray_query_returns_known_distances() {
    let ball = Form::Sphere(SphereForm { center: DVec3::ZERO, radius: 2.0 });
    assert_eq!(ball.cast(DVec3::Y * 5.0, DVec3::NEG_Y), Some(3.0));
    assert_eq!(ball.cast(DVec3::ZERO, DVec3::NEG_Y), Some(2.0), "from inside");
    assert_eq!(ball.cast(DVec3::new(3.0, 5.0, 0.0), DVec3::NEG_Y), None);
    let pressed = ball.transformed(&DAffine3::from_scale(DVec3::new(1.0, 0.5, 1.0)));
    assert_eq!(pressed.cast(DVec3::Y * 5.0, DVec3::NEG_Y), Some(4.0));
    let cube = Shape::fitted_to("cube", DVec3::ZERO, DVec3::ONE).unwrap().form();
    assert_eq!(cube.cast(DVec3::Y * 3.0, DVec3::NEG_Y), Some(2.0));
    assert_eq!(cube.cast(DVec3::Y * 0.5, DVec3::NEG_Y), Some(0.5), "from inside");
    assert_eq!(cube.cast(DVec3::new(0.6, 3.0, 0.0), DVec3::NEG_Y), None);
    let rotated = cube.transformed(&DAffine3::from_quat(DQuat::from_rotation_y(FRAC_PI_4)));
    let t = rotated.cast(DVec3::new(0.6, 3.0, 0.0), DVec3::NEG_Y).unwrap();
    assert!((t - 2.0).abs() < 1e-12, "a rotated cube reaches further: {t}");
}
