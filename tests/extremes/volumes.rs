//! Volumes of compounds from the chords of lines.

use crate::extremes::compound::{
    ball, block, chords, difference, intersection, lines, torus, union,
};
use crate::harness::*;

/// Returns the volume of `form`, which is in the cube from -`half` to `half`, and the standard
/// error of this volume. They are computed from the chords of parallel lines, one in each cell of a
/// lattice.
fn volume(name: &str, form: &Form, half: f64, seed: u64) -> (f64, f64) {
    let mut numbers = Numbers::new(seed);
    let side = 400;
    let cell = 2.0 * half / f64::from(side);
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.5, 0.7);
    // The cube's shadow along any direction fits into sqrt 3 times its side.
    let reach = 3f64.sqrt();
    let mut sum = 0.0;
    let mut squares = 0.0;
    for row in 0..side {
        let lines: Vec<Line> = (0..side)
            .map(|column| {
                let coordinate =
                    |i: i32, n: &mut Numbers| reach * (cell * (f64::from(i) + n.unit()) - half);
                let (u, v) = (coordinate(row, &mut numbers), coordinate(column, &mut numbers));
                (turn * DVec3::new(u, v, -4.0 * half), turn * DVec3::Z)
            })
            .collect();
        let found = chords::<Double>(name, form, &lines);
        sum += found.iter().sum::<f64>();
        squares += found.windows(2).map(|w| 0.5 * (w[0] - w[1]).powi(2)).sum::<f64>();
    }
    let area = (reach * cell).powi(2);
    (sum * area, squares.sqrt() * area)
}

/// Checks the volumes of compounds against closed forms.
#[test]
fn extreme_09_volumes() {
    let mut worst = 0f64;
    let lens = |r: f64, s: f64, d: f64| {
        PI * (r + s - d).powi(2) * (d * d + 2.0 * d * (r + s) - 3.0 * (r - s).powi(2)) / (12.0 * d)
    };
    let rod =
        |end: [f64; 3], radius: f64| Cylinder { base: end.map(|x| -x), top: end, radius }.form();
    let above = |height: f64| Form::Plane(PlaneForm { normal: DVec3::Y, offset: height });
    let below = |height: f64| Form::Plane(PlaneForm { normal: DVec3::NEG_Y, offset: -height });
    // Ball pierced by a rod that leaves a ring of height 1.2.
    let ring: f64 = 1.2;
    let hole = (1.0 - ring * ring / 4.0).sqrt();
    let cone = Form::conical_frustum(DAffine3::from_translation(DVec3::new(0.0, 0.0, -0.5)), 0.0);
    let half_space = |normal: DVec3, offset| Form::Plane(PlaneForm { normal, offset });
    for (n, (name, form, expected)) in [
        (
            "lens",
            intersection(vec![ball(-0.3, 0.0, 0.0, 1.0), ball(0.5, 0.0, 0.0, 0.8)]),
            lens(1.0, 0.8, 0.8),
        ),
        (
            "two balls",
            union(vec![ball(-0.3, 0.0, 0.0, 1.0), ball(0.5, 0.0, 0.0, 0.8)]),
            4.0 / 3.0 * PI * (1.0 + 0.512) - lens(1.0, 0.8, 0.8),
        ),
        (
            "cap",
            intersection(vec![ball(0.0, 0.0, 0.0, 1.0), below(0.4)]),
            PI * 0.36 * (3.0 - 0.6) / 3.0,
        ),
        (
            "cap cut away",
            difference(vec![ball(0.0, 0.0, 0.0, 1.0), below(0.4)]),
            4.0 / 3.0 * PI - PI * 0.36 * (3.0 - 0.6) / 3.0,
        ),
        (
            "slice",
            intersection(vec![ball(0.0, 0.0, 0.0, 1.0), above(0.25), below(-0.25)]),
            PI * (0.5 - 2.0 * 0.25f64.powi(3) / 3.0),
        ),
        (
            "napkin ring",
            difference(vec![ball(0.0, 0.0, 0.0, 1.0), rod([0.0, 2.0, 0.0], hole)]),
            PI * ring.powi(3) / 6.0,
        ),
        ("torus", torus(1.0, 0.4), 2.0 * PI * PI * 0.16),
        (
            "half a torus",
            intersection(vec![torus(0.9, 0.45), half_space(DVec3::X, 0.0)]),
            PI * PI * 0.9 * 0.45 * 0.45,
        ),
        (
            "Steinmetz",
            intersection(vec![rod([2.0, 0.0, 0.0], 0.7), rod([0.0, 2.0, 0.0], 0.7)]),
            16.0 * 0.7f64.powi(3) / 3.0,
        ),
        (
            "frustum",
            intersection(vec![cone.clone(), half_space(DVec3::Z, 0.1)]),
            PI * 0.6 * (1.0 + 0.4 + 0.16) / 3.0,
        ),
        (
            "truncated pyramid",
            difference(vec![
                zerkalo_scene::shape::Pyramid {
                    corner: [-0.6, -0.5, 0.6],
                    side: 1.2,
                    apex_height: 1.5,
                    height: 1.5,
                    rotation: 20.0,
                }
                .form(),
                below(0.1),
            ]),
            // The pyramid of height 1.5 is cut at the height 0.6, where its side is 0.72.
            0.6 * (1.44 + 0.5184 + (1.44f64 * 0.5184).sqrt()) / 3.0,
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let (found, error) = volume(name, &form, 1.4, 90 + n as u64);
        let z = (found - expected) / error;
        assert!(error < 2e-3 * expected, "{name}: {found} +- {error}");
        assert!(z.abs() < 4.0, "{name}: {found} +- {error}, not {expected}: {z} sigma");
        worst = worst.max(z.abs());
    }
    report(9, "double", &format!("volumes {worst:.1} sigma off at most"));
}

/// Checks the inclusion-exclusion principle on every line: L(A or B) + L(A and B) = L(A) + L(B),
/// where L is the length of the line inside a solid.
#[test]
fn extreme_09_inclusion_and_exclusion() {
    let solids = [
        ball(0.2, -0.1, 0.0, 0.9),
        block([-0.3, 0.2, 0.1], [1.1, 0.9, 1.5]),
        Cylinder { base: [-0.8, -0.9, 0.3], top: [0.7, 0.8, -0.2], radius: 0.5 }.form(),
        Form::conical_frustum(DAffine3::from_scale(DVec3::new(0.7, 0.9, 1.1)), 0.2),
        ball(0.0, 0.0, 0.0, 0.8).transformed(&DAffine3::from_scale(DVec3::new(1.0, 0.5, 1.6))),
    ];
    let lines = lines(91, 40_000);
    let alone: Vec<Vec<f64>> = solids.iter().map(|s| chords::<Double>("one", s, &lines)).collect();
    for i in 0..solids.len() {
        for j in 0..i {
            let pair = || vec![solids[i].clone(), solids[j].clone()];
            let either = chords::<Double>("or", &union(pair()), &lines);
            let both = chords::<Double>("and", &intersection(pair()), &lines);
            let first = chords::<Double>("minus", &difference(pair()), &lines);
            for n in 0..lines.len() {
                let sum = alone[i][n] + alone[j][n];
                let context = || format!("{i} {j} {:?}", lines[n]);
                // Intervals thinner than the tie tolerance are dropped. Along grazing lines, the
                // tolerance is larger.
                let close = |a: f64, b: f64| (a - b).abs() < 1e-5;
                assert!(close(either[n] + both[n], sum), "{}: {}", context(), either[n] + both[n]);
                assert!(close(first[n] + both[n], alone[i][n]), "{}", context());
            }
        }
    }
}
