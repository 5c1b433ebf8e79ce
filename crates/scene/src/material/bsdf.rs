//! Compiled BSDF: its construction from a material, highlights, and the reflection lobe with
//! `sample`, `eval`, `pdf` and `is_delta`. `rough_interface.rs` adds transmission.

use crate::material::fresnel::Reflectance;
use crate::material::microfacet::{FacetNormals, MicrofacetDistribution, SMOOTH_ALPHA};
use crate::material::{Fresnel, Highlight, Lobe, Material};
use std::f64::consts::FRAC_1_PI;
use zerkalo_kernel::lanes::{Float, Frame, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;

/// Largest Phong exponent alpha for which the power cos^alpha is computed from a cosine, with a
/// relative error of about alpha times 1.5e-7 in single precision. For larger exponents the power is
/// computed from a tangent.
const SHARP_EXPONENT: f64 = 1024.0;

/// Model of highlights, the reflections of lights in a surface.
#[derive(Clone, Copy, Debug)]
pub enum SpecularModel<S> {
    /// No highlights.
    None,
    /// Phong's model: k_s (R.V)^alpha / pi, with mirrored light direction R and view direction V.
    Phong {
        /// Specular coefficient k_s.
        strength: S,
        /// Exponent alpha.
        exponent: S,
        /// `true` if alpha exceeds `SHARP_EXPONENT`.
        sharp: bool,
    },
    /// Microfacet model: k_s D G F / (4 N.L N.V), with distribution D, masking G and Fresnel F.
    Microfacet {
        /// Specular coefficient k_s.
        strength: S,
        /// Distribution that gives D and G.
        facets: MicrofacetDistribution<S>,
    },
}

/// Distribution of the directions of reflected rays about the mirror direction, and of transmitted
/// rays about the refracted direction.
#[derive(Clone, Copy, Debug)]
pub enum ReflectionLobe<S> {
    /// Mirror or clear glass: no spread.
    Mirror,
    /// Uniform directions in a cone.
    Cone {
        /// 1 - cos of the cone's half-angle.
        one_minus_cos: S,
        /// 1 - cos of the half-angle of the cone of `evaluated_roughness`.
        evaluated: S,
        /// Share of the solid angle, around the axis, that is left out; 0 for a whole cone.
        hole: S,
    },
    /// Directions through uniform points of a square that is perpendicular to the axis and centred
    /// on it, at distance 1.
    Square {
        /// Side length of the square.
        side: S,
        /// Side length of the square of `evaluated_roughness`.
        evaluated: S,
        /// Share of the area, around the centre, that is left out; 0 for a whole square.
        hole: S,
    },
    /// Reflection and refraction at visible microfacets.
    Microfacet(MicrofacetDistribution<S>),
}

impl<S> ReflectionLobe<S> {
    /// Returns the microfacets of the lobe; `None` for lobes without microfacets.
    #[inline(always)]
    pub(super) fn facets(&self) -> Option<&MicrofacetDistribution<S>> {
        match self {
            Self::Microfacet(facets) => Some(facets),
            Self::Mirror | Self::Cone { .. } | Self::Square { .. } => None,
        }
    }
}

/// Transmission of light through a surface.
#[derive(Clone, Copy, Debug)]
pub struct Transmission<S> {
    /// Transmission coefficient k_t.
    pub strength: S,
    /// Index of refraction inside the solid that the surface bounds.
    pub index: S,
    /// Absorption coefficients [1 / scene unit] inside the solid; 0 absorbs nothing.
    pub absorption: [S; 3],
    /// `true` if Fresnel's equations split the light; `false` if k_r and k_t alone are the weights.
    pub dielectric: bool,
}

/// BSDF: a material compiled for the kernels.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf<S> {
    /// Ambient coefficient times the material's colour.
    pub ambient: [S; 3],
    /// Diffuse coefficient times the material's colour.
    pub diffuse: [S; 3],
    /// Model of highlights.
    pub specular: SpecularModel<S>,
    /// Reflection coefficient k_r; `None` if the material reflects no rays.
    pub reflection: Option<S>,
    /// Transmission through the surface; `None` if the material is opaque.
    pub transmission: Option<Transmission<S>>,
    /// Distribution of reflected and transmitted rays.
    pub lobe: ReflectionLobe<S>,
    /// Fresnel reflectance of the microfacets in a highlight.
    pub highlight_fresnel: Reflectance<S>,
    /// Fresnel reflectance of reflected rays. It is 1 for a transparent dielectric: its interface
    /// computes the reflectance at each hit, because that depends on the medium on the other side.
    pub reflection_fresnel: Reflectance<S>,
    /// `true` if the surface has a diffuse part or highlights.
    pub has_direct: bool,
    /// `false` if the back has no diffuse part, no highlights and no reflection lobe.
    pub two_sided: bool,
}

/// Returns 1 - cos(atan(r)), computed without cancellation: r^2 / (1 + r^2 + sqrt(1 + r^2)).
fn one_minus_cos_of_tan(r: f64) -> f64 {
    let square = r * r;
    if square.is_infinite() { 1.0 } else { square / (1.0 + square + (1.0 + square).sqrt()) }
}

/// Returns the roughness with which the lobes `Cone` and `Square` of the roughness `r` are evaluated:
/// larger by the rounding errors of sampled directions, which would otherwise have the density 0.
/// At larger roughness, where the errors lose less than 1 in 10,000 samples, it is `r` itself.
fn evaluated_roughness<S: Float>(r: f64) -> f64 {
    if r < S::EPSILON * f64::from(1 << 14) { r + 8.0 * S::EPSILON } else { r }
}

impl<S: Float> Bsdf<S> {
    /// Compiles `material`; without reflection and transmission if `reflects` is `false`.
    pub fn new(material: &Material, reflects: bool) -> Self {
        let alpha = material.microfacet_alpha().max(SMOOTH_ALPHA);
        let normals = match material.lobe {
            Lobe::Ggx => FacetNormals::Ggx,
            Lobe::Mirror | Lobe::Cone | Lobe::Square | Lobe::Beckmann => FacetNormals::Beckmann,
        };
        let facets = MicrofacetDistribution::new(normals, alpha, material.masking);
        let strength = S::from_f64(material.specular);
        let specular = match material.highlight {
            _ if material.specular == 0.0 => SpecularModel::None,
            Highlight::Phong => SpecularModel::Phong {
                strength,
                exponent: S::from_f64(material.exponent),
                sharp: material.exponent > SHARP_EXPONENT,
            },
            Highlight::CookTorrance => SpecularModel::Microfacet { strength, facets },
        };
        let r = material.roughness;
        let hole = S::default();
        let wide = evaluated_roughness::<S>(r);
        let cone = |r| S::from_f64(one_minus_cos_of_tan(r));
        let side = |r| S::from_f64(std::f64::consts::PI.sqrt() * r);
        let lobe = match material.lobe {
            Lobe::Mirror => ReflectionLobe::Mirror,
            Lobe::Cone | Lobe::Square if r == 0.0 => ReflectionLobe::Mirror,
            Lobe::Cone => {
                ReflectionLobe::Cone { one_minus_cos: cone(r), evaluated: cone(wide), hole }
            }
            Lobe::Square => ReflectionLobe::Square { side: side(r), evaluated: side(wide), hole },
            Lobe::Beckmann | Lobe::Ggx if material.microfacet_alpha() < SMOOTH_ALPHA => {
                ReflectionLobe::Mirror
            }
            Lobe::Beckmann | Lobe::Ggx => ReflectionLobe::Microfacet(facets),
        };
        let (k_r, k_t) = (material.reflection, material.transmission);
        let dielectric = material.fresnel_mode() == Fresnel::Dielectric;
        let transmission = (reflects && k_t > 0.0).then(|| Transmission {
            strength: S::from_f64(k_t),
            index: S::from_f64(material.ior),
            absorption: material.absorption().map(S::from_f64),
            dielectric,
        });
        let reflectance = Reflectance::new(material);
        let shared = dielectric && transmission.is_some();
        let black = material.diffuse == 0.0 || material.color.0 == [0.0; 3];
        Self {
            ambient: material.color.0.map(|c| S::from_f64(c * material.ambient)),
            diffuse: material.color.0.map(|c| S::from_f64(c * material.diffuse)),
            specular,
            reflection: (reflects && k_r > 0.0).then(|| S::from_f64(k_r)),
            transmission,
            lobe,
            highlight_fresnel: reflectance,
            reflection_fresnel: if shared { Reflectance::white() } else { reflectance },
            has_direct: !black || material.specular != 0.0,
            two_sided: material.two_sided,
        }
    }
}

/// Incident rays at surfaces, for which a BSDF is sampled or evaluated.
#[derive(Clone, Copy, Debug)]
pub struct BsdfQuery<L> {
    /// Unit direction of the incident rays, towards the surface.
    pub incident: Vec3<L>,
    /// Unit normal on the side of the incident rays.
    pub normal: Vec3<L>,
    /// Treatment of sampled directions of a cone or square that point below the surface: `true`
    /// mirrors them at the surface; `false` absorbs them.
    pub fold: bool,
}

/// Sampled reflected ray.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample<L> {
    /// Unit direction of the reflected ray.
    pub direction: Vec3<L>,
    /// Factor by which the radiance from `direction` is multiplied; zero if nothing is reflected
    /// from there.
    pub weight: Vec3<L>,
}

/// Value of a BSDF for light from one direction. The weight of a sample in this direction is
/// `value` divided by `density`.
#[derive(Clone, Copy, Debug)]
pub struct BsdfValue<L> {
    /// BSDF [1/sr] times the cosine of the angle of incidence.
    pub value: Vec3<L>,
    /// Density [1/sr] with which the direction is sampled.
    pub density: L,
}

/// Returns the component of `h`, of any length, along the unit vector `n`, and the squared tangent
/// of the angle between them. The tangent is computed from the part of `h` perpendicular to `n`,
/// which keeps full precision at small angles. It is at most 1e15, so that formulas stay finite.
#[inline(always)]
pub(super) fn along_tan2<L: SimdFloat>(h: Vec3<L>, n: Vec3<L>) -> (L, L) {
    let along = h.dot(n);
    let across = h - n * along;
    (along, (across.length_squared() / (along * along)).min(L::from_f64(1e15)))
}

/// Returns `cos`^alpha for a cosine computed from unit vectors; 0 for angles of 90 degrees and more.
/// The cosine is clamped to 1, which the dot product of rounded unit vectors may exceed.
#[inline(always)]
fn cosine_power<L: SimdFloat>(cos: L, alpha: L) -> L {
    let power = (cos.max(L::from_f64(1e-30)).min(L::one()).ln() * alpha).exp();
    power.masked(cos.gt(L::zero()))
}

/// Returns cos^alpha for the angle between the vectors `a` and `b`, which may have any lengths. The
/// result is 0 for angles of 90 degrees and more. The formula is for alpha above [`SHARP_EXPONENT`].
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

/// Samples a unit vector of the lobe `Cone` or `Square` about `axis`, whose length is 1 within
/// rounding errors. Returns `axis` for other lobes.
#[inline(always)]
pub(super) fn spread<L: SimdFloat>(
    lobe: &ReflectionLobe<L::Scalar>,
    axis: Vec3<L>,
    (u, v): (L, L),
) -> Vec3<L> {
    let outside = |hole: &L::Scalar| {
        if *hole > L::Scalar::default() { warp::outside(u, v, L::splat(*hole)) } else { (u, v) }
    };
    let local = match lobe {
        ReflectionLobe::Cone { one_minus_cos, hole, .. } => {
            let (u, v) = outside(hole);
            warp::cone(u, v, L::splat(*one_minus_cos))
        }
        ReflectionLobe::Square { side, hole, .. } => {
            let (u, v) = outside(hole);
            warp::square(u, v, L::splat(*side))
        }
        ReflectionLobe::Mirror | ReflectionLobe::Microfacet(_) => return axis,
    };
    Frame::around(axis.renormalize()).to_world(local)
}

/// Returns the density [1/sr] of a lobe without the share `hole` at its centre. `pdf` is that of the
/// whole lobe, `inner` returns that of its centre.
#[inline(always)]
fn outside_pdf<L: SimdFloat>(pdf: L, hole: L::Scalar, inner: impl FnOnce(f64) -> L) -> L {
    let hole = hole.to_f64();
    if hole == 0.0 {
        return pdf;
    }
    (pdf * L::from_f64(1.0 / (1.0 - hole))).masked(inner(hole).le(L::zero()))
}

impl<S: Float> Bsdf<S> {
    /// Returns this BSDF without the part of its lobe that the narrower lobe of `inner` covers, and
    /// the share of that part. `None` if the lobes are not nested.
    ///
    /// The lobe is then `share` times that of `inner` plus `1 - share` times the returned one.
    pub fn outside(&self, inner: &Self) -> Option<(Self, f64)> {
        let (mut lobe, share) = (self.lobe, |inner: S, outer: S| inner.to_f64() / outer.to_f64());
        let share = match (&mut lobe, &inner.lobe) {
            (
                ReflectionLobe::Cone { one_minus_cos, hole, .. },
                ReflectionLobe::Cone { one_minus_cos: inner, .. },
            ) => {
                *hole = S::from_f64(share(*inner, *one_minus_cos));
                hole.to_f64()
            }
            (
                ReflectionLobe::Square { side, hole, .. },
                ReflectionLobe::Square { side: inner, .. },
            ) => {
                *hole = S::from_f64(share(*inner, *side).powi(2));
                hole.to_f64()
            }
            (ReflectionLobe::Microfacet(facets), ReflectionLobe::Microfacet(inner)) => {
                let (rest, share) = facets.outside(inner)?;
                *facets = rest;
                share
            }
            (
                ReflectionLobe::Mirror
                | ReflectionLobe::Cone { .. }
                | ReflectionLobe::Square { .. }
                | ReflectionLobe::Microfacet(_),
                _,
            ) => return None,
        };
        (share > 0.0 && share < 1.0).then_some((Self { lobe, ..*self }, share))
    }

    /// Returns `true` if the surface has highlights.
    #[inline(always)]
    pub fn has_highlight(&self) -> bool {
        !matches!(self.specular, SpecularModel::None)
    }

    /// Returns `true` if a reflected ray shows what the highlight shows: both are of the same
    /// microfacets. The highlight is then left to lights that no reflected ray can hit.
    pub fn reflects_highlight(&self) -> bool {
        matches!(self.specular, SpecularModel::Microfacet { .. })
            && matches!(self.lobe, ReflectionLobe::Microfacet(_))
            && self.reflection.is_some()
    }

    /// Returns `true` if the surface bounds a solid that absorbs light.
    pub fn absorbs(&self) -> bool {
        let absorption = self.transmission.map(|t| t.absorption.map(S::to_f64));
        absorption.is_some_and(|absorption| absorption != [0.0; 3])
    }

    /// Returns `true` if all reflected and transmitted rays have the same direction.
    #[inline(always)]
    pub fn is_delta(&self) -> bool {
        matches!(self.lobe, ReflectionLobe::Mirror)
    }

    /// Returns the reflection coefficient k_r, or 0.
    #[inline(always)]
    pub(super) fn strength<L: SimdFloat<Scalar = S>>(&self) -> L {
        L::splat(self.reflection.unwrap_or_default())
    }

    /// Returns the highlight [1/sr] of a light in the unit direction `light`: the radiance that is
    /// reflected divided by the irradiance at normal incidence. The value includes the cosine of
    /// the angle of incidence in the microfacet model; Phong's model has no such factor.
    #[inline(always)]
    pub fn highlight<L: SimdFloat<Scalar = S>>(
        &self,
        query: &BsdfQuery<L>,
        light: Vec3<L>,
    ) -> Vec3<L> {
        let (n, view) = (query.normal, -query.incident);
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
                Vec3::gray(L::splat(*strength) * power * L::from_f64(FRAC_1_PI))
            }
            SpecularModel::Microfacet { strength, facets } => {
                let (nl, nv) = (n.dot(light), n.dot(view));
                // The half vector is not normalised: its squared length is twice its dot product
                // with `view` or with `light`.
                let h = view + light;
                let (nh, tan2) = along_tan2(h, n);
                let h2 = h.length_squared();
                let (visible, total) = facets.masking(nh, nv, nl, h2 * L::from_f64(0.5));
                // Cook-Torrance times the cosine of incidence: D G F / (4 N.V), in which N.L has cancelled.
                let d = facets.density(tan2);
                let k = L::from_f64(0.25 * strength.to_f64());
                let value = d * visible * k / (nv * total);
                let valid = nh.gt(L::zero()) & nv.gt(L::zero());
                self.highlight_fresnel.times(|| h2.sqrt() * L::from_f64(0.5), value).masked(valid)
            }
        }
    }

    /// Samples a reflected ray. Its weight is the product of k_r, the Fresnel reflectance and, for
    /// microfacets, the shadowing G / G_1. `uv` are uniform in [0, 1).
    #[inline(always)]
    pub fn sample<L: SimdFloat<Scalar = S>>(
        &self,
        query: &BsdfQuery<L>,
        uv: (L, L),
    ) -> BsdfSample<L> {
        let BsdfQuery { incident, normal: n, fold } = *query;
        if let Some(facets) = self.lobe.facets() {
            return self.sample_microfacet(facets, query, uv);
        }
        let direction = spread(&self.lobe, incident.reflect(n), uv);
        let weight = self.strength();
        let up = direction.dot(n);
        let below = up.le(L::zero());
        let (direction, weight) = if fold {
            (Vec3::select(below, direction.reflect(n), direction), weight)
        } else {
            (direction, L::select(below, L::zero(), weight))
        };
        // The cosine of the angle between either direction and the normal half-way between both is
        // half the length of their sum, without cancellation at grazing angles.
        let cos =
            || ((direction - incident).length_squared().sqrt() * L::from_f64(0.5)).min(L::one());
        BsdfSample { direction, weight: self.reflection_fresnel.times(cos, weight) }
    }

    /// Samples the reflection at a visible microfacet of `facets`. The weight of directions below
    /// the surface is 0, because G is zero there. For other directions it is the BSDF times N.L /
    /// density, which is k_r F G / G_1.
    #[inline(always)]
    fn sample_microfacet<L: SimdFloat<Scalar = S>>(
        &self,
        facets: &MicrofacetDistribution<S>,
        query: &BsdfQuery<L>,
        uv: (L, L),
    ) -> BsdfSample<L> {
        let frame = Frame::around(query.normal);
        let view = frame.to_local(-query.incident);
        let h = facets.sample_visible(uv, view);
        let vh = view.dot(h);
        let light = h * (vh + vh) - view;
        let valid = vh.gt(L::zero()) & light.z.gt(L::zero()) & view.z.gt(L::zero());
        let mut weight = self.strength::<L>() * facets.shadowing(h.z, view.z, light.z, vh);
        if facets.has_hole() {
            let tan2 = (L::one() - h.z * h.z).max(L::zero()) / (h.z * h.z);
            weight *= facets.rest(tan2, [h.z, view.z, light.z, vh]);
        }
        BsdfSample {
            direction: frame.to_world(light).renormalize(),
            weight: self.reflection_fresnel.times(|| vh, weight).masked(valid),
        }
    }

    /// Returns the density [1/sr] with which [`Bsdf::sample`] draws `direction`; 0 for a mirror. If
    /// `fold` is `false`, this includes directions below the surface, whose weight is 0.
    #[inline(always)]
    pub fn pdf<L: SimdFloat<Scalar = S>>(&self, query: &BsdfQuery<L>, direction: Vec3<L>) -> L {
        let density = self.unfolded_pdf(query, direction);
        if !query.fold || self.lobe.facets().is_some() {
            return density;
        }
        density + self.unfolded_pdf(query, direction.reflect(query.normal))
    }

    /// Returns the density [1/sr] before directions below the surface are mirrored.
    #[inline(always)]
    fn unfolded_pdf<L: SimdFloat<Scalar = S>>(
        &self,
        query: &BsdfQuery<L>,
        direction: Vec3<L>,
    ) -> L {
        let BsdfQuery { incident, normal: n, .. } = *query;
        let mirror = incident.reflect(n);
        match &self.lobe {
            ReflectionLobe::Mirror => L::zero(),
            ReflectionLobe::Cone { evaluated, hole, .. } => {
                let pdf = |size: S| warp::cone_pdf(mirror, direction, L::splat(size));
                outside_pdf(pdf(*evaluated), *hole, |hole| {
                    pdf(S::from_f64(evaluated.to_f64() * hole))
                })
            }
            ReflectionLobe::Square { evaluated, hole, .. } => {
                let local = Frame::around(mirror.renormalize()).to_local(direction);
                let pdf = |side: S| warp::square_pdf(local, L::splat(side));
                let inner = |hole: f64| pdf(S::from_f64(evaluated.to_f64() * hole.sqrt()));
                outside_pdf(pdf(*evaluated), *hole, inner)
            }
            ReflectionLobe::Microfacet(facets) => {
                let h = direction - incident;
                let (nh, tan2) = along_tan2(h, n);
                let nv = -incident.dot(n);
                let d = facets.density(tan2);
                // The squared length of h is twice its dot product with the view.
                let visible = facets.visibility(nh, nv, h.length_squared() * L::from_f64(0.5));
                let density = d * visible / (nv * L::from_f64(4.0));
                density.masked(nh.gt(L::zero()) & nv.gt(L::zero()))
            }
        }
    }

    /// Returns the value and the density of the reflection lobe for light from `direction`: zero for
    /// a mirror and for directions below the surface.
    #[inline(always)]
    pub fn eval<L: SimdFloat<Scalar = S>>(
        &self,
        query: &BsdfQuery<L>,
        direction: Vec3<L>,
    ) -> BsdfValue<L> {
        let BsdfQuery { incident, normal: n, .. } = *query;
        let density = self.pdf(query, direction);
        let nl = direction.dot(n);
        let above = nl.gt(L::zero());
        let h = direction - incident;
        let k = self.strength::<L>();
        let value = match self.lobe.facets() {
            None => k * density,
            Some(facets) => {
                let nv = -incident.dot(n);
                let (nh, tan2) = along_tan2(h, n);
                let vh = h.length_squared() * L::from_f64(0.5);
                let (visible, total) = facets.masking(nh, nv, nl, vh);
                let d = facets.density(tan2);
                let mut value = d * visible * k * L::from_f64(0.25) / (nv * total);
                if facets.has_hole() {
                    value *= facets.rest(tan2, [nh, nv, nl, vh]);
                }
                value.masked(nh.gt(L::zero()) & nv.gt(L::zero()))
            }
        };
        let cos = || (h.length_squared().sqrt() * L::from_f64(0.5)).min(L::one());
        BsdfValue {
            value: self.reflection_fresnel.times(cos, value).masked(above),
            density: density.masked(above),
        }
    }
}
