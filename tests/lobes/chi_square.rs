//! Chi-square tests of sampled directions against the integrated density of their lobe (the tests
//! named `extreme_22_*`).

use crate::harness::*;
use crate::lobes::setup::*;
use crate::lobes::stats::chi_square_p;

const ALPHAS: [f64; 5] = [1e-3, 0.05, 0.3, 1.0, 2.0];
const DEGREES: [f64; 4] = [0.0, 60.0, 85.0, 89.9];
const GRID: [usize; 2] = [12, 18];
/// Number of cells per bin and coordinate in the midpoint rule that integrates densities. A cell
/// has one point, or eight points per coordinate if the density jumps in the cell.
const FINE: usize = 11;
const COUNT: u32 = 40_000;

/// Map between directions and coordinates in [0, 1]^2. The map is fitted to a lobe so that no bin
/// is nearly empty or contains nearly all directions. It follows from geometry alone, without the
/// lobe's density.
struct Chart {
    view: Vector,
    n: Vector,
    spread: ReflectionLobe<f64>,
    /// Interface that the rays are transmitted through; `None` for reflected rays.
    through: Option<Sides>,
    /// Frame of the lobe: two tangents, and the axis. The axis is the surface normal for microfacet
    /// distributions.
    frame: [Vector; 3],
}

impl Chart {
    fn new(view: Vector, n: Vector, spread: ReflectionLobe<f64>, through: Option<Sides>) -> Self {
        let mut chart = Self { view, n, spread, through, frame: [n; 3] };
        chart.frame = match chart.spread {
            ReflectionLobe::Mirror => unreachable!(),
            ReflectionLobe::Cone { .. } => framed(chart.mirror()),
            ReflectionLobe::Square { .. } => chart.square_frame(),
            ReflectionLobe::Microfacet(_) => framed(n),
        };
        chart
    }

    /// Returns two values for a microfacet with the normal `h`: the direction of the reflected or
    /// transmitted ray, and the solid angle of the ray per solid angle of `h`. Returns `None` for
    /// total internal reflection.
    fn leaving(&self, h: Vector) -> Option<(Vector, f64)> {
        let vh = dot(self.view, h);
        let mirror = combine(&[(2.0 * vh, h), (-1.0, self.view)]);
        match self.through {
            None => Some((mirror, 4.0 * vh)),
            Some(Sides { thin: true, .. }) => {
                Some((combine(&[(1.0, mirror), (-2.0 * dot(mirror, self.n), self.n)]), 4.0 * vh))
            }
            Some(Sides { n_i, n_t, .. }) => {
                let ratio = n_i / n_t;
                let cos_t = (1.0 - ratio * ratio * (1.0 - vh * vh)).sqrt();
                let d = combine(&[(-ratio, self.view), (ratio * vh - cos_t, h)]);
                let across = n_i * vh - n_t * cos_t;
                (cos_t > 0.0).then(|| (d, across * across / (n_t * n_t * cos_t)))
            }
        }
    }

    /// Returns the axis of the lobes `cone` and `square`.
    fn mirror(&self) -> Vector {
        match self.through {
            Some(Sides { thin: true, .. }) => combine(&[(-1.0, self.view)]),
            _ => self.leaving(self.n).expect("no total reflection").0,
        }
    }

    /// Returns the normal of the microfacet that reflects or transmits the ray in the direction
    /// `d`.
    fn half(&self, d: Vector) -> Vector {
        let h = match self.through {
            None => combine(&[(1.0, self.view), (1.0, d)]),
            Some(Sides { thin: true, .. }) => {
                combine(&[(1.0, self.view), (1.0, d), (-2.0 * dot(d, self.n), self.n)])
            }
            Some(Sides { n_i, n_t, .. }) => combine(&[(n_i, self.view), (n_t, d)]),
        };
        unit(combine(&[(1f64.copysign(dot(h, self.n)), h)]))
    }

    /// Returns `true` if the transmitted ray of a sample exists: the microfacet does not reflect
    /// totally, and the ray is behind the surface.
    fn exists(&self, crossing: &Crossing) -> bool {
        if !matches!(self.spread, ReflectionLobe::Microfacet(_)) {
            // The density of the lobes `cone` and `square` includes rays in front of the surface.
            return true;
        }
        let h = unit(combine(&[(1.0, self.view), (1.0, crossing.reflected.0)]));
        dot(crossing.transmitted.0, self.n) < 0.0 && self.leaving(h).is_some()
    }

    /// Returns the frame of the square lobe: the directions of its two sides, and its axis.
    fn square_frame(&self) -> [Vector; 3] {
        let frame = Frame::around(Vec3::<f64>::of(self.mirror()));
        [vector(frame.t), vector(frame.b), vector(frame.n)]
    }

    fn coordinates(&self, d: Vector) -> [f64; 2] {
        let revolution = |x: f64, y: f64| (y.atan2(x) / TAU).rem_euclid(1.0);
        match self.spread {
            ReflectionLobe::Mirror => unreachable!(),
            ReflectionLobe::Cone { one_minus_cos, .. } => {
                let [t, b, m] = self.frame;
                let off = combine(&[(1.0, d), (-1.0, m)]);
                [0.5 * dot(off, off) / one_minus_cos, revolution(dot(d, t), dot(d, b))]
            }
            ReflectionLobe::Square { side, .. } => {
                let [t, b, m] = self.frame;
                let z = dot(d, m);
                [dot(d, t) / (z * side) + 0.5, dot(d, b) / (z * side) + 0.5]
            }
            ReflectionLobe::Microfacet(facets) => {
                let h = self.half(d);
                let [t, b, _] = self.frame;
                let z = dot(h, self.n);
                if z <= 0.0 {
                    return [f64::NAN; 2];
                }
                let (x, y) = (dot(h, t) / (z * facets.alpha), dot(h, b) / (z * facets.alpha));
                [1.0 - 1.0 / (1.0 + x * x + y * y).sqrt(), revolution(x, y)]
            }
        }
    }

    /// Returns the direction at the coordinates `p` and `q`. Also returns the solid angle per unit
    /// area of the coordinates there, in steradians.
    fn direction(&self, [p, q]: [f64; 2]) -> (Vector, f64) {
        let (sin, cos) = (TAU * q).sin_cos();
        match self.spread {
            ReflectionLobe::Mirror => unreachable!(),
            ReflectionLobe::Cone { one_minus_cos, .. } => {
                let [t, b, m] = self.frame;
                let drop = p * one_minus_cos;
                let s = (drop * (2.0 - drop)).sqrt();
                let d = combine(&[(1.0 - drop, m), (s * cos, t), (s * sin, b)]);
                (d, TAU * one_minus_cos)
            }
            ReflectionLobe::Square { side, .. } => {
                let [t, b, m] = self.frame;
                let d = unit(combine(&[(1.0, m), ((p - 0.5) * side, t), ((q - 0.5) * side, b)]));
                (d, side * side * dot(d, m).powi(3))
            }
            ReflectionLobe::Microfacet(facets) => {
                let [t, b, _] = self.frame;
                let r = facets.alpha * ((1.0 / (1.0 - p)).powi(2) - 1.0).sqrt();
                let h = unit(combine(&[(1.0, self.n), (r * cos, t), (r * sin, b)]));
                let vh = dot(self.view, h);
                let Some((d, per_facet)) = self.leaving(h).filter(|_| vh > 0.0) else {
                    return (self.n, 0.0);
                };
                if self.through.is_some() && dot(d, self.n) >= 0.0 {
                    return (d, 0.0);
                }
                // If r is the slope divided by alpha, an area dp dq covers alpha^2 pi d(r^2) dq in
                // slope space. Here d(r^2) is 2 dp / (1 - p)^3. The solid angle of facet normals
                // per area in slope space is cos^3.
                let slopes = facets.alpha.powi(2) * PI * 2.0 / (1.0 - p).powi(3);
                (d, per_facet * dot(h, self.n).powi(3) * slopes)
            }
        }
    }
}

fn framed(axis: Vector) -> [Vector; 3] {
    let [t, b] = across(axis);
    [t, b, axis]
}

/// Returns the expected fraction of directions in each bin of the chart, from the density of
/// `material`. The last value is the fraction outside of all bins.
fn expected(chart: &Chart, material: &Material) -> Vec<f64> {
    let finish = Bsdf::<f64>::new(material, true);
    let at = (combine(&[(-1.0, chart.view)]), chart.n);
    let [w, h] = GRID.map(|g| g * FINE);
    let mut shares = vec![0.0; GRID[0] * GRID[1] + 1];
    let flow = |p: f64, q: f64| {
        let (d, solid_angle) = chart.direction([p / w as f64, q / h as f64]);
        if solid_angle <= 0.0 {
            return 0.0;
        }
        let density = match chart.through {
            None => finish.pdf(&query::<f64>(at, false), Vec3::of(d)),
            Some(sides) => finish.transmission_pdf(&sides.query::<f64>(at, false), Vec3::of(d)),
        };
        density * solid_angle / (w * h) as f64
    };
    // Facets that face away from the viewer reflect nothing. The density jumps at the boundary of
    // the visible facets.
    let visible = |i: usize, j: usize| {
        let p = (i as f64).min(w as f64 - 1e-6);
        chart.direction([p / w as f64, j as f64 / h as f64]).1 > 0.0
    };
    let corners: Vec<bool> =
        (0..=w).flat_map(|i| (0..=h).map(move |j| (i, j))).map(|(i, j)| visible(i, j)).collect();
    for i in 0..w {
        for j in 0..h {
            let at = i * (h + 1) + j;
            let seen = [at, at + 1, at + h + 1, at + h + 2].iter().filter(|c| corners[**c]).count();
            let parts = if seen == 0 || seen == 4 { 1 } else { 8 };
            let middle = |k: usize| (k as f64 + 0.5) / parts as f64;
            let sum: f64 = (0..parts * parts)
                .map(|k| flow(i as f64 + middle(k / parts), j as f64 + middle(k % parts)))
                .sum();
            shares[i / FINE * GRID[1] + j / FINE] += sum / (parts * parts) as f64;
        }
    }
    let total: f64 = shares.iter().sum();
    assert!(total < 1.0 + 1e-3, "a density of {total}");
    *shares.last_mut().unwrap() = (1.0 - total).max(0.0);
    shares
}

/// Returns the chart for a lobe that is seen at the angle `degrees`, and the expected fraction of
/// directions in each bin. `through` is the interface of transmitted rays; it is `None` for
/// reflected ones.
fn expectation(material: &Material, degrees: f64, through: Option<Sides>) -> (Chart, Vec<f64>) {
    let n = tilted_normal();
    let view = at_angle(n, degrees.to_radians(), 0.7);
    let spread = Bsdf::<f64>::new(material, true).lobe;
    let chart = Chart::new(view, n, spread, through);
    let shares = expected(&chart, material);
    (chart, shares)
}

/// Returns the p-value of a chi-square test: directions sampled from the material `drawn`, counted
/// in the bins of `chart`, against the expected fractions `shares`.
fn p_value<L: SimdFloat>(drawn: &Material, (chart, shares): &(Chart, Vec<f64>), seed: u64) -> f64 {
    let (view, n) = (chart.view, chart.n);
    let mut counts = vec![0u64; shares.len()];
    let incident = combine(&[(-1.0, view)]);
    let mut take = |d: Option<Vector>| {
        let at = d.map_or([f64::NAN; 2], |d| chart.coordinates(d));
        // Samples at the rim of the lobes `cone` and `square` may be outside of all bins by a
        // rounding error.
        let bin = |x: f64, n: usize| {
            let inside = x > -1e-4 && x < 1.0 + 1e-4;
            inside.then(|| ((x * n as f64) as usize).min(n - 1))
        };
        match (bin(at[0], GRID[0]), bin(at[1], GRID[1])) {
            (Some(i), Some(j)) => counts[i * GRID[1] + j] += 1,
            _ => *counts.last_mut().unwrap() += 1,
        }
    };
    let (at, numbers) = ((incident, n), Draws::random(seed));
    match chart.through {
        None => each_reflection::<L>(drawn, at, false, numbers, COUNT, |d, _| take(Some(d))),
        Some(sides) => each_crossing::<L>(drawn, at, (sides, false), numbers, COUNT, |crossing| {
            take(chart.exists(&crossing).then_some(crossing.transmitted.0));
        }),
    }
    let total = f64::from(COUNT.next_multiple_of(L::WIDTH as u32));
    let expected: Vec<f64> = shares.iter().map(|s| s * total).collect();
    chi_square_p(&counts, &expected)
}

/// Case of the test: material, angle of the view in degrees, and interface of transmitted rays.
type Case = (Material, f64, Option<Sides>);

/// Returns the cases of reflection: every lobe with every masking, at every alpha and angle.
fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (lobe, masking) in every_lobe().into_iter().filter(|(l, _)| *l != Lobe::Mirror) {
        for alpha in ALPHAS {
            for degrees in DEGREES {
                let roughness = alpha * 8f64.sqrt();
                let mut material = reflector(lobe, masking, roughness);
                material.alpha = Some(alpha);
                cases.push((material, degrees, None));
            }
        }
    }
    cases
}

/// Returns the cases of transmission: every lobe with every masking, for light that enters glass,
/// leaves glass, or crosses a pane.
fn transmitted_cases() -> Vec<Case> {
    let mut cases = Vec::new();
    let sides = [(1.0, 1.5, false), (1.5, 1.0, false), (1.0, 1.5, true)];
    for (lobe, masking) in every_lobe().into_iter().filter(|(l, _)| *l != Lobe::Mirror) {
        for alpha in [1e-3, 0.05, 0.3, 1.0] {
            for (n_i, n_t, thin) in sides {
                for degrees in [0.0, 35.0, 80.0] {
                    // Skipped: the axis of the lobe is beyond the critical angle, and nearly all
                    // microfacets of a smooth surface reflect totally.
                    if n_i > n_t && degrees > 40.0 && (!has_facets(lobe) || alpha < 0.1) {
                        continue;
                    }
                    let sides = Sides { n_i, n_t, thin };
                    cases.push((rough_glass(lobe, masking, alpha, 1.5), degrees, Some(sides)));
                }
            }
        }
    }
    cases
}

/// Checks `cases` in packets of double precision, and in single precision those that it `resolves`.
/// The directions of single lanes have the same bits.
fn check_cases(cases: &[Case], resolves: fn(&Case) -> bool) {
    let mut values = [Vec::new(), Vec::new()];
    for (i, case) in cases.iter().enumerate() {
        let (material, degrees, through) = case;
        let claim = expectation(material, *degrees, *through);
        values[0].push((p_value::<Double>(material, &claim, i as u64), case));
        if resolves(case) {
            values[1].push((p_value::<Single>(material, &claim, i as u64), case));
        }
    }
    for (precision, values) in [precision::<Double>(), precision::<Single>()].iter().zip(values) {
        let level = 0.01 / values.len() as f64;
        let wrong: Vec<_> = values.iter().filter(|(p, _)| p.is_nan() || *p <= level).collect();
        assert!(wrong.is_empty(), "{precision}: {wrong:#?}");
        let least = values.iter().map(|(p, _)| *p).fold(1.0, f64::min);
        report(22, precision, &format!("{} tests, least p = {least:.0e}", values.len()));
    }
}

/// Checks reflected directions. At 89.9 degrees a half vector has an error of 2e-5 in single
/// precision. This is a fiftieth of the smallest alpha, and of the width of the bins for this alpha.
/// The error is negligible if alpha is at least 0.05, or if the angle is at most 60 degrees.
#[test]
fn extreme_22_chi_square() {
    check_cases(&cases(), |(m, degrees, _)| m.alpha > Some(0.01) || *degrees <= 60.0);
}

/// Checks transmitted directions. At alpha 0.001 the errors of half vectors in single precision are
/// as large as bins.
#[test]
fn transmitted_directions_have_the_stated_density() {
    check_cases(&transmitted_cases(), |(m, ..)| m.alpha > Some(0.01));
}

/// Checks the power of the test: in every lobe it rejects sampled directions if the expected
/// fractions are those of an alpha that is 5 % larger.
#[test]
fn chi_square_rejects_wrong_alpha() {
    for (material, degrees, through) in cases().into_iter().chain(transmitted_cases()) {
        if material.alpha != Some(0.3) || degrees > 60.0 {
            continue;
        }
        let wider = Material {
            alpha: material.alpha.map(|a| a * 1.05),
            roughness: material.roughness * 1.05,
            ..material.clone()
        };
        let p = p_value::<Double>(&material, &expectation(&wider, degrees, through), 77);
        println!("{:?} {degrees} {through:?}: {p:.0e}", material.lobe);
        assert!(p < 1e-4, "{:?} {degrees} {through:?}: {p}", material.lobe);
    }
}
