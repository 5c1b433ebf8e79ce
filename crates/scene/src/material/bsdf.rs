//! Compiled BSDF: its construction from a material, evaluation of highlights, sampling of
//! reflections. Rough transmission is sampled in `rough_interface.rs`.

use crate::material::fresnel::Reflectance;
use crate::material::microfacet::{MicrofacetDistribution, MicrofacetEval, SMOOTH_ALPHA};
use crate::material::{Fresnel, Highlight, Lobe, Material};
use std::f64::consts::FRAC_1_PI;
use zerkalo_kernel::lanes::{Float, Frame, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;

/// Largest Phong exponent alpha for which the power cos^alpha is computed from a cosine. In single
/// precision the relative error of this power is about alpha times 1.5e-7. For larger exponents the
/// power is computed from a tangent.
pub const SHARP_EXPONENT: f64 = 1024.0;

/// Model of highlights (the reflections of lights in a surface), compiled for the kernels.
#[derive(Clone, Copy, Debug)]
pub enum SpecularModel<S> {
    /// No highlights.
    None,
    /// Phong's model: k_s (R.V)^alpha / pi.
    Phong {
        /// Specular coefficient k_s of Phong's model.
        strength: S,
        /// Phong exponent alpha.
        exponent: S,
        /// `true` if the exponent alpha exceeds `SHARP_EXPONENT`. The power is then computed from a
        /// tangent instead of a cosine.
        sharp: bool,
    },
    /// Microfacet model: k_s D G F / (4 N.L N.V).
    MicrofacetDistribution {
        /// Specular coefficient k_s of the microfacet model.
        strength: S,
        /// Microfacet distribution, which gives D and G of the formula.
        facets: MicrofacetDistribution<S>,
    },
}

/// Distribution of the directions of reflected rays about the mirror direction, compiled for the
/// kernels.
#[derive(Clone, Copy, Debug)]
pub enum ReflectionLobe<S> {
    /// Mirror: all reflected rays have the mirror direction.
    Mirror,
    /// Uniform directions in a cone about the mirror direction.
    Cone {
        /// 1 - cos of the cone's half-angle.
        one_minus_cos: S,
    },
    /// Directions through uniform points of a square. The square is at unit distance along the
    /// mirror direction and perpendicular to it.
    Square {
        /// Side length of the square at unit distance.
        side: S,
    },
    /// Mirror reflection at visible microfacets with this distribution of normals.
    MicrofacetDistribution(MicrofacetDistribution<S>),
}

/// Transmission of light through a surface, compiled for the kernels.
#[derive(Clone, Copy, Debug)]
pub struct Transmission<S> {
    /// Transmission coefficient k_t of the material.
    pub strength: S,
    /// Index of refraction inside of the solid that the surface bounds.
    pub index: S,
    /// Absorption coefficients [1 / scene unit] inside of the solid; 0 absorbs nothing.
    pub absorption: [S; 3],
    /// Distribution of the transmitted rays about the refracted direction. With `Mirror`, all of
    /// them have the refracted direction, as in clear glass.
    pub lobe: ReflectionLobe<S>,
    /// `true` if Fresnel's equations split the light between reflection and transmission; `false`
    /// if k_r and k_t alone are the weights.
    pub dielectric: bool,
}

/// BSDF: a material compiled for the kernels.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<S> {
    /// Ambient coefficient times the material's colour.
    pub ambient: [S; 3],
    /// Diffuse coefficient times the material's colour.
    pub diffuse: [S; 3],
    /// Model of highlights, which are the reflections of lights in the surface.
    pub specular: SpecularModel<S>,
    /// Reflection coefficient k_r, and the distribution of reflected rays; `None` if the material
    /// reflects no rays.
    pub reflection: Option<(S, ReflectionLobe<S>)>,
    /// Transmission through the surface; `None` if the material is opaque.
    pub transmission: Option<Transmission<S>>,
    /// Fresnel reflectance of the microfacets in a highlight. Highlights by Phong's model do not
    /// use it.
    pub highlight_fresnel: Reflectance<S>,
    /// Fresnel reflectance of reflected rays. It is 1 for a transparent dielectric, whose
    /// reflectance is computed at each intersection because it depends on the medium on the other
    /// side of the surface.
    pub reflection_fresnel: Reflectance<S>,
    /// `true` if the surface has a diffuse part or highlights, so that it reflects light that
    /// arrives directly from lights.
    pub has_direct: bool,
    /// `true` if the back of a surface has the same material as its front. `false` if the back has
    /// no diffuse part, no highlights and no reflection lobe.
    pub two_sided: bool,
}

/// Returns 1 - cos(atan(r)), computed without cancellation: r^2 / (1 + r^2 + sqrt(1 + r^2)).
pub fn one_minus_cos_of_tan(r: f64) -> f64 {
    let square = r * r;
    if square.is_infinite() { 1.0 } else { square / (1.0 + square + (1.0 + square).sqrt()) }
}

impl<S: Float> Bsdf<S> {
    /// Compiles `material` to a BSDF. `reflects` is `true` if the scene traces reflected and
    /// transmitted rays; otherwise the BSDF has no reflection and no transmission.
    pub fn new(material: &Material, reflects: bool) -> Self {
        let alpha = material.microfacet_alpha().max(SMOOTH_ALPHA);
        let facets = |ggx| MicrofacetDistribution::new(ggx, alpha, material.masking);
        let strength = S::from_f64(material.specular);
        let specular = match material.highlight {
            _ if material.specular == 0.0 => SpecularModel::None,
            Highlight::Phong => SpecularModel::Phong {
                strength,
                exponent: S::from_f64(material.exponent),
                sharp: material.exponent > SHARP_EXPONENT,
            },
            Highlight::CookTorrance => SpecularModel::MicrofacetDistribution {
                strength,
                facets: facets(material.lobe == Lobe::Ggx),
            },
        };
        let r = material.roughness;
        let lobe = match material.lobe {
            Lobe::Mirror => ReflectionLobe::Mirror,
            Lobe::Cone | Lobe::Square if r == 0.0 => ReflectionLobe::Mirror,
            Lobe::Cone => {
                ReflectionLobe::Cone { one_minus_cos: S::from_f64(one_minus_cos_of_tan(r)) }
            }
            Lobe::Square => {
                ReflectionLobe::Square { side: S::from_f64(std::f64::consts::PI.sqrt() * r) }
            }
            Lobe::Beckmann | Lobe::Ggx if material.microfacet_alpha() < SMOOTH_ALPHA => {
                ReflectionLobe::Mirror
            }
            Lobe::Beckmann => ReflectionLobe::MicrofacetDistribution(facets(false)),
            Lobe::Ggx => ReflectionLobe::MicrofacetDistribution(facets(true)),
        };
        let (k_r, k_t) = (material.reflection, material.transmission);
        let dielectric = material.fresnel_mode() == Fresnel::Dielectric;
        let transmission = (reflects && k_t > 0.0).then(|| Transmission {
            strength: S::from_f64(k_t),
            index: S::from_f64(material.ior),
            absorption: material.absorption().map(S::from_f64),
            lobe,
            dielectric,
        });
        let reflectance = Reflectance::new(material);
        let shared = dielectric && transmission.is_some();
        let black = material.diffuse == 0.0 || material.color.0 == [0.0; 3];
        Self {
            ambient: material.color.0.map(|c| S::from_f64(c * material.ambient)),
            diffuse: material.color.0.map(|c| S::from_f64(c * material.diffuse)),
            specular,
            reflection: (reflects && k_r > 0.0).then(|| (S::from_f64(k_r), lobe)),
            transmission,
            highlight_fresnel: reflectance,
            reflection_fresnel: if shared { Reflectance::white() } else { reflectance },
            has_direct: !black || material.specular != 0.0,
            two_sided: material.two_sided,
        }
    }
}

/// Direction of a sampled reflected ray, and the factor by which its radiance is multiplied.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample<L> {
    /// Unit direction of the reflected ray.
    pub direction: Vec3<L>,
    /// Factor by which the radiance from `direction` is multiplied; zero if nothing is reflected
    /// from there.
    pub weight: Vec3<L>,
}

/// Returns two values: the component of `h` along the unit vector `n`, and the squared tangent of
/// the angle between `h` and `n`. `h` may have any length.
///
/// The tangent is computed from the part of `h` perpendicular to `n`, which keeps full precision at
/// small angles. It is limited to 1e15, so that terms computed from it are finite.
#[inline(always)]
pub(super) fn along_tan2<L: SimdFloat>(h: Vec3<L>, n: Vec3<L>) -> (L, L) {
    let along = h.dot(n);
    let across = h - n * along;
    (along, (across.length_squared() / (along * along)).min(L::from_f64(1e15)))
}

/// Returns `cos`^alpha for a cosine computed from unit vectors; 0 for angles of 90 degrees and
/// more.
///
/// The cosine is clamped to 1. The dot product of two rounded unit vectors may exceed 1 by a few
/// rounding errors, and 1.000001^1e6 is 2.7.
#[inline(always)]
fn cosine_power<L: SimdFloat>(cos: L, alpha: L) -> L {
    let power = (cos.max(L::from_f64(1e-30)).min(L::one()).ln() * alpha).exp();
    power.masked(cos.gt(L::zero()))
}

/// Returns cos^alpha for the angle between the vectors `a` and `b`, which may have any lengths. The
/// result is 0 for angles of 90 degrees and more. The formula is for alpha above
/// [`SHARP_EXPONENT`](crate::material::bsdf::SHARP_EXPONENT).
///
/// A rounded cosine near 1 determines the angle with low precision. The tangent t = |a x b| / a.b
/// has full precision there, and cos^alpha = exp(-alpha / 2 ln(1 + t^2)). The logarithm is ln(1 +
/// t^2) = 2 artanh(s) with s = t^2 / (2 + t^2). Four terms of its series in s^2 have a relative
/// error of s^8 / 9. This is below 1e-9 while alpha s < 88; for a larger alpha s, the result is
/// below the smallest normal single-precision number.
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

/// Samples a unit vector of the lobe `Cone` or `Square` about the direction `axis`. The length of
/// `axis` is 1 within rounding errors. `u` and `v` are uniform in [0, 1). Returns `axis` for other
/// lobes.
#[inline(always)]
pub(super) fn spread<L: SimdFloat>(
    lobe: &ReflectionLobe<L::Scalar>,
    axis: Vec3<L>,
    (u, v): (L, L),
) -> Vec3<L> {
    let local = match lobe {
        ReflectionLobe::Cone { one_minus_cos } => warp::cone(u, v, L::splat(*one_minus_cos)),
        ReflectionLobe::Square { side } => warp::square(u, v, L::splat(*side)),
        ReflectionLobe::Mirror | ReflectionLobe::MicrofacetDistribution(_) => return axis,
    };
    Frame::around(axis.renormalize()).to_world(local)
}

impl<S: Float> Bsdf<S> {
    /// Returns `true` if the surface has highlights, which are reflections of lights.
    #[inline(always)]
    pub fn has_highlight(&self) -> bool {
        !matches!(self.specular, SpecularModel::None)
    }

    /// Returns `true` if the surface bounds a solid that absorbs light.
    pub fn absorbs(&self) -> bool {
        let absorption = self.transmission.map(|t| t.absorption.map(S::to_f64));
        absorption.is_some_and(|absorption| absorption != [0.0; 3])
    }

    /// Returns the highlight of a light [1/sr]: the radiance towards `view` divided by the
    /// irradiance at normal incidence. In the microfacet model it includes the factor `nl`; Phong's
    /// model has no such factor.
    ///
    /// `n`, `view` and `light` are unit vectors away from the surface. `nl` is the cosine between
    /// `n` and `light`, `nv` that between `n` and `view`.
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
                // The half vector is not normalised: its squared length is twice its dot product
                // with `view` or with `light`.
                let h = view + light;
                let (nh, tan2) = along_tan2(h, n);
                let h2 = h.length_squared();
                let (visible, total) = facets.masking(nh, nv, nl, h2 * L::from_f64(0.5));
                // f N.L = D G F / (4 N.V): the factor N.L cancels.
                let d: L = facets.density(tan2);
                let k = L::from_f64(0.25 * strength.to_f64());
                let value = d * visible * k / (nv * total);
                let valid = nh.gt(L::zero()) & nv.gt(L::zero());
                self.highlight_fresnel.times(|| h2.sqrt() * L::from_f64(0.5), value).masked(valid)
            }
        }
    }

    /// Samples a reflected ray of `lobe`. Its weight is the product of `strength` (a coefficient of
    /// the material), the Fresnel reflectance and, for microfacets, the shadowing G / G_1.
    /// `incident` is the unit direction towards the surface, and `n` is the normal on the viewer's
    /// side. `uv` are uniform in [0, 1). Directions below the surface have the weight 0. If `fold`
    /// is `true`, such directions of a cone or square are mirrored to the upper side instead.
    #[inline(always)]
    pub fn sample<L: SimdFloat<Scalar = S>>(
        &self,
        strength: S,
        lobe: &ReflectionLobe<S>,
        incident: Vec3<L>,
        n: Vec3<L>,
        uv: (L, L),
        fold: bool,
    ) -> BsdfSample<L> {
        let mirror = incident.reflect(n);
        let k = L::splat(strength);
        let (direction, weight) = match lobe {
            ReflectionLobe::Mirror => (mirror, k),
            ReflectionLobe::Cone { .. } | ReflectionLobe::Square { .. } => {
                (spread(lobe, mirror, uv), k)
            }
            ReflectionLobe::MicrofacetDistribution(facets) => {
                return self.sample_microfacet(k, facets, incident, n, uv);
            }
        };
        let up = direction.dot(n);
        let below = up.le(L::zero());
        let (direction, weight) = if fold {
            (Vec3::select(below, direction.reflect(n), direction), weight)
        } else {
            (direction, L::select(below, L::zero(), weight))
        };
        // The normal of the microfacet that reflects this ray is half-way between the direction to
        // the viewer and that of the reflected ray. The cosine of its angle to either direction is
        // half the length of the sum of both directions. This length has no cancellation at grazing
        // angles.
        let cos =
            || ((direction - incident).length_squared().sqrt() * L::from_f64(0.5)).min(L::one());
        BsdfSample { direction, weight: self.reflection_fresnel.times(cos, weight) }
    }

    /// Samples the reflection at a visible microfacet of `facets`. The weight of directions below
    /// the surface is 0, because G is zero there. For other directions it is f N.L / density = k F
    /// G / G_1, at most `k`. Here `k` is the `strength` of [`Bsdf::sample`], F the Fresnel
    /// reflectance, and G and G_1 are those of `MicrofacetEval`. The other parameters are those of
    /// [`Bsdf::sample`].
    #[inline(always)]
    fn sample_microfacet<L: SimdFloat<Scalar = S>>(
        &self,
        k: L,
        facets: &MicrofacetDistribution<S>,
        incident: Vec3<L>,
        n: Vec3<L>,
        uv: (L, L),
    ) -> BsdfSample<L> {
        let frame = Frame::around(n);
        let view = frame.to_local(-incident);
        let h = facets.sample_visible(uv, view);
        let vh = view.dot(h);
        let light = h * (vh + vh) - view;
        let valid = vh.gt(L::zero()) & light.z.gt(L::zero()) & view.z.gt(L::zero());
        let weight: L = k * facets.shadowing(h.z, view.z, light.z, vh);
        BsdfSample {
            direction: frame.to_world(light).renormalize(),
            weight: self.reflection_fresnel.times(|| vh, weight).masked(valid),
        }
    }

    /// Returns the density [1/sr] with which [`Bsdf::sample`] draws `direction` if its parameter
    /// `fold` is `false`, so that no directions are mirrored. Returns `None` for a mirror. All
    /// directions are unit vectors. The other parameters are those of [`Bsdf::sample`].
    #[inline(always)]
    pub fn density<L: SimdFloat<Scalar = S>>(
        &self,
        lobe: &ReflectionLobe<S>,
        incident: Vec3<L>,
        n: Vec3<L>,
        direction: Vec3<L>,
    ) -> Option<L> {
        let mirror = incident.reflect(n);
        match lobe {
            ReflectionLobe::Mirror => None,
            ReflectionLobe::Cone { one_minus_cos } => {
                Some(warp::cone_pdf(mirror, direction, L::splat(*one_minus_cos)))
            }
            ReflectionLobe::Square { side } => {
                let local = Frame::around(mirror.renormalize()).to_local(direction);
                Some(warp::square_pdf(local, L::splat(*side)))
            }
            ReflectionLobe::MicrofacetDistribution(facets) => {
                let h = direction - incident;
                let (nh, tan2) = along_tan2(h, n);
                let nv = -incident.dot(n);
                let d: L = facets.density(tan2);
                // The squared length of h is twice its dot product with the view.
                let visible: L = facets.visibility(nh, nv, h.length_squared() * L::from_f64(0.5));
                let density = d * visible / (nv * L::from_f64(4.0));
                Some(density.masked(nh.gt(L::zero()) & nv.gt(L::zero())))
            }
        }
    }

    /// Returns two values for light from `direction`: the value [1/sr] of the reflection lobe times
    /// the cosine between `direction` and the normal, and the density [1/sr] with which
    /// [`Bsdf::sample`] draws `direction`. The weight of a sample is the first value divided by the
    /// second. Both are zero for a mirror and for directions below the surface. The other
    /// parameters are those of [`Bsdf::sample`].
    #[inline(always)]
    pub fn evaluate_lobe<L: SimdFloat<Scalar = S>>(
        &self,
        strength: S,
        lobe: &ReflectionLobe<S>,
        incident: Vec3<L>,
        n: Vec3<L>,
        direction: Vec3<L>,
        fold: bool,
    ) -> (Vec3<L>, L) {
        let Some(mut density) = self.density(lobe, incident, n, direction) else {
            return (Vec3::zero(), L::zero());
        };
        let nl = direction.dot(n);
        let above = nl.gt(L::zero());
        let h = || direction - incident;
        let k = L::splat(strength);
        let value = if let ReflectionLobe::MicrofacetDistribution(facets) = lobe {
            let (h, nv) = (h(), -incident.dot(n));
            let (nh, tan2) = along_tan2(h, n);
            let (visible, total) =
                facets.masking(nh, nv, nl, h.length_squared() * L::from_f64(0.5));
            let d: L = facets.density(tan2);
            let value = d * visible * k * L::from_f64(0.25) / (nv * total);
            value.masked(nh.gt(L::zero()) & nv.gt(L::zero()))
        } else {
            if fold && let Some(mirrored) = self.density(lobe, incident, n, direction.reflect(n)) {
                density += mirrored;
            }
            k * density
        };
        let cos = || (h().length_squared().sqrt() * L::from_f64(0.5)).min(L::one());
        (self.reflection_fresnel.times(cos, value).masked(above), density.masked(above))
    }
}
