//! Tests of tori:
//!
//! - hits, against the roots of the quartic in double precision
//! - volumes and surfaces, against closed forms
//! - self-shadowing
//! - tori in compounds

use crate::harness::*;
use zerkalo_kernel::primitive::TorusForm;

/// Ratios of the tube's radius to the ring's radius.
const TUBES: [f64; 6] = [1e-3, 1e-2, 0.1, 0.4, 0.9, 1.0];

fn torus(tube: f64) -> Form {
    TorusForm { scene_from_torus: DAffine3::IDENTITY, ring: 1.0, tube }.into()
}

fn geometry<L: SimdFloat>(form: &Form) -> Aggregate<L> {
    Aggregate::new(std::slice::from_ref(form))
}

/// Returns the distance of the point `p` from the surface of the torus; it is negative inside.
fn height(p: DVec3, tube: f64) -> f64 {
    (p.x.hypot(p.z) - 1.0).hypot(p.y) - tube
}

/// Returns the real roots of a polynomial in ascending order, by bisection between the roots of its
/// derivative. Coefficients start with the lowest degree.
fn roots(coefficients: &[f64]) -> Vec<f64> {
    let value = |x: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c);
    if coefficients.len() == 2 {
        return vec![-coefficients[0] / coefficients[1]];
    }
    let derivative: Vec<f64> =
        coefficients.iter().enumerate().skip(1).map(|(i, c)| c * i as f64).collect();
    let mut ends = vec![-4.0];
    ends.extend(roots(&derivative));
    ends.push(4.0);
    let mut out = Vec::new();
    for pair in ends.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        if (value(low) < 0.0) == (value(high) < 0.0) {
            continue;
        }
        let rising = value(low) < 0.0;
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if (value(middle) < 0.0) == rising { low = middle } else { high = middle }
        }
        out.push(0.5 * (low + high));
    }
    out
}

/// Returns the coefficients of (|p|^2 + 1 - tube^2)^2 - 4 (x^2 + z^2) along a line, as a polynomial
/// in the distance from the line's point nearest to the torus's centre. Also returns the distance
/// of that point from the line's origin.
fn quartic((origin, d): Line, tube: f64) -> ([f64; 5], f64) {
    let start = -origin.dot(d);
    let p = origin + d * start;
    let k = p.length_squared() + 1.0 - tube * tube;
    let a = d.x * d.x + d.z * d.z;
    let b = p.x * d.x + p.z * d.z;
    let c = p.x * p.x + p.z * p.z;
    ([k * k - 4.0 * c, -8.0 * b, 2.0 * k - 4.0 * a, 0.0, 1.0], start)
}

/// Returns a random line near the torus. Half of the lines pass through a random surface point in
/// any direction. The others are tangents, shifted slightly above or below the surface.
fn line(numbers: &mut Numbers, tube: f64) -> Line {
    let angles = [numbers.between(0.0, 2.0 * PI), numbers.between(0.0, 2.0 * PI)];
    let outward = DVec3::new(angles[0].cos(), 0.0, angles[0].sin());
    let normal = outward * angles[1].cos() + DVec3::Y * angles[1].sin();
    let on_surface = outward + normal * tube;
    let far = [0.5, 4.0, 100.0][numbers.below(3)];
    if numbers.below(2) == 0 {
        let d = numbers.direction();
        return (on_surface - d * far, d);
    }
    let tangent = numbers.direction().cross(normal).normalize();
    let above = tube * [0.1, 1e-2, 1e-4, -1e-2, -1e-4][numbers.below(5)];
    (on_surface + normal * above - tangent * far, tangent)
}

/// Checks that every hit is on the surface. Also checks that it is the first root of the quartic,
/// except for grazing lines and origins near the surface, where rounding decides.
fn hits_are_roots<L: SimdFloat>(tube: f64, count: usize) {
    let geometry = geometry::<L>(&torus(tube));
    let mut numbers = Numbers::new(17);
    let rounded =
        |v: DVec3| -> DVec3 { if L::EPSILON > 1e-10 { v.as_vec3().as_dvec3() } else { v } };
    let lines: Vec<Line> = (0..count)
        .map(|_| line(&mut numbers, tube))
        .map(|(o, d)| (rounded(o), rounded(d)))
        .collect();
    let (mut compared, mut seen) = (0, 0);
    for (line, hit) in lines.iter().zip(closest(&geometry, &lines)) {
        // The tested directions are rounded and have unit length only approximately. The
        // intersection code expects unit length.
        let room = 64.0 * L::EPSILON * (1.0 + line.0.length());
        let (coefficients, start) = quartic((line.0, line.1.normalize()), tube);
        let point_at = |s: f64| line.0 + line.1.normalize() * (start + s);
        let derivative: Vec<f64> =
            coefficients.iter().enumerate().skip(1).map(|(i, c)| c * i as f64).collect();
        if let Some(hit) = hit {
            seen += 1;
            let away = height(line.0 + line.1 * hit.t, tube).abs();
            assert!(away <= room, "{tube} {}: {line:?} {hit:?} {away}", L::NAME);
            let on_surface = height(hit.point, tube).abs();
            assert!(on_surface <= 16.0 * L::EPSILON, "{tube} {}: {line:?} {hit:?}", L::NAME);
        }
        // The coefficients of the quartic of a thin tube have a relative error that grows with 1 /
        // tube.
        let margin = room + 1e-13 / tube;
        let unsure =
            roots(&derivative).into_iter().any(|s| height(point_at(s), tube).abs() <= margin)
                || height(line.0, tube).abs() <= margin;
        if unsure {
            continue;
        }
        compared += 1;
        let first = roots(&coefficients).into_iter().find(|s| start + s > 0.0);
        let (Some(first), Some(hit)) = (first, hit) else {
            assert!(first.is_none() && hit.is_none(), "{tube} {}: {line:?} {hit:?}", L::NAME);
            continue;
        };
        let normal = hit.normal.dot(line.1).abs();
        let apart = (hit.t - (start + first)).abs();
        // The root moves by the error of the distance from the surface, divided by the cosine of
        // the angle between line and normal. Near a double root this cosine vanishes, and the root
        // moves at most by the square root of the error.
        let allowed = (2.0 * margin / normal.max(1e-9)).min(8.0 * margin.sqrt());
        assert!(apart <= allowed, "{tube} {}: {line:?} {hit:?} {apart} > {allowed}", L::NAME);
    }
    assert!(compared > count / 3 && seen > count / 4, "{tube} {}: {compared} {seen}", L::NAME);
}

#[test]
fn torus_hits_are_roots_of_the_quartic() {
    for tube in TUBES {
        hits_are_roots::<Single>(tube, 5_000);
        hits_are_roots::<Double>(tube, 5_000);
    }
}

/// Checks that a shadow ray from the inner side of the ring across the hole is occluded by the
/// opposite side.
#[test]
fn torus_casts_shadows_on_itself() {
    let form = torus(0.3);
    assert!(!form.is_convex());
    let inner = DVec3::new(0.7 - 1e-6, 0.0, 0.0);
    let rays =
        [(inner, DVec3::NEG_X), (inner, DVec3::Y), (DVec3::new(1.3 + 1e-6, 0.0, 0.0), DVec3::X)];
    assert_eq!(occluded(&geometry::<Single>(&form), &rays, 10.0), [true, false, false]);
    assert_eq!(occluded(&geometry::<Double>(&form), &rays, 10.0), [true, false, false]);
}

#[test]
fn rays_that_leave_a_torus_do_not_hit_where_they_start() {
    fn check<L: SimdFloat>(tube: f64) {
        let geometry = geometry::<L>(&torus(tube));
        let mut numbers = Numbers::new(9);
        let mut lines = Vec::new();
        for _ in 0..20_000 {
            let turn = numbers.between(0.0, 2.0 * PI);
            let outward = DVec3::new(turn.cos(), 0.0, turn.sin());
            // Start on the outside of the ring, where the torus is convex.
            let tilt = numbers.between(-0.5 * PI, 0.5 * PI);
            let normal = outward * tilt.cos() + DVec3::Y * tilt.sin();
            let tangent = numbers.direction().cross(normal).normalize();
            let rise = [0.0, 1e-4, 1e-2, 0.5][numbers.below(4)];
            let offset = 8.0 * L::EPSILON * (1.0 + tube);
            let start = outward + normal * (tube + offset);
            lines.push((start, (tangent + normal * rise).normalize()));
        }
        for (line, hit) in lines.iter().zip(closest(&geometry, &lines)) {
            let again = hit.is_some_and(|hit| hit.t < 0.1 * tube);
            assert!(!again, "{tube} {}: {line:?} {hit:?}", L::NAME);
        }
    }
    for tube in [0.01, 0.1, 0.4, 1.0] {
        check::<Single>(tube);
        check::<Double>(tube);
    }
}

/// Checks bounds, clearance and normals of a torus under three affine maps. The bounds must touch
/// the image of the surface. The clearance is a lower bound of the distance between a point and the
/// surface and must not exceed it. Normals must exist where rays hit.
#[test]
fn torus_bounds_clearance_and_normals_agree_with_its_points() {
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0);
    let uneven = DVec3::new(1.0, -0.3, 2.5);
    let maps = [
        DAffine3::from_rotation_translation(turn, DVec3::new(3.0, -1.0, 2.0)),
        DAffine3::from_scale_rotation_translation(uneven, turn, DVec3::X),
        DAffine3::from_rotation_translation(turn, DVec3::ZERO) * DAffine3::from_scale(uneven),
    ];
    for map in maps {
        let form = torus(0.3).transformed(&map);
        let points: Vec<DVec3> = (0..400 * 200)
            .map(|i| (f64::from(i % 400) / 400.0, f64::from(i / 400) / 200.0))
            .map(|(u, v)| ((2.0 * PI * u).sin_cos(), (2.0 * PI * v).sin_cos()))
            .map(|((su, cu), (sv, cv))| {
                let outward = DVec3::new(cu, 0.0, su);
                map.transform_point3(outward * (1.0 + 0.3 * cv) + DVec3::Y * (0.3 * sv))
            })
            .collect();
        let (low, high) = form.bounds().unwrap();
        let least = points.iter().copied().reduce(DVec3::min).unwrap();
        let most = points.iter().copied().reduce(DVec3::max).unwrap();
        assert!((least - low).min_element() > -1e-12 && (least - low).max_element() < 2e-3);
        assert!((high - most).min_element() > -1e-12 && (high - most).max_element() < 2e-3);
        let ball = form.bounding_sphere();
        assert!(points.iter().all(|p| p.distance(ball.center) <= ball.radius * (1.0 + 1e-12)));
        for point in points.iter().step_by(997) {
            let normals = form.normals_at(*point, 1e-9);
            assert_eq!(normals.concat().len(), 1, "{point}");
            assert!(form.clearance(*point).unwrap() < 1e-9);
            let aside = *point + normals[0][0] * 0.05;
            let nearest = points.iter().map(|p| p.distance(aside)).fold(f64::INFINITY, f64::min);
            assert!(form.clearance(aside).unwrap() <= nearest * (1.0 + 1e-9));
            assert!(form.normals_at(aside, 1e-3).is_empty());
            let t = form.cast(aside, -normals[0][0]).unwrap();
            assert!((t - 0.05).abs() < 1e-9, "{t}");
        }
    }
}
