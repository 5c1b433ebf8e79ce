//! Tests of `primitive/ray_query.rs` with every shape.

use crate::primitive::Form;
use crate::shape::{EXAMPLES, Shape};
use glam::{DAffine3, DQuat, DVec3};
use std::f64::consts::FRAC_PI_4;

/// What is met lies on the way between outside and inside, or on the surface's plane.
#[test]
fn every_kind_is_met_from_above_its_middle() {
    for (key, _) in EXAMPLES {
        let base = DVec3::new(1.0, 0.5, -2.0);
        let shape = Shape::fitted_to(key, base, DVec3::new(1.0, 1.5, 2.0)).unwrap();
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
    let cube = Shape::fitted_to("cube", DVec3::ZERO, DVec3::ONE).unwrap().form();
    assert_eq!(cube.cast(DVec3::Y * 3.0, DVec3::NEG_Y), Some(2.0));
    assert_eq!(cube.cast(DVec3::Y * 0.5, DVec3::NEG_Y), Some(0.5), "from inside");
    assert_eq!(cube.cast(DVec3::new(0.6, 3.0, 0.0), DVec3::NEG_Y), None);
    let turned = cube.transformed(&DAffine3::from_quat(DQuat::from_rotation_y(FRAC_PI_4)));
    let t = turned.cast(DVec3::new(0.6, 3.0, 0.0), DVec3::NEG_Y).unwrap();
    assert!((t - 2.0).abs() < 1e-12, "a turned cube reaches further: {t}");
}
