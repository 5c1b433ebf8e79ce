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
        ReflectionLobe::Square { side, .. } => {
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
    Bsdf::new(&material, true).lobe
}

/// Checks the fraction of a lobe in half-spaces in both precisions, and that its error falls faster
/// than that of random numbers. Each of `cases` is the roughness of the lobe and the largest angle
/// between its axis and its directions. In single precision, rounding rotates a direction by up to
/// 6e-8. This changes the fraction by a few millionths at the half-angle 0.01. For narrower lobes
/// the rounding of the rotated axis limits the precision. They are tested with a normal along z
/// only, which is exact.
fn check_half_spaces(number: usize, lobe: Lobe, cases: impl IntoIterator<Item = (f64, f64)>) {
    let (mut worst, mut flattest) = ([0f64; 2], f64::NEG_INFINITY);
    for (roughness, reach) in cases {
        let spread = spread_of(lobe, roughness);
        let n = tilted_normal();
        let all = edges(&spread, n, reach, reach, 60);
        worst[0] = worst[0].max(worst_z::<Double>(lobe, roughness, n, &all));
        let z_axis = if roughness < 1e-2 { [0.0, 0.0, 1.0] } else { n };
        let all = edges(&spread, z_axis, reach, reach, 60);
        worst[1] = worst[1].max(worst_z::<Single>(lobe, roughness, z_axis, &all));
        assert!(worst.iter().all(|z| *z < 4.0), "{lobe:?} {roughness}: {worst:?} sigma");
        let slope = rmse_slope(lobe, roughness, &edges(&spread, n, reach, reach, 300));
        assert!(slope <= -0.7, "{lobe:?} {roughness}: {slope}");
        flattest = flattest.max(slope);
    }
    report(number, "double", &format!("{:.1} sigma at most", worst[0]));
    report(number, "single", &format!("{:.1} sigma at most", worst[1]));
    report(number, "double", &format!("slope {flattest:.2} or steeper"));
}

#[test]
fn extreme_19_cone_in_a_half_space() {
    let half_angles = [1e-6, 1e-4, 1e-2, 0.1, 0.6, 1.3, FRAC_PI_2 - 1e-6];
    check_half_spaces(19, Lobe::Cone, half_angles.map(|theta| (theta.tan().min(1e6), theta)));
}

#[test]
fn extreme_20_square_in_a_half_space() {
    // The reach is half the diagonal of the square.
    let reach = |roughness: f64| (roughness * (0.5 * PI).sqrt()).atan();
    let cases = [1e-6, 1e-3, 0.05, 0.3, 2.0, 100.0].map(|roughness| (roughness, reach(roughness)));
    check_half_spaces(20, Lobe::Square, cases);
}

/// Checks the density 1 / (side^2 cos^3) of directions to a uniform point of the square at unit
/// distance. Here cos is the cosine of the angle to the square's axis. The density must integrate
/// to 1 and be larger towards the corners than in the middle. The square has the area of a cone lobe
/// of the same roughness at unit distance.
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
    let ReflectionLobe::Square { side, .. } = spread_of(Lobe::Square, 0.2) else { panic!() };
    assert!((side - PI.sqrt() * 0.2).abs() < 1e-15);
}

/// Checks a lobe about half of which is below the surface, because it is seen at 89.999 degrees. If
/// directions below the horizon are mirrored up, the lobe keeps all light. If they are absorbed, it
/// loses the fraction that the closed form gives.
#[test]
fn extreme_21_lobe_at_the_horizon() {
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
                ReflectionLobe::Square { side, .. } => {
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
    let words = format!("folded {worst:.0e} off, absorbed {worst_z:.1} sigma at most");
    report(21, precision::<L>(), &words);
}
