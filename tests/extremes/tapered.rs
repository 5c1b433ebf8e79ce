//! Extremes of cylinders, cones and conical frusta.

use crate::harness::*;
use zerkalo_scene::shape::{Cone, TaperedCylinder, UnitFrustum};

fn canonical(s: f64) -> Form {
    Form::conical_frustum(DAffine3::IDENTITY, s)
}

fn closest_hits<L: SimdFloat>(form: &Form, lines: &[Line]) -> Vec<Option<LineHit>> {
    closest(&Aggregate::<L>::new(std::slice::from_ref(form)), lines)
}

/// Returns the distances at which a line enters and leaves a solid, found by two opposite rays. The
/// rays start at the distance `far` before and behind the line's origin.
fn ends(form: &Form, (p, d): Line, far: f64) -> Option<(f64, f64)> {
    let hits = closest_hits::<Double>(form, &[(p - d * far, d), (p + d * far, -d)]);
    Some((hits[0]?.t - far, far - hits[1]?.t))
}

/// Returns random lines through a box around the canonical solids, which have the axis from z = 0
/// to z = 1 and the radius 1 at z = 0.
fn lines(seed: u64, count: usize) -> Vec<Line> {
    let mut numbers = Numbers::new(seed);
    (0..count)
        .map(|_| {
            let d = numbers.direction();
            let at = DVec3::new(
                numbers.between(-1.0, 1.0),
                numbers.between(-1.0, 1.0),
                numbers.between(0.0, 1.0),
            );
            (at - d * 5.0, d)
        })
        .collect()
}

/// Checks that hits change by no more than rounding from a cylinder to solids with almost equal
/// radii, where the quadratic changes its degree.
#[test]
fn extreme_11_tapered_cylinders() {
    let mut worst = 0f64;
    let lines = lines(12, 50_000);
    let straight = closest_hits::<Double>(&canonical(1.0), &lines);
    for hair in [1e-15, 1e-12, -1e-15, -1e-12] {
        let tapered = closest_hits::<Double>(&canonical(1.0 + hair), &lines);
        for ((line, a), b) in lines.iter().zip(&straight).zip(&tapered) {
            match (a, b) {
                (Some(a), Some(b)) => {
                    let flat = a.normal.dot(line.1).abs().min(b.normal.dot(line.1).abs());
                    assert!((a.t - b.t).abs() < 1e-9 / flat.max(1e-6), "{hair}: {line:?}");
                    worst = worst.max((a.t - b.t).abs() * flat.max(1e-6));
                    assert!((b.normal.length() - 1.0).abs() < 1e-14, "{hair}: {line:?}");
                }
                (None, None) => {}
                // The limb moves by about `hair`. A grazing line may therefore hit only one of the
                // two solids.
                (Some(m), None) | (None, Some(m)) => {
                    assert!(m.normal.dot(line.1).abs() < 1e-5, "{hair}: {line:?} {m:?}")
                }
            }
        }
    }
    report(11, "double", &format!("a step of {worst:.0e} at most"));
    report(11, "single", LEFT_TO_DOUBLE);
}

#[test]
fn extreme_11_untapered_solid_is_bit_equal_to_cylinder() {
    let (base, end) = ([0.1, -0.2, 0.3], [0.5, 0.9, -0.4]);
    let tapered = |base_radius, top_radius| {
        TaperedCylinder { base, top: end, base_radius, top_radius }.form()
    };
    let cylinder = Cylinder { base, top: end, radius: 0.7 }.form();
    let cone = Cone { base, apex: end, radius: 0.7 }.form();
    let unit = UnitFrustum { s: 1.0 }.form();
    for (name, a, b) in [
        ("cylinder", tapered(0.7, 0.7), cylinder),
        ("cone", tapered(0.7, 0.0), cone),
        ("canonical cylinder", canonical(1.0), unit),
    ] {
        let lines = lines(16, 50_000);
        let (a, b) = (closest_hits::<Double>(&a, &lines), closest_hits::<Double>(&b, &lines));
        assert!(a.iter().flatten().count() > 5_000, "{name}");
        for ((line, a), b) in lines.iter().zip(a).zip(b) {
            let bits = |m: LineHit| (m.t.to_bits(), m.normal.to_array().map(f64::to_bits));
            assert_eq!(a.map(bits), b.map(bits), "{name}: {line:?}");
        }
    }
    report(11, "double", "without taper bit-equal");
}

#[test]
fn extreme_11_flat_and_tall_solids() {
    let mut numbers = Numbers::new(13);
    for height in [1e-9, 1e-6, 1e6, 1e9] {
        for s in [0.0, 0.5, 1.0, 3.0] {
            let form = Form::conical_frustum(DAffine3::from_scale(DVec3::new(1.0, 1.0, height)), s);
            for n in 0..4000 {
                // Lines through a point of the axis: every second one is perpendicular to it, the
                // others have any direction.
                let at = DVec3::Z * (height * numbers.between(0.1, 0.7));
                let d = match n % 2 {
                    0 => DVec3::new(numbers.between(-1.0, 1.0), 1.0, 0.0).normalize(),
                    _ => numbers.direction(),
                };
                let far = 10.0f64;
                let line = (at - d * far, d);
                let hit = closest_hits::<Double>(&form, &[line])[0];
                let context = || format!("height {height:e}, s = {s}: {line:?} {hit:?}");
                let hit = hit.unwrap_or_else(|| panic!("lost: {}", context()));
                assert!(hit.t.is_finite() && hit.point.is_finite(), "{}", context());
                assert!((hit.normal.length() - 1.0).abs() < 1e-14, "{}", context());
            }
        }
    }
}

#[test]
fn extreme_12_along_a_generator() {
    let mut worst = 0f64;
    let rotation = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 1.0, -2.0);
    let mut numbers = Numbers::new(14);
    for place in [DAffine3::IDENTITY, DAffine3::from_quat(rotation)] {
        for s in [0.0, 0.25, 0.5, 1.0, 2.0] {
            let form = Form::conical_frustum(place, s);
            let placed = |p: DVec3| place.transform_point3(p);
            // The axis.
            let axis = (placed(DVec3::new(0.0, 0.0, 0.5)), place.matrix3 * DVec3::Z);
            let (enter, leave) = ends(&form, axis, 4.0).unwrap();
            assert!((enter + 0.5).abs() < 1e-13 && (leave - 0.5).abs() < 1e-13, "s = {s}");
            for _ in 0..2000 {
                let (sin, cos) = numbers.between(0.0, std::f64::consts::TAU).sin_cos();
                let low = placed(DVec3::new(cos, sin, 0.0));
                let high = placed(DVec3::new(s * cos, s * sin, 1.0));
                let d = (high - low).normalize();
                let middle = (low + high) / 2.0;
                // A line on a generator of the solid is inside or outside by rounding, but its hits
                // are finite. A line slightly inside has the length between the solid's ends.
                let along = [(low - d * 3.0, d)];
                let single = closest_hits::<Single>(&form, &along);
                for hit in closest_hits::<Double>(&form, &along).into_iter().chain(single).flatten()
                {
                    assert!(hit.t.is_finite() && hit.normal.is_finite(), "s = {s}: {hit:?}");
                }
                let center = placed(DVec3::Z * 0.5);
                let inner = middle + (center - middle) * 1e-9;
                let (enter, leave) = ends(&form, (inner, d), 4.0).unwrap();
                let half = low.distance(high) / 2.0;
                let error = (enter + half).abs().max((leave - half).abs());
                assert!(error < 1e-6, "s = {s}: {enter} {leave} {half}");
                worst = worst.max(error);
                let outer = middle - (center - middle) * 1e-9;
                let found = ends(&form, (outer, d), 4.0).map_or(0.0, |(a, b)| b - a);
                assert!(found < 1e-6, "s = {s}: {found}");
                // A line from the side through the apex has finite hits.
                if s == 0.0 {
                    let side = numbers.direction();
                    let hit = closest_hits::<Double>(&form, &[(high - side * 3.0, side)])[0];
                    assert!(hit.is_none_or(|m| m.t.is_finite() && m.normal.is_finite()), "{hit:?}");
                }
            }
        }
    }
    report(12, "double", &format!("finite, lengths {worst:.0e} off at most"));
    report(12, "single", "finite");
}

/// Checks tangents of cylinders, cones and conical frusta. Their hits must be finite, and no
/// tangent may have a chord longer than `limit`.
fn check_tangents<L: SimdFloat>(limit: f64) {
    let mut longest = 0.0f64;
    let mut numbers = Numbers::new(15);
    for s in [0.0f64, 0.6, 1.0, 1.5] {
        let form = canonical(s);
        let k = s - 1.0;
        let touching: Vec<Line> = (0..20_000)
            .map(|_| {
                let (sin, cos) = numbers.between(0.0, std::f64::consts::TAU).sin_cos();
                let z = numbers.between(0.01, 0.99);
                let r = 1.0 + k * z;
                // Direction in the tangent plane, which holds the generator and the circle's
                // tangent.
                let along = DVec3::new(k * cos, k * sin, 1.0).normalize();
                let around = DVec3::new(-sin, cos, 0.0);
                let rotation = numbers.between(0.2, 1.4);
                let d = along * rotation.cos() + around * rotation.sin();
                (DVec3::new(r * cos, r * sin, z) - d * 3.0, d)
            })
            .collect();
        let forward = closest_hits::<L>(&form, &touching);
        let back: Vec<Line> = touching.iter().map(|(o, d)| (*o + *d * 6.0, -*d)).collect();
        let backward = closest_hits::<L>(&form, &back);
        for ((line, a), b) in touching.iter().zip(forward).zip(backward) {
            let context = || format!("{}, s = {s}: {line:?} {a:?} {b:?}", L::NAME);
            for hit in a.iter().chain(&b) {
                assert!(hit.t.is_finite() && hit.normal.is_finite(), "{}", context());
            }
            if let (Some(a), Some(b)) = (a, b) {
                // A line whose depth below the surface is the share e of the radius has a chord of
                // about sqrt(8 e) / sin(rotation), where `turn` is its angle to the generator.
                longest = longest.max(6.0 - a.t - b.t);
                assert!(6.0 - a.t - b.t <= limit, "{}", context());
            }
        }
    }
    report(5, precision::<L>(), &format!("others: chords up to {longest:.0e}"));
}

#[test]
fn extreme_05_tangent_to_cylinders_and_cones() {
    check_tangents::<Double>(1e-6);
    check_tangents::<Single>(0.02);
}
