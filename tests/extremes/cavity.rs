//! A camera in the hollow of a compound.

use crate::common::Numbers;
use crate::compound::{block, difference, geometry};
use crate::rays::{Line, closest};
use glam::DVec3;
use zerkalo::lanes::{Double, SimdFloat, Single};
use zerkalo::primitive::{Form, SphereForm};
use zerkalo::shape::{Cylinder, ShapeDesc};

fn ball(radius: f64) -> Form {
    Form::Sphere(SphereForm { center: DVec3::ZERO, radius })
}

/// From inside the hollow of a solid whose walls are at least 0.2 thick: the wall is met where it
/// begins, then where it ends, and beyond there is nothing.
fn check_hollow<L: SimdFloat>(name: &str, form: &Form, seed: u64) {
    let geometry = geometry::<L>(form);
    let mut numbers = Numbers::new(seed);
    let mut lines: Vec<Line> =
        (0..100_000).map(|_| (numbers.in_cube(0.25), numbers.direction())).collect();
    for outward in [false, true] {
        let met = closest(&geometry, &lines);
        for (line, met) in lines.iter_mut().zip(met) {
            let told = || format!("{name}, {}: {line:?} {met:?}", L::NAME);
            let met = met.unwrap_or_else(|| panic!("lost: {}", told()));
            assert_eq!(met.normal.dot(line.1) > 0.0, outward, "{}", told());
            line.0 += line.1 * (met.t + 1e-3);
        }
    }
    for (line, met) in lines.iter().zip(closest(&geometry, &lines)) {
        assert!(met.is_none(), "{name}, {}: beyond, {line:?} {met:?}", L::NAME);
    }
}

#[test]
fn extreme_04_camera_inside_a_cavity() {
    let rod = Cylinder { base: [0.0, -0.5, 0.0], top: [0.0, 0.5, 0.0], radius: 0.5 }.form();
    for (i, (name, form)) in [
        ("ball in ball", difference(vec![ball(1.0), ball(0.6)])),
        ("box in box", difference(vec![block([0.0; 3], [2.0; 3]), block([0.0; 3], [1.0; 3])])),
        ("cylinder in box", difference(vec![block([0.0; 3], [2.0; 3]), rod])),
        ("box in ball", difference(vec![ball(1.2), block([0.0; 3], [1.0; 3])])),
    ]
    .into_iter()
    .enumerate()
    {
        check_hollow::<Double>(name, &form, 400 + i as u64);
        check_hollow::<Single>(name, &form, 420 + i as u64);
    }
}
