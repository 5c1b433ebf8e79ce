//! From the unit square to directions: the lobes of reflected rays and microfacets, each with its
//! density.
//!
//! Directions are in the frame of the lobe: z along its axis (the mirror direction for cone and
//! square, the normal for microfacets).

use crate::lanes::{Lanes, V3};
use std::f64::consts::{FRAC_1_PI, TAU};

/// A uniform direction in the cone of half-angle theta about z.
///
/// `one_minus_cos` is 1 - cos(theta), best computed as 2 sin^2(theta / 2); its range is [0, 1].
#[inline(always)]
pub fn cone<L: Lanes>(u: L, v: L, one_minus_cos: L) -> V3<L> {
    let drop = u * one_minus_cos;
    let sin = (drop * (L::of(2.0) - drop)).max(L::zero()).sqrt();
    let (s, c) = (v * L::of(TAU)).sin_cos();
    V3::new(sin * c, sin * s, L::one() - drop)
}

/// Density of [`cone`] [1/sr]: constant inside, 0 outside.
pub fn cone_pdf(direction_z: f64, one_minus_cos: f64) -> f64 {
    if 1.0 - direction_z <= one_minus_cos { 1.0 / (TAU * one_minus_cos) } else { 0.0 }
}

/// A direction through a uniform point of the square with sides `side` at unit distance,
/// perpendicular to z and centred on it.
#[inline(always)]
pub fn square<L: Lanes>(u: L, v: L, side: L) -> V3<L> {
    let half = L::of(0.5);
    V3::new((u - half) * side, (v - half) * side, L::one()).normalize()
}

/// Density of [`square`] [1/sr]: 1 / (side^2 cos^3) inside, 0 outside.
pub fn square_pdf(direction: [f64; 3], side: f64) -> f64 {
    let [x, y, z] = direction;
    let inside = z > 0.0 && x.abs().max(y.abs()) <= 0.5 * side * z;
    if inside { 1.0 / (side * side * z * z * z) } else { 0.0 }
}

/// A microfacet normal with density D(h) cos(h), Beckmann distribution of slope `alpha`.
///
/// Walter et al. 2007, *Microfacet Models for Refraction through Rough Surfaces*, eq. 28.
#[inline(always)]
pub fn beckmann<L: Lanes>(u: L, v: L, alpha: L) -> V3<L> {
    let tan2 = -(alpha * alpha * (L::one() - u).ln());
    let cos = L::one() / (L::one() + tan2).sqrt();
    let sin = cos * tan2.max(L::zero()).sqrt();
    let (s, c) = (v * L::of(TAU)).sin_cos();
    V3::new(sin * c, sin * s, cos)
}

/// A microfacet normal with density D_v(h), the GGX normals visible from `view` (unit, z >= 0).
///
/// Dupuy and Benyoub 2023, *Sampling Visible GGX Normals with Spherical Caps*.
#[inline(always)]
pub fn ggx_visible<L: Lanes>(u: L, v: L, alpha: L, view: V3<L>) -> V3<L> {
    let stretched = V3::new(view.x * alpha, view.y * alpha, view.z).normalize();
    let (s, c) = (u * L::of(TAU)).sin_cos();
    let z = (L::one() - v) * (L::one() + stretched.z) - stretched.z;
    let sin = (L::one() - z * z).max(L::zero()).sqrt();
    let h = V3::new(sin * c, sin * s, z) + stretched;
    V3::new(h.x * alpha, h.y * alpha, h.z.max(L::zero())).normalize()
}

/// Beckmann's distribution D [1/sr] of microfacet normals at squared tangent `tan2` from the surface
/// normal: exp(-tan2 / alpha^2) / (pi alpha^2 cos^4), with 1 / cos^2 = 1 + tan2.
#[inline(always)]
pub fn beckmann_d<L: Lanes>(tan2: L, inverse_alpha2: L) -> L {
    let secant2 = tan2 + L::one();
    (-(tan2 * inverse_alpha2)).exp() * (secant2 * secant2) * (inverse_alpha2 * L::of(FRAC_1_PI))
}

/// The GGX distribution D [1/sr]: 1 / (pi alpha^2 cos^4 (1 + tan2 / alpha^2)^2).
#[inline(always)]
pub fn ggx_d<L: Lanes>(tan2: L, inverse_alpha2: L) -> L {
    let ratio = (tan2 + L::one()) / (tan2 * inverse_alpha2 + L::one());
    ratio * ratio * (inverse_alpha2 * L::of(FRAC_1_PI))
}
