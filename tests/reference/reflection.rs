//! Surface reflection of the reference tracer. It is an independent, slow implementation that
//! evaluates the formulas literally. The program's reflection is compared with its results.

use crate::harness::*;
use crate::reference::tracer::Mutation;

/// Roughness alpha of microfacets below which surfaces are treated as mirrors. Highlights are
/// computed with at least this alpha.
const SMOOTHEST: f64 = 1e-3;

/// Returns the Fresnel reflectance. `c` is the cosine of the angle between the direction to the
/// light and the microfacet normal.
pub fn fresnel(material: &Material, c: f64) -> DVec3 {
    let channel = |f0: f64| match material.fresnel_mode() {
        Fresnel::Constant => f0,
        Fresnel::Schlick => f0 + (1.0 - f0) * (1.0 - c).powi(5),
        Fresnel::Exact if f0 >= 1.0 => 1.0,
        Fresnel::Exact | Fresnel::Dielectric => {
            // Mean of both polarisations (Fresnel), for light from vacuum.
            let n = match material.fresnel_mode() {
                Fresnel::Dielectric => material.ior,
                _ => (1.0 + f0.sqrt()) / (1.0 - f0.sqrt()),
            };
            let sin_t = (1.0 - c * c).max(0.0).sqrt() / n;
            let t = (1.0 - sin_t * sin_t).max(0.0).sqrt();
            let s = ((c - n * t) / (c + n * t)).powi(2);
            let p = ((n * c - t) / (n * c + t)).powi(2);
            0.5 * (s + p)
        }
    };
    DVec3::from(material.f0().0.map(channel))
}

/// Returns the density D of microfacet normals: GGX if `ggx` is `true`, otherwise Beckmann. `c` is
/// the cosine of the angle between the microfacet normal and the surface normal.
pub fn facet_density(ggx: bool, alpha: f64, c: f64) -> f64 {
    let tan2 = (1.0 - c * c).max(0.0) / (c * c);
    let shape =
        if ggx { (1.0 + tan2 / (alpha * alpha)).powi(-2) } else { (-tan2 / (alpha * alpha)).exp() };
    shape / (PI * alpha * alpha * c.powi(4))
}

/// Returns the error function of `x`, by its series or its continued fraction.
fn erf(x: f64) -> f64 {
    if x > 3.0 {
        let tail = (1..60).rev().fold(0.0, |below, k| f64::from(k) / 2.0 / (x + below));
        return 1.0 - (-x * x).exp() / (PI.sqrt() * (x + tail));
    }
    let (mut term, mut sum) = (x, x);
    for k in 1..100 {
        term *= -x * x / f64::from(k);
        sum += term / f64::from(2 * k + 1);
    }
    2.0 / PI.sqrt() * sum
}

/// Returns the auxiliary function Lambda of Smith masking. `c` is the cosine of the angle to the
/// surface normal.
pub fn lambda(ggx: bool, alpha: f64, c: f64) -> f64 {
    let tan = (1.0 - c * c).max(0.0).sqrt() / c;
    if tan == 0.0 {
        return 0.0;
    }
    if ggx {
        return 0.5 * ((1.0 + (alpha * tan).powi(2)).sqrt() - 1.0);
    }
    let a = 1.0 / (alpha * tan);
    0.5 * (erf(a) - 1.0) + (-a * a).exp() / (2.0 * a * PI.sqrt())
}

/// Returns the fraction of the microfacets with normal `h` that are visible from the direction `v`.
/// `h` and `v` must be on the same side of the surface.
fn visible(material: &Material, n: DVec3, h: DVec3, v: DVec3) -> f64 {
    let (ggx, alpha) = (material.lobe == Lobe::Ggx, material.microfacet_alpha());
    match material.masking {
        Masking::VCavity => 1f64.min(2.0 * n.dot(h) * n.dot(v) / v.dot(h)),
        Masking::Smith => 1.0 / (1.0 + lambda(ggx, alpha, n.dot(v))),
    }
}

fn masking(material: &Material, ggx: bool, alpha: f64, n: DVec3, v: DVec3, l: DVec3) -> f64 {
    let h = (v + l).normalize();
    let (nh, nv, nl, vh) = (n.dot(h), n.dot(v), n.dot(l), v.dot(h));
    match material.masking {
        Masking::VCavity => 1f64.min(2.0 * nh * nv / vh).min(2.0 * nh * nl / vh),
        Masking::Smith => 1.0 / (1.0 + lambda(ggx, alpha, nv) + lambda(ggx, alpha, nl)),
    }
}

/// Smallest roughness of a lobe at which the light of lamps is found by sampling points of the
/// lamps. With a smaller roughness it is found by reflected rays.
const WIDE: f64 = 0.12;

/// Returns the value of the reflection lobe, multiplied by the cosine of the angle between the
/// normal `n` and the direction `l` to the light. Returns `None` for square lobes and for lobes of
/// a smaller roughness than [`WIDE`], for which reflected rays find the light of lamps.
pub fn wide_lobe(
    material: &Material,
    n: DVec3,
    v: DVec3,
    l: DVec3,
    horizon: BelowHorizon,
) -> Option<DVec3> {
    if material.roughness < WIDE || material.reflection == 0.0 {
        return None;
    }
    match material.lobe {
        Lobe::Mirror | Lobe::Square => None,
        Lobe::Cone => {
            let mirror = 2.0 * n.dot(v) * n - v;
            let cos = 1.0 / (1.0 + material.roughness.powi(2)).sqrt();
            let inside = |l: DVec3| if mirror.dot(l) >= cos { 1.0 } else { 0.0 };
            let folded =
                if horizon == BelowHorizon::Fold { inside(l - 2.0 * l.dot(n) * n) } else { 0.0 };
            let density = (inside(l) + folded) / (TAU * (1.0 - cos));
            let k = material.reflection * density;
            Some(fresnel(material, v.dot((v + l).normalize())) * k)
        }
        Lobe::Beckmann | Lobe::Ggx => {
            // The lobe has the formula of a Cook-Torrance highlight of the same microfacets.
            let (highlight_model, specular) = (Highlight::CookTorrance, material.reflection);
            let like = Material { highlight: highlight_model, specular, ..material.clone() };
            Some(highlight(&like, n, v, l))
        }
    }
}

/// Returns `true` if reflected rays show what the highlights of the material show, if they can hit
/// the light.
pub fn reflects_highlight(material: &Material) -> bool {
    material.highlight == Highlight::CookTorrance
        && matches!(material.lobe, Lobe::Beckmann | Lobe::Ggx)
        && material.reflection > 0.0
}

/// Returns the highlight of a light in direction `l`: the radiance towards `v`, divided by the
/// irradiance that a surface facing the light would receive.
pub fn highlight(material: &Material, n: DVec3, v: DVec3, l: DVec3) -> DVec3 {
    let k = material.specular;
    if k == 0.0 {
        return DVec3::ZERO;
    }
    match material.highlight {
        Highlight::Phong => {
            let cos = (2.0 * n.dot(l) * n - l).dot(v);
            DVec3::splat(if cos > 0.0 { k * cos.powf(material.exponent) / PI } else { 0.0 })
        }
        Highlight::CookTorrance => {
            let ggx = material.lobe == Lobe::Ggx;
            let alpha = material.microfacet_alpha().max(SMOOTHEST);
            let h = (v + l).normalize();
            let nv = n.dot(v);
            if nv <= 0.0 || v.dot(h) <= 0.0 || n.dot(h) <= 0.0 {
                return DVec3::ZERO;
            }
            let d = facet_density(ggx, alpha, n.dot(h));
            let g = masking(material, ggx, alpha, n, v, l);
            fresnel(material, v.dot(h)) * (k * d * g / (4.0 * nv))
        }
    }
}

/// Returns the two tangents of an orthonormal frame around `w` (Duff et al. 2017, *Building an
/// Orthonormal Basis, Revisited*). The sides of a square lobe about the axis `w` are parallel to
/// them.
fn around(w: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(w.z);
    let a = -1.0 / (sign + w.z);
    let b = w.x * w.y * a;
    let u = DVec3::new(1.0 + sign * w.x * w.x * a, sign * b, -sign * w.x);
    (u, DVec3::new(b, sign + w.y * w.y * a, -w.y))
}

/// Returns the assumed density of a lobe divided by its true density: 1 without a deliberate error.
fn density_factor(mutation: Mutation) -> f64 {
    if mutation == Mutation::LobeDensity { 1.05 } else { 1.0 }
}

/// Samples a reflected ray. Returns its direction and throughput. Returns `None` if the ray is
/// absorbed.
pub fn reflect(
    material: &Material,
    n: DVec3,
    v: DVec3,
    horizon: BelowHorizon,
    mutation: Mutation,
    numbers: &mut Numbers,
) -> Option<(DVec3, DVec3)> {
    let k = material.reflection;
    let mirror = 2.0 * n.dot(v) * n - v;
    let mut radius = material.roughness;
    if mutation == Mutation::WiderLobe {
        radius *= 1.05;
    }
    let sharp = is_sharp(material);
    if has_facets(material) && !sharp {
        return microfacet(material, n, v, mutation, numbers);
    }
    let mut direction = if sharp { mirror } else { spread(material, mirror, radius, numbers) };
    if direction.dot(n) <= 0.0 {
        if horizon == BelowHorizon::Absorb || mutation == Mutation::Absorb {
            return None;
        }
        direction -= 2.0 * direction.dot(n) * n;
    }
    // Fresnel reflectance at the half vector of `v` and `direction`.
    let f = fresnel(material, v.dot((v + direction).normalize()));
    Some((direction, f * k / if sharp { 1.0 } else { density_factor(mutation) }))
}

pub fn has_facets(material: &Material) -> bool {
    matches!(material.lobe, Lobe::Beckmann | Lobe::Ggx)
}

/// Returns `true` if the material reflects and transmits each ray in a single direction.
pub fn is_sharp(material: &Material) -> bool {
    match material.lobe {
        Lobe::Mirror => true,
        Lobe::Beckmann | Lobe::Ggx => material.microfacet_alpha() < SMOOTHEST,
        Lobe::Cone | Lobe::Square => material.roughness == 0.0,
    }
}

/// Samples a direction in the cone or the square lobe about `axis`. `radius` is the radius of the
/// cone at unit distance; the square has the area of the cone's base there.
pub fn spread(material: &Material, axis: DVec3, radius: f64, numbers: &mut Numbers) -> DVec3 {
    let (a, b) = around(axis);
    let local = if material.lobe == Lobe::Cone {
        let edge = 1.0 / (1.0 + radius * radius).sqrt();
        let z = numbers.between(edge, 1.0);
        let (sin, cos) = numbers.between(0.0, TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    } else {
        let half = 0.5 * PI.sqrt() * radius;
        DVec3::new(numbers.between(-half, half), numbers.between(-half, half), 1.0).normalize()
    };
    a * local.x + b * local.y + axis * local.z
}

/// Samples a microfacet normal h with the density D(h) (n.h), where D is the distribution of
/// microfacet normals.
pub fn facet_normal(material: &Material, alpha: f64, n: DVec3, numbers: &mut Numbers) -> DVec3 {
    let u = numbers.unit();
    let ggx = material.lobe == Lobe::Ggx;
    let tan2 = alpha * alpha * if ggx { u / (1.0 - u) } else { -(1.0 - u).ln() };
    let cos = 1.0 / (1.0 + tan2).sqrt();
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let (s, c) = numbers.between(0.0, TAU).sin_cos();
    let (a, b) = around(n);
    a * (sin * c) + b * (sin * s) + n * cos
}

/// Indices of refraction in front of and behind a surface.
pub type Indices = (f64, f64);

/// Samples a ray that is refracted at a microfacet. Returns its direction, its weight without the
/// Fresnel factor, and the microfacet normal. Returns `None` if the microfacet reflects totally, or
/// if the refracted ray stays in front of the surface.
pub fn refracted_at_facet(
    material: &Material,
    n: DVec3,
    v: DVec3,
    (n_i, n_t): Indices,
    mutation: Mutation,
    numbers: &mut Numbers,
) -> Option<(DVec3, f64, DVec3)> {
    let alpha = material.microfacet_alpha();
    let h = facet_normal(material, alpha, n, numbers);
    let vh = v.dot(h);
    let ratio = n_i / n_t;
    let cos2_t = 1.0 - ratio * ratio * (1.0 - vh * vh);
    if vh <= 0.0 || cos2_t <= 0.0 {
        return None;
    }
    let l = h * (ratio * vh - cos2_t.sqrt()) - v * ratio;
    let (nv, nl, nh, lh) = (n.dot(v), -n.dot(l), n.dot(h), -l.dot(h));
    if nl <= 0.0 || nv <= 0.0 {
        return None;
    }
    let (above, below) = (visible(material, n, h, v), visible(material, -n, -h, l));
    let g = match material.masking {
        Masking::VCavity => (above + below - 1.0).max(0.0),
        Masking::Smith => above * below,
    };
    let d = facet_density(material.lobe == Lobe::Ggx, alpha, nh);
    let jacobian = |n_t: f64| n_t * n_t * lh / (n_i * vh - n_t * lh).powi(2);
    // Walter et al. 2007, eq. 21, times the cosine of the angle between the surface normal and `l`.
    // The factor by which refraction changes radiance is left out.
    let f_cos = vh / nv * g * d * jacobian(n_t);
    let density = d
        * nh
        * match mutation {
            Mutation::NoJacobian => 1.0,
            Mutation::OtherIndex => jacobian(n_t) * (n_i / n_t).powi(2),
            _ => jacobian(n_t),
        };
    Some((l, f_cos / density, h))
}

/// Samples a ray that is reflected at a microfacet. The microfacet normal h has the density D(h)
/// (n.h), where D is the distribution of microfacet normals. Returns the direction and the
/// throughput of the ray. Returns `None` if the ray is below the surface.
fn microfacet(
    material: &Material,
    n: DVec3,
    v: DVec3,
    mutation: Mutation,
    numbers: &mut Numbers,
) -> Option<(DVec3, DVec3)> {
    let ggx = material.lobe == Lobe::Ggx;
    let alpha =
        material.microfacet_alpha() * if mutation == Mutation::WiderLobe { 1.05 } else { 1.0 };
    let h = facet_normal(material, alpha, n, numbers);
    let vh = v.dot(h);
    let l = 2.0 * vh * h - v;
    let (nv, nl, nh) = (n.dot(v), n.dot(l), n.dot(h));
    if vh <= 0.0 || nl <= 0.0 || nv <= 0.0 {
        return None;
    }
    // f N.L / density, where density = D N.H / (4 V.H).
    let g = masking(material, ggx, alpha, n, v, l);
    let weight = material.reflection * g * vh / (nv * nh) / density_factor(mutation);
    Some((l, fresnel(material, vh) * weight))
}
