//! Rough interfaces: energy, Walter's formula for their BTDF, extreme inputs, and scenes with rough
//! and absorbing glass.

use crate::harness::*;
use crate::lobes::setup::*;
use crate::reference::{facet_density, lambda, reflectance};

fn glossy_lobes() -> impl Iterator<Item = (Lobe, Masking)> {
    every_lobe().into_iter().filter(|(lobe, _)| *lobe != Lobe::Mirror)
}

/// Microfacet distribution by the formulas of the reference tracer.
struct Facets {
    ggx: bool,
    masking: Masking,
    alpha: f64,
}

impl Facets {
    fn g1(&self, nh: f64, nx: f64, xh: f64) -> f64 {
        match self.masking {
            Masking::VCavity => (2.0 * nh * nx / xh).min(1.0),
            Masking::Smith => 1.0 / (1.0 + lambda(self.ggx, self.alpha, nx)),
        }
    }

    fn g2_reflected(&self, nh: f64, nv: f64, nl: f64, vh: f64) -> f64 {
        match self.masking {
            Masking::VCavity => self.g1(nh, nv, vh).min(self.g1(nh, nl, vh)),
            Masking::Smith => {
                1.0 / (1.0 + lambda(self.ggx, self.alpha, nv) + lambda(self.ggx, self.alpha, nl))
            }
        }
    }

    fn g2_transmitted(&self, nh: f64, (nv, vh): (f64, f64), (nt, th): (f64, f64)) -> f64 {
        let (above, below) = (self.g1(nh, nv, vh), self.g1(nh, nt, th));
        match self.masking {
            Masking::VCavity => (above + below - 1.0).max(0.0),
            Masking::Smith => above * below,
        }
    }

    /// Returns the albedos of reflection and transmission by single scattering, by quadrature over
    /// the microfacets' slopes.
    fn albedo(&self, degrees: f64, n_i: f64, n_t: f64) -> [f64; 2] {
        let (sin_v, nv) = degrees.to_radians().sin_cos();
        let (rings, turns) = (300, 120);
        let mut sums = [0.0; 2];
        for i in 0..rings {
            // The slopes are sampled at tan^2 = alpha^2 s / (1 - s) with s = 1 - (1 - q)^2, for
            // evenly spaced q. The square removes the singularity at grazing microfacets.
            let q = (f64::from(i) + 0.5) / f64::from(rings);
            let rest = (1.0 - q) * (1.0 - q);
            let tan2 = self.alpha * self.alpha * (1.0 - rest) / rest;
            let nh = 1.0 / (1.0 + tan2).sqrt();
            let sin_h = (tan2 / (1.0 + tan2)).sqrt();
            // The solid angle is sin dtheta dphi = cos^3 / 2 d(tan^2) dphi.
            let d_tan2 = self.alpha * self.alpha * 2.0 * (1.0 - q) / (rest * rest);
            let d_tan2 = d_tan2 / f64::from(rings);
            let solid_angle = 0.5 * nh.powi(3) * d_tan2 * TAU / f64::from(turns);
            for j in 0..turns {
                let phi = TAU * (f64::from(j) + 0.5) / f64::from(turns);
                let vh = sin_v * sin_h * phi.cos() + nv * nh;
                if vh <= 0.0 {
                    continue;
                }
                let visible = facet_density(self.ggx, self.alpha, nh) * vh / nv * solid_angle;
                let f = reflectance(vh, n_i, n_t);
                let nl = 2.0 * vh * nh - nv;
                if nl > 0.0 {
                    sums[0] += visible * f * self.g2_reflected(nh, nv, nl, vh);
                }
                let ratio = n_i / n_t;
                let cos2_t = 1.0 - ratio * ratio * (1.0 - vh * vh);
                if cos2_t > 0.0 {
                    let th = cos2_t.sqrt();
                    let nt = ratio * nv - (ratio * vh - th) * nh;
                    if nt > 0.0 {
                        sums[1] +=
                            visible * (1.0 - f) * self.g2_transmitted(nh, (nv, vh), (nt, th));
                    }
                }
            }
        }
        sums
    }
}

/// Returns the albedos of reflection and transmission at the angle of incidence `degrees`,
/// estimated as mean weights of `count` sampled pairs of rays.
fn sampled_albedo<L: SimdFloat>(
    (lobe, masking, alpha): (Lobe, Masking, f64),
    degrees: f64,
    sides: Sides,
    count: u32,
) -> [f64; 2] {
    let n = tilted_normal();
    let incident = combine(&[(-1.0, at_angle(n, degrees.to_radians(), 1.0))]);
    let material = rough_glass(lobe, masking, alpha, 1.5);
    let mut sums = [0.0; 2];
    let numbers = Draws::sobol(5);
    each_crossing::<L>(&material, (incident, n), (sides, true), numbers, count, |crossing| {
        let (r, t) = (crossing.reflected.1[0], crossing.transmitted.1);
        assert!(r >= 0.0 && t >= 0.0 && r + t <= 1.0 + 16.0 * L::EPSILON, "{lobe:?}: {r} {t}");
        sums[0] += r / f64::from(count);
        sums[1] += t / f64::from(count);
    });
    sums
}

#[test]
fn rough_glass_has_the_albedo_of_single_scattering() {
    let mut worst = 0f64;
    for (lobe, masking) in glossy_lobes().filter(|(lobe, _)| has_facets(*lobe)) {
        for alpha in [0.05, 0.3, 0.7] {
            for (n_i, n_t) in [(1.0, 1.5), (1.5, 1.0)] {
                for degrees in [0.0, 30.0, 60.0, 80.0] {
                    let facets = Facets { ggx: lobe == Lobe::Ggx, masking, alpha };
                    let known = facets.albedo(degrees, n_i, n_t);
                    let sides = Sides { n_i, n_t, thin: false };
                    let kind = (lobe, masking, alpha);
                    for found in [
                        sampled_albedo::<Double>(kind, degrees, sides, 1 << 14),
                        sampled_albedo::<Single>(kind, degrees, sides, 1 << 14),
                    ] {
                        for (found, known) in found.into_iter().zip(known) {
                            let error = (found - known).abs();
                            worst = worst.max(error);
                            let name = format!("{kind:?} {n_i} {n_t} at {degrees}");
                            assert!(error < 2e-3, "{name}: {found} for {known}");
                        }
                    }
                }
            }
        }
    }
    println!("albedo of rough glass: {worst:.1e} off at most");
}

/// Checks that the lobes `cone` and `square` lose nothing, and that no lobe gains light, whatever
/// the roughness, the angle and the index of refraction.
#[test]
fn rough_glass_conserves_energy_at_extremes() {
    for (lobe, masking) in glossy_lobes() {
        for alpha in [1e-3, 0.1, 1.0, 1e6] {
            for (n_i, n_t) in
                [(1.0, 1.0), (1.0, 1.5), (1.5, 1.0), (1.0, 1e4), (1e4, 1.0), (1.0, 0.1)]
            {
                for thin in [false, true] {
                    for degrees in [0.0, 1e-4, 45.0, 89.0, 89.99, 89.999_999] {
                        let sides = Sides { n_i, n_t, thin };
                        let kind = (lobe, masking, alpha);
                        let sums = [
                            sampled_albedo::<Double>(kind, degrees, sides, 256),
                            sampled_albedo::<Single>(kind, degrees, sides, 256),
                        ];
                        for [r, t] in sums {
                            let name = format!("{kind:?} {sides:?} at {degrees}: {r} + {t}");
                            if has_facets(lobe) {
                                assert!(r + t <= 1.0 + 1e-6, "{name}");
                            } else {
                                assert!((r + t - 1.0).abs() < 1e-6, "{name}");
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Checks transmission at every sampled direction. Weight x density is the cosine times Walter's f
/// (2007, eq. 21) without the factor eta^2 of radiance. Also checks reciprocity: f / n_t^2 stays
/// the same if light and viewer are exchanged.
#[test]
fn closed_form_13_weight_times_density_is_walters_formula() {
    let n = tilted_normal();
    let mut compared = 0;
    for (lobe, masking) in glossy_lobes().filter(|(lobe, _)| has_facets(*lobe)) {
        for alpha in [0.05, 0.3, 1.0] {
            for (n_i, n_t) in [(1.0, 1.5), (1.5, 1.0), (1.33, 2.4)] {
                for degrees in [0.0f64, 30.0, 60.0, 85.0] {
                    let material = rough_glass(lobe, masking, alpha, 1.5);
                    let facets = Facets { ggx: lobe == Lobe::Ggx, masking, alpha };
                    let finish = Bsdf::<f64>::new(&material, true);
                    let v = at_angle(n, degrees.to_radians(), 2.0);
                    let incident = combine(&[(-1.0, v)]);
                    let sides = Sides { n_i, n_t, thin: false };
                    // Returns f for light from `l` in a medium of the index `n_l`, seen from `v` in
                    // a medium of the index `n_v`.
                    let walter = |(v, n_v): (Vector, f64), (l, n_l): (Vector, f64), n: Vector| {
                        let h = combine(&[(-n_v, v), (-n_l, l)]);
                        let h = unit(combine(&[(1f64.copysign(dot(h, n)), h)]));
                        let (nv, nl, nh) = (dot(n, v), -dot(n, l), dot(n, h));
                        let (vh, lh) = (dot(v, h), -dot(l, h));
                        let g = facets.g2_transmitted(nh, (nv, vh), (nl, lh));
                        let below = n_v * vh - n_l * lh;
                        let transmitted = 1.0 - reflectance(vh, n_v, n_l);
                        vh * lh / (nv * nl)
                            * transmitted
                            * g
                            * facet_density(facets.ggx, facets.alpha, nh)
                            * n_l
                            * n_l
                            / (below * below)
                    };
                    let numbers = Draws::sobol(3);
                    let at = (incident, n);
                    each_crossing::<f64>(&material, at, (sides, true), numbers, 200, |crossing| {
                        let (l, weight) = crossing.transmitted;
                        if weight < 1e-9 {
                            return;
                        }
                        let query = sides.query::<f64>(at, false);
                        let density = finish.transmission_pdf(&query, Vec3::of(l));
                        let f = walter((v, n_i), (l, n_t), n);
                        let error = (weight * density / (f * -dot(n, l)) - 1.0).abs();
                        // The directions are rounded, which causes an error of the distribution D
                        // and of the cosines.
                        let limit = 1e-5;
                        let name = format!("{lobe:?} {masking:?} {alpha} {n_i} {n_t} {degrees}");
                        assert!(error < limit, "{name}: {error:.1e}");
                        let back = walter((l, n_t), (v, n_i), combine(&[(-1.0, n)]));
                        let asymmetry = (f / (n_t * n_t) / (back / (n_i * n_i)) - 1.0).abs();
                        assert!(asymmetry < 1e-6, "{name} is not reciprocal: {asymmetry:.1e}");
                        compared += 1;
                    });
                }
            }
        }
    }
    assert!(compared > 20_000, "{compared}");
}

#[test]
fn smooth_glass_is_clear() {
    for (lobe, masking) in every_lobe() {
        let mut material = rough_glass(lobe, masking, 1e-8, 1.5);
        material.roughness = 0.0;
        assert!(Bsdf::<f64>::new(&material, true).is_delta(), "{lobe:?}");
    }
}

/// Checks that the value of an interface in the direction of a sampled ray, divided by the density
/// in this direction, is the weight of the ray.
fn check_evaluation<L: SimdFloat>(tolerance: f64) {
    let sides = [(1.0, 1.5, false), (1.5, 1.0, false), (1.0, 1.5, true), (1.0, 1.0, false)];
    let n = [0.0, 0.0, 1.0];
    let mut compared = 0;
    for (lobe, masking) in glossy_lobes() {
        for (alpha, (n_i, n_t, thin), degrees, fold) in [0.05, 0.3, 1.0]
            .into_iter()
            .flat_map(|alpha| sides.map(|side| (alpha, side)))
            .flat_map(|(alpha, side)| [0.0, 35.0, 80.0].map(|degrees| (alpha, side, degrees)))
            .flat_map(|(alpha, side, degrees)| {
                [false, true].map(|fold| (alpha, side, degrees, fold))
            })
        {
            let bsdf = Bsdf::<L::Scalar>::new(&rough_glass(lobe, masking, alpha, 1.5), true);
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            let query = Sides { n_i, n_t, thin }.query::<L>(([sin, 0.0, -cos], n), fold);
            for i in 0..256 {
                let (u, v) =
                    ((f64::from(i) + 0.5) / 256.0, (f64::from(i) * 0.618_034 + 0.3).fract());
                let uv = (L::from_f64(u), L::from_f64(v));
                let s = bsdf.sample_interface(&query, uv);
                let passed = s.transmitted_weight;
                for (behind, direction, weight) in [
                    (false, s.reflected, s.reflected_weight),
                    (true, s.transmitted, Vec3::new(passed, passed, passed)),
                ] {
                    let BsdfValue { value, density } =
                        bsdf.eval_interface(&query, direction, L::mask(behind));
                    let number = |x: L| x.lane(0).to_f64();
                    let (value, density) = (number(value.x), number(density));
                    let weight = number(weight.x);
                    let name = format!(
                        "{lobe:?} {masking:?}, alpha {alpha}, {n_i} to {n_t}, thin {thin}, \
                         {degrees} degrees, fold {fold}, u {u}, v {v}, behind {behind}"
                    );
                    if behind && n_i == n_t && !thin {
                        assert_eq!((value, density), (0.0, L::MAX), "{name}");
                    } else if weight > 1e-3 {
                        let off = value / density / weight - 1.0;
                        assert!(off.abs() < tolerance, "{name}: {value} / {density}, {weight}");
                        compared += 1;
                    } else if (number(direction.z) > 0.0) == behind {
                        assert_eq!((value, density), (0.0, 0.0), "{name}");
                    }
                }
            }
        }
    }
    assert!(compared > 100_000, "{compared}");
}

#[test]
fn value_of_an_interface_is_weight_times_density() {
    check_evaluation::<Double>(1e-9);
    check_evaluation::<Single>(2e-3);
}
