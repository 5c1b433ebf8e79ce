//! Camera movements: invariants of each, and valid cameras after all of them.

use crate::harness::*;
use proptest::prelude::*;

/// Returns the camera of the mirror room.
fn aimed() -> Camera {
    Camera { eye: [0.6, 1.4, 4.5], target: Some([0.0, 0.8, -0.5]), ..Camera::at_origin() }
}

/// Returns the camera of the mirror room with a direction instead of a target. Also returns the
/// distance of the omitted target from the eye.
fn free() -> (Camera, f64) {
    let view = aimed().view().unwrap();
    let direction = Some(view.to_array());
    (Camera { target: None, direction, ..aimed() }, distance(&aimed()))
}

fn eye(camera: &Camera) -> DVec3 {
    DVec3::from_array(camera.eye)
}

fn target(camera: &Camera) -> DVec3 {
    DVec3::from_array(camera.target.unwrap())
}

fn distance(camera: &Camera) -> f64 {
    (target(camera) - eye(camera)).length()
}

fn degrees_between(a: &Camera, b: &Camera) -> f64 {
    a.view().unwrap().angle_between(b.view().unwrap()).to_degrees()
}

/// Returns the elevation of the camera's view direction, in degrees.
fn pitch(camera: &Camera) -> f64 {
    camera.view().unwrap().y.asin().to_degrees()
}

#[test]
fn orbit_keeps_pivot_and_distance() {
    let start = aimed();
    let mut camera = start.clone();
    for i in 0..72 {
        camera = camera.orbit(5.0, 0.0, 1.0);
        assert_eq!(camera.target, start.target, "the target is the pivot");
        assert!((distance(&camera) - distance(&start)).abs() < 1e-4, "step {i}");
        assert!((camera.eye[1] - start.eye[1]).abs() < 1e-4, "level");
    }
    assert!((eye(&camera) - eye(&start)).length() < 1e-4 * distance(&start), "{:?}", camera.eye);
    let right = start.orbit(5.0, 0.0, 1.0);
    assert!((eye(&right) - eye(&start)).dot(start.frame()[0]) > 0.0, "to the right");
    assert!(start.orbit(0.0, 5.0, 1.0).eye[1] > start.eye[1], "upwards");
    let (start, reach) = free();
    let pivot = |camera: &Camera| eye(camera) + camera.view().unwrap() * reach;
    let rotated = start.orbit(70.0, 20.0, reach);
    assert!((pivot(&rotated) - pivot(&start)).length() < 1e-4, "a pivot ahead stays, too");
    assert_eq!(rotated.target, None);
}

#[test]
fn orbit_never_reaches_the_poles() {
    for start in [aimed(), free().0] {
        let mut camera = start.clone();
        for _ in 0..40 {
            camera = camera.orbit(3.0, 10.0, 5.0);
        }
        assert!((pitch(&camera) + 89.9).abs() < 1e-2, "{}", pitch(&camera));
        let back = (0..9).fold(camera, |camera, _| camera.orbit(0.0, -10.0, 5.0));
        assert!(pitch(&back).abs() < 0.2, "{}", pitch(&back));
        let mut camera = start;
        for _ in 0..40 {
            camera = camera.look(0.0, 10.0);
        }
        assert!((pitch(&camera) - 89.9).abs() < 1e-2, "{}", pitch(&camera));
    }
}

#[test]
fn camera_coordinates_stay_short() {
    let mut camera = aimed();
    for _ in 0..100 {
        camera = camera.orbit(1.7, 0.3, 1.0).pan(0.013, 0.02, 1.0).dolly(0.99, 1.0).look(0.1, 0.2);
        for x in camera.eye.into_iter().chain(camera.target.unwrap()) {
            assert!(format!("{x}").len() <= 10, "{x}");
        }
    }
}

#[test]
fn pan_and_fly_move_the_target() {
    let start = aimed();
    for camera in [start.pan(0.1, -0.2, 1.0), start.fly([0.5, 0.25, -1.0])] {
        assert!(degrees_between(&camera, &start) < 1e-4);
        assert!((distance(&camera) - distance(&start)).abs() < 1e-5);
    }
    let [right, up, forward] = start.frame();
    let by = eye(&start.fly([0.5, 0.25, -1.0])) - eye(&start);
    assert!((by - (right * 0.5 + up * 0.25 - forward)).length() < 1e-5, "{by}");
    let by = eye(&start.pan(0.1, 0.0, 1.0)) - eye(&start);
    assert!((by - right * (0.1 * distance(&start))).length() < 1e-5, "{by}");
}

#[test]
fn dolly_never_passes_the_pivot() {
    let mut camera = aimed();
    for _ in 0..1000 {
        camera = camera.dolly(0.8, 1.0);
        assert!(degrees_between(&camera, &aimed()) < 1.0);
    }
    assert!(distance(&camera) > 0.0 && distance(&camera) < 1e-4, "{}", distance(&camera));
    let (start, reach) = free();
    let near = start.dolly(0.5, reach);
    let gone = (eye(&near) - eye(&start)).length();
    assert!((gone - reach / 2.0).abs() < 1e-5, "{gone} of {reach}");
    for factor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(aimed().dolly(factor, 1.0), aimed(), "{factor}");
    }
}

#[test]
fn look_roll_and_zoom() {
    let start = aimed();
    let right = start.look(10.0, 0.0);
    assert_eq!(right.eye, start.eye);
    assert!(right.view().unwrap().dot(start.frame()[0]) > 0.0, "to the right");
    assert!((pitch(&start.look(0.0, 10.0)) - pitch(&start) - 10.0).abs() < 1e-4);
    let rolled = start.roll(90.0);
    assert!(degrees_between(&rolled, &start) == 0.0);
    let tilt = rolled.frame()[1].dot(start.frame()[0]);
    assert!((tilt - 1.0).abs() < 1e-5, "up is to the right of where it was: {tilt}");
    assert_eq!(start.zoom(1.0), start);
    let narrow = start.zoom(0.5).view_angle.degrees();
    let expected = 2.0 * (20f64.to_radians().tan() * 0.5).atan().to_degrees();
    assert!((narrow - expected).abs() < 0.01, "{narrow} {expected}");
    let narrowest = (0..99).fold(start.clone(), |camera, _| camera.zoom(0.5));
    assert_eq!(narrowest.view_angle, ViewAngle::Vertical(0.1));
    let widest = (0..99).fold(start, |camera, _| camera.zoom(2.0));
    assert_eq!(widest.view_angle, ViewAngle::Vertical(170.0));
}

#[test]
fn framed_target_fills_the_picture() {
    for aspect in [4.0 / 3.0, 0.5] {
        for view_angle in [ViewAngle::Vertical(40.0), ViewAngle::Horizontal(70.0)] {
            for start in [aimed(), free().0] {
                let start = Camera { view_angle, ..start };
                let (center, radius) = (DVec3::new(-0.9, 0.5, 0.0), 0.5);
                let camera = start.framed(center.to_array(), radius, [aspect, 1.0]);
                assert!(degrees_between(&camera, &start) < 1e-4);
                let to = center - eye(&camera);
                let [half_width, half_height] = camera.half_size([aspect, 1.0]);
                let half = half_width.min(half_height).atan();
                let share = (radius / to.length()).asin() / half;
                assert!(share < 1.0 && share > 0.85, "{share} of the picture");
                assert!(to.angle_between(camera.view().unwrap()) < 1e-5);
                assert_eq!(camera.target.is_some(), start.target.is_some());
            }
        }
    }
}

fn movement() -> impl Strategy<Value = (u8, f64, f64)> {
    let amount = prop_oneof![
        -200.0..200.0f64,
        -0.1..0.1f64,
        prop::sample::select(vec![0.0, 1e-9, 1e6, -1e12, 1e300, f64::NAN, f64::INFINITY]),
    ];
    (0..8u8, amount.clone(), amount)
}

fn moved(camera: &Camera, (what, a, b): (u8, f64, f64), distance: f64) -> Camera {
    match what {
        0 => camera.orbit(a, b, distance),
        1 => camera.pan(a, b, distance),
        2 => camera.dolly(a.abs(), distance),
        3 => camera.fly([a, b, a - b]),
        4 => camera.look(a, b),
        5 => camera.roll(a),
        6 => camera.zoom(a.abs()),
        _ => camera.framed([a, b, a * 0.5], b.abs(), [1.0 + a.abs(), 1.0]),
    }
}

proptest! {
    #[test]
    fn no_movement_leads_to_a_fault(
        start in super::random::camera(),
        reach in prop_oneof![1e-3..1e3f64, Just(0.0), Just(f64::NAN)],
        movements in prop::collection::vec(movement(), 1..200),
    ) {
        let mut camera = start;
        for movement in movements {
            let before = camera.clone();
            camera = moved(&camera, movement, reach);
            prop_assert_eq!(camera.faults(), [], "{:?} of {:?}", movement, before);
            prop_assert_eq!(camera.target.is_some(), before.target.is_some());
        }
    }

    #[test]
    fn small_movements_by_the_thousand_do_not_wear_it_out(
        movements in prop::collection::vec((0..3u8, -3.0..3.0f64, -3.0..3.0f64), 20..40),
    ) {
        let start = aimed();
        let mut camera = start.clone();
        for _ in 0..50 {
            for (what, a, b) in &movements {
                camera = match what {
                    0 => camera.orbit(*a, *b, 1.0),
                    1 => camera.look(*a, *b),
                    _ => camera.pan(a * 0.01, b * 0.01, 1.0),
                };
            }
        }
        prop_assert!((distance(&camera) / distance(&start) - 1.0).abs() < 1e-3);
        prop_assert_eq!(camera.up, start.up);
        let [right, up, forward] = camera.frame();
        prop_assert!(right.y.abs() < 1e-6, "the horizon stays level");
        prop_assert!(up.y > 0.0 && forward.y.abs() < 1.0);
    }
}
