//! Tests of `primitive/ray_query.rs` with every shape.

use crate::primitive::Form;
use crate::shape::{EXAMPLES, Shape};
use glam::{DAffine3, DQuat, DVec3};
use std::f64::consts::FRAC_PI_4;

/// Every kind is hit by a ray from above towards its centre, at most at the centre, and missed by the
/// opposite ray.
#[test]
fn ray_from_above_hits_every_kind() {
    for (key, _) in EXAMPLES {
        let base = DVec3::new(1.0, 0.5, -2.0);
        let shape = Shape::fitted_to(key, base, DVec3::new(1.0, 1.5, 2.0)).unwrap();
        let form = shape.form();
        let up = form.bounds().map_or(base, |(low, high)| (low + high) / 2.0);
        let origin = up + DVec3::new(0.3, 7.0, 0.2);
        let t = form.cast(origin, up - origin);
        if *key == "rectangle" {
            // The rectangle is upright: it is hit from its front only.
            let front = up + DVec3::Z;
            assert_eq!(form.cast(front, DVec3::NEG_Z), Some(1.0));
            assert_eq!(form.cast(front, DVec3::Z), None);
            continue;
        }
        let t = t.unwrap_or_else(|| panic!("{key} is missed"));
        assert!(t > 0.0 && t <= 1.0 + 1e-12, "{key}: {t}");
        assert_eq!(form.cast(origin, origin - up), None, "{key}: away from it");
    }
}

#[test]
fn ray_query_returns_known_distances() {
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
