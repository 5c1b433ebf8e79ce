//! BSDF evaluation and sampling in SIMD lanes: highlights of lights and reflected rays.

use crate::lanes::{Float, Frame, Mask, SimdFloat, Vec3};
use crate::material::Masking;
use crate::material::bsdf::{Bsdf, MicrofacetDistribution, ReflectionLobe, SpecularModel};
use crate::sampling::warp;
use std::f64::consts::{FRAC_1_PI, PI};

/// Direction and weight of a reflected ray.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample<L> {
    /// Unit direction.
    pub direction: Vec3<L>,
    /// Factor of the radiance from `direction`; zero if the ray is lost.
    pub weight: Vec3<L>,
}

/// Returns the component of `h` along the unit vector `n`, and the squared tangent of the angle between
/// them; `h` has any length.
///
/// The tangent is computed from the part of `h` across `n`, so that small angles keep full precision, and
/// bounded by 1e15, so that terms computed from it are finite.
#[inline(always)]
fn along_tan2<L: SimdFloat>(h: Vec3<L>, n: Vec3<L>) -> (L, L) {
    let along = h.dot(n);
    let across = h - n * along;
    (along, (across.length_squared() / (along * along)).min(L::from_f64(1e15)))
}

/// Returns `cos`^alpha for a cosine computed from unit vectors; 0 from 90 degrees.
///
/// The cosine is clamped to 1: that of two rounded vectors may exceed 1 by a few roundings, and
/// 1.000001^1e6 is 2.7.
#[inline(always)]
fn cosine_power<L: SimdFloat>(cos: L, alpha: L) -> L {
    let power = (cos.max(L::from_f64(1e-30)).min(L::one()).ln() * alpha).exp();
    power.masked(cos.gt(L::zero()))
}

/// Returns cos^alpha of the angle between `a` and `b`, of any lengths, for alpha above
/// [`SHARP_EXPONENT`](crate::material::bsdf::SHARP_EXPONENT); 0 from 90 degrees.
///
/// Near 1 the cosine loses precision, but the tangent t = |a x b| / a.b keeps it: cos^alpha = exp(-alpha / 2
/// ln(1 + t^2)), and ln(1 + t^2) = 2 artanh(s) with s = t^2 / (2 + t^2). Four terms of its series in s^2 have
/// a relative error of s^8 / 9: below 1e-9 while alpha s < 88, above which the power is not a normal
/// single-precision number.
#[inline(always)]
fn sharp_cosine_power<L: SimdFloat>(a: Vec3<L>, b: Vec3<L>, alpha: L) -> L {
    let (along, across2) = (a.dot(b), a.cross(b).length_squared());
    let s = across2 / (along * along * L::from_f64(2.0) + across2);
    let s2 = s * s;
    let series = [1.0 / 5.0, 1.0 / 3.0, 1.0]
        .into_iter()
        .fold(L::from_f64(1.0 / 7.0), |sum, term| sum.mul_add(s2, L::from_f64(term)));
    (-(alpha * s * series)).exp().masked(along.gt(L::zero()))
}

/// Terms of a microfacet BSDF in SIMD lanes.
pub trait MicrofacetEval<L: SimdFloat> {
    /// Returns D [1/sr]; `tan2` is the squared tangent of the angle between facet normal and surface
    /// normal.
    fn density(&self, tan2: L) -> L;
    /// Returns G, the fraction of facets with normal h visible from both directions, as numerator and
    /// denominator. `nh`, `nv`, `nl`, `vh` are positive cosines; `nh` and `vh` may have a common factor.
    fn masking(&self, nh: L, nv: L, nl: L, vh: L) -> (L, L);
    /// Returns Smith's Lambda for a direction with the cosine `c` > 0 to the normal.
    fn lambda(&self, c: L) -> L;
}

/// Value of 1 / (alpha tan) from which Beckmann's Lambda is below 3e-10.
const STEEP: f64 = 4.0;

/// Returns Beckmann's Lambda (erf(a) - 1) / 2 + exp(-a^2) / (2 a sqrt(pi)) for 0 < a < [`STEEP`] (Heitz
/// 2014, eq. 57); undefined for larger `a`.
///
/// Computed as exp(-a^2) k(a) / (2 a sqrt(pi) (1 + 2 a^2)) with a smooth k between 0.6 and 1, approximated
/// by a Chebyshev fit of degree 10 in 2 - 6 / (a + 2). The error is below 1e-8 (1 + Lambda).
#[inline(always)]
fn beckmann_lambda<L: SimdFloat>(a: L) -> L {
    const K: [f64; 11] = [
        0.726_383_531_676_393_2,
        0.221_492_853_638_683_35,
        0.159_588_281_416_975_67,
        -0.247_616_611_436_622_9,
        0.093_493_669_224_564_09,
        -0.000_193_709_867_889_302_33,
        -0.006_363_589_005_963_344,
        -0.000_203_411_755_586_691,
        0.000_456_536_003_607_954_65,
        5.661_643_591_547_971e-5,
        -2.270_107_819_080_595_3e-5,
    ];
    let x = L::from_f64(2.0) - L::from_f64(6.0) / (a + L::from_f64(2.0));
    let k = K.iter().rev().fold(L::zero(), |sum, k| sum.mul_add(x, L::from_f64(*k)));
    let a2 = a * a;
    let below = a * a2.mul_add(L::from_f64(4.0 * PI.sqrt()), L::from_f64(2.0 * PI.sqrt()));
    (-a2).exp() * k / below
}

impl<L: SimdFloat> MicrofacetEval<L> for MicrofacetDistribution<L::Scalar> {
    #[inline(always)]
    fn density(&self, tan2: L) -> L {
        let inverse_alpha2 = L::splat(self.inverse_alpha2);
        if self.ggx {
            warp::ggx_d(tan2, inverse_alpha2)
        } else {
            warp::beckmann_d(tan2, inverse_alpha2)
        }
    }

    /// Torrance and Sparrow 1967 (V-cavities): min(1, 2 N.H min(N.V, N.L) / V.H); Heitz 2014,
    /// *Understanding the Masking-Shadowing Function* (height-correlated Smith): 1 / (1 + Lambda(V) +
    /// Lambda(L)).
    #[inline(always)]
    fn masking(&self, nh: L, nv: L, nl: L, vh: L) -> (L, L) {
        match self.masking {
            Masking::VCavity => ((L::from_f64(2.0) * nh * nv.min(nl)).min(vh), vh),
            Masking::Smith => (L::one(), L::one() + self.lambda(nv) + self.lambda(nl)),
        }
    }

    /// Lambda as a function of a = 1 / (alpha tan).
    #[inline(always)]
    fn lambda(&self, c: L) -> L {
        let alpha2 = L::splat(self.alpha2);
        let (cos2, sin2) = (c * c, (L::one() - c * c).max(L::zero()));
        if self.ggx {
            return ((alpha2 * sin2 / cos2 + L::one()).sqrt() - L::one()) * L::from_f64(0.5);
        }
        // Most packets see the surface steeply in all lanes: nothing is masked.
        let grazing = cos2.lt(sin2 * alpha2 * L::from_f64(STEEP * STEEP));
        if grazing.none() {
            return L::zero();
        }
        beckmann_lambda(c / (alpha2 * sin2).sqrt()).masked(grazing)
    }
}

impl<S: Float> Bsdf<S> {
    /// Returns `true` if lights have highlights on it.
    #[inline(always)]
    pub fn has_highlight(&self) -> bool {
        !matches!(self.specular, SpecularModel::None)
    }

    /// Returns the highlight of a light: radiance towards `view` per irradiance of a surface that faces
    /// the light [1/sr]. It includes the cosine of the incident light where the formula has one.
    ///
    /// `n`, `view` and `light` are unit vectors away from the surface, `nl` and `nv` their cosines.
    #[inline(always)]
    pub fn highlight<L: SimdFloat<Scalar = S>>(
        &self,
        n: Vec3<L>,
        view: Vec3<L>,
        light: Vec3<L>,
        nl: L,
        nv: L,
    ) -> Vec3<L> {
        match &self.specular {
            SpecularModel::None => Vec3::zero(),
            SpecularModel::Phong { strength, exponent, sharp } => {
                let (r, alpha) = (-light.reflect(n), L::splat(*exponent));
                let power = if *sharp {
                    sharp_cosine_power(r, view, alpha)
                } else {
                    let cos = r.dot(view);
                    cosine_power(cos, alpha)
                };
                let value = L::splat(*strength) * power * L::from_f64(FRAC_1_PI);
                Vec3::new(value, value, value)
            }
            SpecularModel::MicrofacetDistribution { strength, facets } => {
                // The half vector without normalisation: its squared length is twice its product with
                // either direction.
                let h = view + light;
                let (nh, tan2) = along_tan2(h, n);
                let h2 = h.length_squared();
                let (visible, total) = facets.masking(nh, nv, nl, h2 * L::from_f64(0.5));
                // f N.L = D G F / (4 N.V): the light's cosine cancels.
                let d: L = facets.density(tan2);
                let k = L::from_f64(0.25 * strength.to_f64());
                let value = d * visible * k / (nv * total);
                let valid = nh.gt(L::zero()) & nv.gt(L::zero());
                self.highlight_fresnel.times(|| h2.sqrt() * L::from_f64(0.5), value).masked(valid)
            }
        }
    }

    /// Samples a reflected ray. `incident` is the unit direction towards the surface, `n` the normal on
    /// the viewer's side, `u` and `v` are uniform in [0, 1). If `fold` is `true`, directions below the
    /// surface are mirrored up, otherwise they get the weight 0.
    #[inline(always)]
    pub fn sample<L: SimdFloat<Scalar = S>>(
        &self,
        strength: S,
        lobe: &ReflectionLobe<S>,
        incident: Vec3<L>,
        n: Vec3<L>,
        (u, v): (L, L),
        fold: bool,
    ) -> BsdfSample<L> {
        let mirror = incident.reflect(n);
        let k = L::splat(strength);
        let (direction, weight) = match lobe {
            ReflectionLobe::Mirror => (mirror, k),
            ReflectionLobe::Cone { one_minus_cos } => {
                let local = warp::cone(u, v, L::splat(*one_minus_cos));
                (Frame::around(mirror.renormalize()).to_world(local), k)
            }
            ReflectionLobe::Square { side } => {
                let local = warp::square(u, v, L::splat(*side));
                (Frame::around(mirror.renormalize()).to_world(local), k)
            }
            ReflectionLobe::MicrofacetDistribution(facets) => {
                return self.sample_microfacet(k, facets, incident, n, (u, v));
            }
        };
        let up = direction.dot(n);
        let below = up.le(L::zero());
        let (direction, weight) = if fold {
            (Vec3::select(below, direction.reflect(n), direction), weight)
        } else {
            (direction, L::select(below, L::zero(), weight))
        };
        // The normal of the facet that reflects this ray is half-way between view and reflected
        // direction: its cosine with either is half the length of their sum, without cancellation at
        // grazing angles.
        let cos =
            || ((direction - incident).length_squared().sqrt() * L::from_f64(0.5)).min(L::one());
        BsdfSample { direction, weight: self.reflection_fresnel.times(cos, weight) }
    }

    /// Samples the reflection at a microfacet. Below the surface G, and with it the weight, is zero.
    #[inline(always)]
    fn sample_microfacet<L: SimdFloat<Scalar = S>>(
        &self,
        k: L,
        facets: &MicrofacetDistribution<S>,
        incident: Vec3<L>,
        n: Vec3<L>,
        (u, v): (L, L),
    ) -> BsdfSample<L> {
        let frame = Frame::around(n);
        let view = frame.to_local(-incident);
        let alpha = L::splat(facets.alpha);
        let h = if facets.ggx {
            warp::ggx_visible(u, v, alpha, view)
        } else {
            warp::beckmann(u, v, alpha)
        };
        let vh = view.dot(h);
        let light = h * (vh + vh) - view;
        let (visible, total) = facets.masking(h.z, view.z, light.z, vh);
        let weight: L = if facets.ggx {
            // Visible normals: density D G1 V.H / N.V, so that f N.L / density = F G / G1.
            k * visible * (L::one() + MicrofacetEval::<L>::lambda(facets, view.z)) / total
        } else {
            // Normals with density D N.H: f N.L / density = F G V.H / (N.V N.H).
            k * visible * vh / (total * view.z * h.z)
        };
        let valid = vh.gt(L::zero()) & light.z.gt(L::zero()) & view.z.gt(L::zero());
        BsdfSample {
            direction: frame.to_world(light).renormalize(),
            weight: self.reflection_fresnel.times(|| vh, weight).masked(valid),
        }
    }

    /// Returns the density [1/sr] with which [`Bsdf::sample`] draws `direction` before folding; `None`
    /// for a mirror. Scalar, in double precision, for tests.
    pub fn density(
        &self,
        lobe: &ReflectionLobe<S>,
        incident: Vec3<f64>,
        n: Vec3<f64>,
        direction: Vec3<f64>,
    ) -> Option<f64> {
        let mirror = incident.reflect(n);
        match lobe {
            ReflectionLobe::Mirror => None,
            ReflectionLobe::Cone { one_minus_cos } => {
                Some(warp::cone_pdf(mirror.dot(direction), one_minus_cos.to_f64()))
            }
            ReflectionLobe::Square { side } => {
                let local = Frame::around(mirror).to_local(direction);
                Some(warp::square_pdf([local.x, local.y, local.z], side.to_f64()))
            }
            ReflectionLobe::MicrofacetDistribution(facets) => {
                let facets = MicrofacetDistribution::<f64>::new(
                    facets.ggx,
                    facets.alpha.to_f64(),
                    facets.masking,
                );
                let view = -incident;
                let h = (view + direction).normalize();
                let (nh, tan2) = along_tan2(h, n);
                let vh = view.dot(h);
                if nh <= 0.0 || vh <= 0.0 {
                    return Some(0.0);
                }
                let d = facets.density(tan2);
                let nv = view.dot(n);
                Some(if facets.ggx {
                    d / ((1.0 + MicrofacetEval::<f64>::lambda(&facets, nv)) * 4.0 * nv)
                } else {
                    d * nh / (4.0 * vh)
                })
            }
        }
    }
}
