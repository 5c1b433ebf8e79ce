//! Fractions of lobes inside a half-space: closed forms against sampled directions.

use crate::harness::*;
use crate::lobes::setup::*;
use crate::lobes::stats::slope;
use std::f64::consts::FRAC_PI_2;
use zerkalo_kernel::sampling::warp;

/// Returns the fraction of a uniform cone of half-angle `theta` in a half-space whose boundary
/// contains the apex. `delta` is the angle of the axis to the boundary; if it is positive, the axis
/// is inside.
///
/// For |delta| < theta < pi / 2 the fraction is [pi - acos(sin delta / sin theta) - cos theta
/// acos(-tan delta / tan theta)] / [pi (1 - cos theta)]. For very narrow cones this difference
/// loses digits by cancellation. The function then returns the fraction of a flat disc, which is
/// equal within theta^2 / 20.
pub fn cone_share(theta: f64, delta: f64) -> f64 {
    if delta.abs() >= theta {
        return if delta > 0.0 { 1.0 } else { 0.0 };
    }
    if theta < 1e-3 {
        return disc_share(theta.tan(), delta.tan());
    }
    let a = (delta.sin() / theta.sin()).acos();
    let b = (-delta.tan() / theta.tan()).acos();
    (PI - a - theta.cos() * b) / (PI * 2.0 * (0.5 * theta).sin().powi(2))
}

/// Returns the fraction of a disc of radius `r` that is inside a straight edge at distance `d` from
/// the disc's centre: 1/2 + (d sqrt(r^2 - d^2) + r^2 asin(d / r)) / (pi r^2). If `d` is positive,
/// the centre is inside.
fn disc_share(r: f64, d: f64) -> f64 {
    let d = (d / r).clamp(-1.0, 1.0);
    0.5 + (d * (1.0 - d * d).sqrt() + d.asin()) / PI
}

/// Returns the fraction of a square that is inside a straight edge in the square's plane. `side` is
/// the length of the square's sides, `d` the distance of the edge from the square's centre, and
/// `phi` the angle between the edge's normal and a side. If `d` is positive, the centre is inside.
pub fn square_share(side: f64, d: f64, phi: f64) -> f64 {
    let h = 0.5 * side;
    let (c, s) = (phi.cos().abs(), phi.sin().abs());
    let (u1, u2) = (h * (c + s), h * (c - s).abs());
    if d.abs() <= u2 {
        0.5 + d / (2.0 * h * c.max(s))
    } else if d <= -u1 {
        0.0
    } else if d < 0.0 {
        (d + u1).powi(2) / (8.0 * h * h * c * s)
    } else {
        1.0 - square_share(side, -d, phi)
    }
}

/// Half-space that cuts a lobe whose axis is the surface normal: the inward normal of the
/// half-space, and the fraction of the lobe inside it.
struct Edge {
    inward: Vector,
    share: f64,
}

fn edge(spread: &ReflectionLobe<f64>, n: Vector, theta: f64, delta: f64, phi: f64) -> Edge {
    let (frame, share) = match spread {
        ReflectionLobe::Square { side } => {
            let frame = Frame::around(Vec3::<f64>::of(n));
            ([vector(frame.t), vector(frame.b)], square_share(*side, delta.tan(), phi))
        }
        _ => (across(n), cone_share(theta, delta)),
    };
    let e = combine(&[(phi.cos(), frame[0]), (phi.sin(), frame[1])]);
    Edge { inward: combine(&[(delta.sin(), n), (delta.cos(), e)]), share }
}

/// Returns `count` half-spaces of different orientations, spread evenly by a two-dimensional golden
/// ratio sequence. `reach` is the largest angle between the lobe's axis and its directions, and
/// `theta` the half-angle of a cone lobe, both in radians.
fn edges(spread: &ReflectionLobe<f64>, n: Vector, theta: f64, reach: f64, count: u32) -> Vec<Edge> {
    (0..count)
        .map(|i| {
            let (a, b) = (f64::from(i) * 0.754_877_666 % 1.0, f64::from(i) * 0.569_840_29 % 1.0);
            edge(spread, n, theta, (2.0 * a - 1.0) * 0.98 * reach, b * 2.0 * PI)
        })
        .collect()
}

/// Returns the half-angles of the tested cones in radians.
fn half_angles() -> [f64; 7] {
    [1e-6, 1e-4, 1e-2, 0.1, 0.6, 1.3, FRAC_PI_2 - 1e-6]
}

/// Counts the sampled directions of a lobe that are inside each half-space of `edges`. Returns the
/// largest deviation of the counted fraction from the closed form, in standard deviations of the
/// count.
fn worst_z<L: SimdFloat>(lobe: Lobe, roughness: f64, n: Vector, edges: &[Edge]) -> f64 {
    let material = reflector(lobe, Masking::VCavity, roughness);
    let count = 40_000;
    let mut inside = vec![0u32; edges.len()];
    let incident = combine(&[(-1.0, n)]);
    each_reflection::<L>(&material, (incident, n), true, Draws::random(11), count, |d, _| {
        for (edge, inside) in edges.iter().zip(&mut inside) {
            *inside += u32::from(dot(d, edge.inward) > 0.0);
        }
    });
    let z = |(edge, inside): (&Edge, &u32)| {
        let count = f64::from(count);
        let variance = (edge.share * (1.0 - edge.share) / count).max(1.0 / count / count);
        (f64::from(*inside) / count - edge.share).abs() / variance.sqrt()
    };
    edges.iter().zip(&inside).map(z).fold(0.0, f64::max)
}

/// Estimates the fraction of a lobe that is inside each half-space of `edges`. Each estimate uses
/// its own set of `count` Sobol points. Returns the root mean square error against the closed
/// forms.
fn rmse(lobe: Lobe, roughness: f64, n: Vector, edges: &[Edge], count: u32) -> f64 {
    let material = reflector(lobe, Masking::VCavity, roughness);
    let incident = combine(&[(-1.0, n)]);
    let mut sum = 0.0;
    for (i, edge) in edges.iter().enumerate() {
        let mut inside = 0u32;
        let numbers = Draws { pixel: (i as u32, 7), ..Draws::sobol(5) };
        each_reflection::<Double>(&material, (incident, n), true, numbers, count, |d, _| {
            inside += u32::from(dot(d, edge.inward) > 0.0);
        });
        sum += (f64::from(inside) / f64::from(count) - edge.share).powi(2);
    }
    (sum / edges.len() as f64).sqrt()
}

fn rmse_slope(lobe: Lobe, roughness: f64, edges: &[Edge]) -> f64 {
    let n = tilted_normal();
    let point = |k: i32| {
        let error = rmse(lobe, roughness, n, edges, 1 << k);
        (f64::from(k), error.log2())
    };
    slope(&(4..=10).map(point).collect::<Vec<_>>())
}

fn spread_of(lobe: Lobe, roughness: f64) -> ReflectionLobe<f64> {
    let material = reflector(lobe, Masking::VCavity, roughness);
    Bsdf::new(&material, true).reflection.unwrap().1
}

/// Checks the fraction of a cone lobe in a half-space for all half-angles and in both precisions.
/// In single precision, rounding rotates a direction by up to 6e-8. This changes the fraction by a
/// few millionths at the half-angle 0.01. For narrower cones the rounding of the rotated axis
/// limits the precision. They are tested with a normal along z only, which is exact.
#[test]
fn extreme_19_cone_in_a_half_space() {
    let mut worst = [0f64; 2];
    for theta in half_angles() {
        let roughness = theta.tan().min(1e6);
        let spread = spread_of(Lobe::Cone, roughness);
        let n = tilted_normal();
        let all = edges(&spread, n, theta, theta, 60);
        let z = worst_z::<f64>(Lobe::Cone, roughness, n, &all);
        assert!(z < 4.0, "double, {theta}: {z} sigma");
        let z = worst_z::<Double>(Lobe::Cone, roughness, n, &all);
        assert!(z < 4.0, "double lanes, {theta}: {z} sigma");
        worst[0] = worst[0].max(z);
        let n = if theta < 1e-2 { [0.0, 0.0, 1.0] } else { n };
        let all = edges(&spread, n, theta, theta, 60);
        let z = worst_z::<Single>(Lobe::Cone, roughness, n, &all);
        assert!(z < 4.0, "single lanes, {theta}: {z} sigma");
        worst[1] = worst[1].max(z);
    }
    report(19, "double", &format!("{:.1} sigma at most", worst[0]));
    report(19, "single", &format!("{:.1} sigma at most", worst[1]));
}

#[test]
fn extreme_19_the_error_falls_faster_than_that_of_random_numbers() {
    let mut flattest = f64::NEG_INFINITY;
    for theta in half_angles() {
        let roughness = theta.tan().min(1e6);
        let spread = spread_of(Lobe::Cone, roughness);
        let all = edges(&spread, tilted_normal(), theta, theta, 300);
        let slope = rmse_slope(Lobe::Cone, roughness, &all);
        assert!(slope <= -0.7, "{theta}: {slope}");
        flattest = flattest.max(slope);
    }
    report(19, "double", &format!("slope {flattest:.2} or steeper"));
}

/// Checks that the fraction of a narrow cone in a half-space differs from that of a flat disc by at
/// most theta^2 / 18.
#[test]
fn closed_form_04_the_narrow_cone_is_a_disc() {
    for theta in [2e-3, 1e-2, 0.1] {
        for i in -20..=20 {
            let delta = theta * f64::from(i) / 20.5;
            let difference = cone_share(theta, delta) - disc_share(theta.tan(), delta.tan());
            assert!(difference.abs() < theta * theta / 18.0, "{theta} {delta}: {difference}");
        }
    }
}

/// Returns half the diagonal of the square lobe as an angle in radians.
fn square_reach(roughness: f64) -> f64 {
    (roughness * (0.5 * PI).sqrt()).atan()
}

#[test]
fn extreme_20_square_in_a_half_space() {
    let mut worst = [0f64; 2];
    for roughness in [1e-6, 1e-3, 0.05, 0.3, 2.0, 100.0] {
        let spread = spread_of(Lobe::Square, roughness);
        let reach = square_reach(roughness);
        let n = tilted_normal();
        let all = edges(&spread, n, reach, reach, 60);
        let z = worst_z::<Double>(Lobe::Square, roughness, n, &all);
        assert!(z < 4.0, "double, {roughness}: {z} sigma");
        worst[0] = worst[0].max(z);
        let n = if roughness < 1e-2 { [0.0, 0.0, 1.0] } else { n };
        let all = edges(&spread, n, reach, reach, 60);
        let z = worst_z::<Single>(Lobe::Square, roughness, n, &all);
        assert!(z < 4.0, "single, {roughness}: {z} sigma");
        worst[1] = worst[1].max(z);
        let all = edges(&spread, tilted_normal(), reach, reach, 300);
        let slope = rmse_slope(Lobe::Square, roughness, &all);
        assert!(slope <= -0.7, "{roughness}: {slope}");
    }
    report(20, "double", &format!("{:.1} sigma at most", worst[0]));
    report(20, "single", &format!("{:.1} sigma at most", worst[1]));
}

/// Checks the density 1 / (side^2 cos^3) of directions to a uniform point of the square at unit
/// distance. Here cos is the cosine of the angle to the square's axis. The density must integrate
/// to 1 and be larger towards the corners than in the middle.
#[test]
fn closed_form_05_density_of_the_square() {
    for side in [0.01, 0.5, 3.0] {
        let (steps, mut sum) = (600, 0.0);
        let half = 1.02 * (0.5 * side * 2f64.sqrt()).atan();
        for i in 0..steps {
            let theta = half * (f64::from(i) + 0.5) / f64::from(steps);
            for j in 0..steps {
                let (s, c) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps)).sin_cos();
                let d = [theta.sin() * c, theta.sin() * s, theta.cos()];
                sum += warp::square_pdf(Vec3::of(d), side) * theta.sin();
            }
        }
        let integral = sum * half * 2.0 * PI / f64::from(steps * steps);
        assert!((integral - 1.0).abs() < 2e-3, "{side}: {integral}");
        let corner = warp::square_pdf(warp::square(0.999, 0.999, side), side);
        let middle = warp::square_pdf(Vec3::of([0.0, 0.0, 1.0]), side);
        let expected = (1.0 + 2.0 * (0.499 * side).powi(2)).powf(1.5);
        assert!((corner / middle / expected - 1.0).abs() < 1e-12);
    }
}

/// Compares two lobes by the fraction of each that is inside a straight edge. Returns the largest
/// difference of the two fractions over many edges. The lobes are a square of the side `side` and a
/// cone with tan theta = 0.2.
fn largest_difference(side: f64) -> f64 {
    let theta = 0.2f64.atan();
    let mut largest: f64 = 0.0;
    for i in 0..=90 {
        for j in -400..=400 {
            let (phi, d) = (f64::from(i).to_radians() * 0.5, f64::from(j) * 1e-3);
            let difference = square_share(side, d, phi) - cone_share(theta, d.atan());
            largest = largest.max(difference.abs());
        }
    }
    largest
}

/// Compares square lobes of four sizes with the cone lobe of radius 0.2, by the largest difference
/// between the fractions inside a straight edge. The square with the area of the cone differs
/// least. The expected differences are computed for a flat disc instead of the cone, and rounded.
/// With the cone, the differences change by at most 0.0025.
#[test]
fn closed_form_06_the_square_of_equal_area_is_nearest_to_the_cone() {
    let r = 0.2;
    for (name, side, known) in [
        ("inscribed", 2f64.sqrt() * r, 0.090),
        ("circumscribed", 2.0 * r, 0.058),
        ("equal variance", 3f64.sqrt() * r, 0.028),
        ("equal area", PI.sqrt() * r, 0.023),
    ] {
        let found = largest_difference(side);
        assert!((found - known).abs() < 2.5e-3, "{name}: {found}");
    }
    let ReflectionLobe::Square { side } = spread_of(Lobe::Square, r) else { panic!() };
    assert!((side - PI.sqrt() * r).abs() < 1e-15);
}

/// Compares the square lobe and the cone lobe by sampled directions. The fraction of each lobe that
/// is inside a straight edge is estimated with 65,536 Sobol points.
#[test]
fn closed_form_06_the_lobes_differ_as_their_formulas_do() {
    let (r, n) = (0.2f64, tilted_normal());
    let square = spread_of(Lobe::Square, r);
    let mut largest: f64 = 0.0;
    for phi in [0.0, 0.2, 0.5, PI / 4.0] {
        for i in -12..=12 {
            let delta = (f64::from(i) * 0.02).atan();
            let at = edge(&square, n, 0.0, delta, phi);
            let response = |lobe| {
                let (mut inside, count) = (0u32, 1 << 16);
                let material = reflector(lobe, Masking::VCavity, r);
                let (numbers, incident) = (Draws::sobol(2), combine(&[(-1.0, n)]));
                each_reflection::<Double>(
                    &material,
                    (incident, n),
                    true,
                    numbers,
                    count,
                    |d, _| {
                        inside += u32::from(dot(d, at.inward) > 0.0);
                    },
                );
                f64::from(inside) / f64::from(count)
            };
            let (cone, square) = (response(Lobe::Cone), response(Lobe::Square));
            let name = format!("edge {phi} {delta}");
            assert!((cone - cone_share(r.atan(), delta)).abs() < 1e-3, "{name}: cone {cone}");
            assert!((square - at.share).abs() < 1e-3, "{name}: {square} for {}", at.share);
            largest = largest.max((cone - square).abs());
        }
    }
    assert!((0.020..0.025).contains(&largest), "{largest}");
}

/// Checks a lobe about half of which is below the surface, because it is seen at 89.999 degrees. If
/// directions below the horizon are mirrored up, the lobe keeps all light. If they are absorbed, it
/// loses the fraction that the closed form gives.
#[test]
fn extreme_21_lobe_at_the_horizon() {
    horizon::<f64>(1e-12);
    horizon::<Double>(1e-12);
    horizon::<Single>(1e-6);
}

fn horizon<L: SimdFloat>(tolerance: f64) {
    let (rho, degrees) = (0.7, 89.999f64);
    let (mut worst, mut worst_z) = (0f64, 0f64);
    let delta = (90.0 - degrees).to_radians();
    let n = tilted_normal();
    for phi in [0.1, 1.0, 2.0, 4.5] {
        let view = at_angle(n, degrees.to_radians(), phi);
        let incident = combine(&[(-1.0, view)]);
        let mirror = combine(&[(1.0, incident), (2.0 * dot(view, n), n)]);
        for (lobe, roughness) in
            [Lobe::Cone, Lobe::Square].into_iter().flat_map(|l| [0.001, 0.1, 1.5].map(|r| (l, r)))
        {
            let mut material = reflector(lobe, Masking::VCavity, roughness);
            material.reflection = rho;
            let share = match spread_of(lobe, roughness) {
                ReflectionLobe::Square { side } => {
                    // The sides of the square are those of the frame that the program computes
                    // about the mirror direction.
                    let kernel = Vec3::<L>::of(incident).reflect(Vec3::of(n)).normalize();
                    let frame = Frame::around(kernel);
                    let up = [frame.t, frame.b].map(|v| dot(v.lane(0).map(Float::to_f64), n));
                    square_share(side, delta.tan(), up[1].atan2(up[0]))
                }
                _ => cone_share(roughness.atan(), delta),
            };
            let count = 1 << 16;
            for fold in [true, false] {
                let (mut sum, mut under) = (0.0, 0);
                let numbers = Draws::random(21);
                each_reflection::<L>(&material, (incident, n), fold, numbers, count, |d, w| {
                    sum += w[0];
                    under += u32::from(w[0] > 0.0 && dot(d, n) < -2.0 * L::EPSILON);
                });
                let mean = sum / f64::from(count);
                let name = format!("{} {lobe:?} {roughness} fold {fold} phi {phi}", L::NAME);
                assert_eq!(under, 0, "{name}");
                if fold {
                    assert!((mean - rho).abs() <= tolerance, "{name}: {mean}");
                    worst = worst.max((mean - rho).abs());
                } else {
                    let sigma = rho * (share * (1.0 - share) / f64::from(count)).sqrt();
                    let z = (mean - rho * share).abs() / sigma;
                    assert!(z < 4.0, "{name}: {mean} for {}, {z} sigma", rho * share);
                    worst_z = worst_z.max(z);
                }
            }
            assert!((dot(mirror, n) - delta.sin()).abs() < 1e-12);
        }
    }
    if L::WIDTH > 1 {
        let words = format!("folded {worst:.0e} off, absorbed {worst_z:.1} sigma at most");
        report(21, precision::<L>(), &words);
    }
}
