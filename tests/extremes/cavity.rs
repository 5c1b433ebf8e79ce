//! Cameras in the cavity of a compound solid.

use crate::extremes::compound::{block, difference, geometry};
use crate::harness::*;

fn ball(radius: f64) -> Form {
    Form::Sphere(SphereForm { center: DVec3::ZERO, radius })
}

/// Checks rays from inside the cavity of a solid whose walls are at least 0.2 thick. Each ray must
/// hit the inner surface of the wall, then its outer surface, and nothing beyond.
fn check_cavity<L: SimdFloat>(name: &str, form: &Form, seed: u64) {
    let geometry = geometry::<L>(form);
    let mut numbers = Numbers::new(seed);
    let mut lines: Vec<Line> =
        (0..100_000).map(|_| (numbers.in_cube(0.25), numbers.direction())).collect();
    for outward in [false, true] {
        let hits = closest(&geometry, &lines);
        for (line, hit) in lines.iter_mut().zip(hits) {
            let context = || format!("{name}, {}: {line:?} {hit:?}", L::NAME);
            let hit = hit.unwrap_or_else(|| panic!("lost: {}", context()));
            assert_eq!(hit.normal.dot(line.1) > 0.0, outward, "{}", context());
            line.0 += line.1 * (hit.t + 1e-3);
        }
    }
    for (line, hit) in lines.iter().zip(closest(&geometry, &lines)) {
        assert!(hit.is_none(), "{name}, {}: beyond, {line:?} {hit:?}", L::NAME);
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
        check_cavity::<Double>(name, &form, 400 + i as u64);
        check_cavity::<Single>(name, &form, 420 + i as u64);
    }
}
