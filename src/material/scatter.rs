//! What a finish does with light, in lanes: highlights of lights and directions of reflected rays.

use super::Masking;
use super::finish::{Facets, Finish, Shine, Spread};
use crate::lanes::{Frame, Lanes, Real, V3};
use crate::sampling::warp;
use std::f64::consts::FRAC_1_PI;

/// A reflected ray's direction and what its radiance counts.
#[derive(Clone, Copy, Debug)]
pub struct Reflected<L> {
    /// Unit direction.
    pub direction: V3<L>,
    /// Factor of the radiance that comes from there; zero: the ray is lost.
    pub weight: V3<L>,
}

/// Cosine and squared tangent of the angle between two unit vectors, the tangent from the part of
/// `h` across `n`, so that small angles keep their digits.
#[inline(always)]
fn cos_tan2<L: Lanes>(h: V3<L>, n: V3<L>) -> (L, L) {
    let cos = h.dot(n);
    let across = h - n * cos;
    (cos, across.length2() / (cos * cos))
}

/// Microfacet terms in a lane type.
pub trait FacetsOf<L: Lanes> {
    /// D [1/sr] for a facet normal at `cos`, `tan2` from the surface normal.
    fn density(&self, cos: L, tan2: L) -> L;
    /// G: the share of facets with normal h that both directions see. `nh`, `nv`, `nl`, `vh` are
    /// cosines, all positive.
    fn masking(&self, nh: L, nv: L, nl: L, vh: L) -> L;
    /// Smith's Lambda at cosine `c` > 0 from the normal.
    fn lambda(&self, c: L) -> L;
}

impl<L: Lanes> FacetsOf<L> for Facets<L::Scalar> {
    #[inline(always)]
    fn density(&self, cos: L, tan2: L) -> L {
        let alpha = L::splat(self.alpha);
        if self.ggx { warp::ggx_d(cos, tan2, alpha) } else { warp::beckmann_d(cos, tan2, alpha) }
    }

    /// Torrance and Sparrow 1967 (V-cavities); Heitz 2014, *Understanding the Masking-Shadowing
    /// Function* (height-correlated Smith).
    #[inline(always)]
    fn masking(&self, nh: L, nv: L, nl: L, vh: L) -> L {
        match self.masking {
            Masking::VCavity => (L::of(2.0) * nh * nv.min(nl) / vh.max(L::of(1e-30))).min(L::one()),
            Masking::Smith => L::one() / (L::one() + self.lambda(nv) + self.lambda(nl)),
        }
    }

    /// GGX exactly; Beckmann by the rational fit of Walter et al. 2007, eq. 27 (relative error below
    /// 0.35 %).
    #[inline(always)]
    fn lambda(&self, c: L) -> L {
        let alpha = L::splat(self.alpha);
        let tan2 = ((L::one() - c * c) / (c * c)).max(L::zero());
        if self.ggx {
            ((alpha * alpha).mul_add(tan2, L::one()).sqrt() - L::one()) * L::of(0.5)
        } else {
            let a = L::one() / (alpha * tan2.sqrt()).max(L::of(1e-18));
            let numerator = a.mul_add(a.mul_add(L::of(0.396), L::of(-1.259)), L::one());
            let fit = numerator / (a * a.mul_add(L::of(2.181), L::of(3.535)));
            L::select(a.lt(L::of(1.6)), fit, L::zero())
        }
    }
}

impl<S: Real> Finish<S> {
    /// Whether lights leave highlights on it.
    #[inline(always)]
    pub fn shines(&self) -> bool {
        !matches!(self.shine, Shine::None)
    }

    /// The highlight of a light: radiance towards `view` per irradiance of a surface that faces the
    /// light [1/sr] (so with the cosine of the incident light, where the formula has one).
    ///
    /// `n`, `view`, `light`: unit vectors away from the surface; `nl`, `nv`: their cosines.
    #[inline(always)]
    pub fn highlight<L: Lanes<Scalar = S>>(
        &self,
        n: V3<L>,
        view: V3<L>,
        light: V3<L>,
        nl: L,
        nv: L,
    ) -> V3<L> {
        match &self.shine {
            Shine::None => V3::zero(),
            Shine::Phong { strength, exponent } => {
                let r = -light.reflect(n);
                let cos = r.dot(view);
                let power = (cos.max(L::of(1e-30)).ln() * L::splat(*exponent)).exp();
                let value = L::splat(*strength) * power * L::of(FRAC_1_PI);
                let value = value.only(cos.gt(L::zero()));
                V3::new(value, value, value)
            }
            Shine::Facets { strength, facets } => {
                let h = (view + light).normalize();
                let (nh, tan2) = cos_tan2(h, n);
                let vh = view.dot(h);
                let d = facets.density(nh, tan2);
                let g: L = facets.masking(nh, nv, nl, vh);
                // f N.L = D G F / (4 N.V): the light's cosine cancels.
                let value = L::splat(*strength) * d * g / (L::of(4.0) * nv);
                let valid = nh.gt(L::zero()) & vh.gt(L::zero()) & nv.gt(L::zero());
                (self.reflectance.at(vh) * value).only(valid)
            }
        }
    }

    /// A reflected ray for the surface seen along `incident` (unit, towards the surface) with normal
    /// `n` on the viewer's side; `u`, `v` uniform in [0, 1). `fold`: lobes that dip under the surface
    /// are mirrored up, otherwise lost there.
    #[inline(always)]
    pub fn reflect<L: Lanes<Scalar = S>>(
        &self,
        strength: S,
        spread: &Spread<S>,
        incident: V3<L>,
        n: V3<L>,
        (u, v): (L, L),
        fold: bool,
    ) -> Reflected<L> {
        let mirror = incident.reflect(n);
        let k = L::splat(strength);
        let (direction, weight) = match spread {
            Spread::Mirror => (mirror, k),
            Spread::Cone { one_minus_cos } => {
                let local = warp::cone(u, v, L::splat(*one_minus_cos));
                (Frame::around(mirror.normalize()).to_world(local), k)
            }
            Spread::Square { side } => {
                let local = warp::square(u, v, L::splat(*side));
                (Frame::around(mirror.normalize()).to_world(local), k)
            }
            Spread::Facets(facets) => return self.facet(k, facets, incident, n, (u, v)),
        };
        let up = direction.dot(n);
        let below = up.le(L::zero());
        let (direction, weight) = if fold {
            (V3::select(below, direction.reflect(n), direction), weight)
        } else {
            (direction, L::select(below, L::zero(), weight))
        };
        if self.reflectance.is_white() {
            return Reflected { direction, weight: V3::new(weight, weight, weight) };
        }
        // The facet that would send this ray: half-way between view and reflected direction, whose
        // cosine with either is half the length of their sum (without cancellation at grazing angles).
        let cos = (direction - incident).length2().sqrt() * L::of(0.5);
        let f = self.reflectance.at(cos.min(L::one()));
        Reflected { direction, weight: f * weight }
    }

    /// Reflection at a sampled microfacet. Below the surface G is zero, and so is the weight.
    #[inline(always)]
    fn facet<L: Lanes<Scalar = S>>(
        &self,
        k: L,
        facets: &Facets<S>,
        incident: V3<L>,
        n: V3<L>,
        (u, v): (L, L),
    ) -> Reflected<L> {
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
        let g: L = facets.masking(h.z, view.z, light.z, vh);
        let weight = if facets.ggx {
            // Visible normals: density D G1 V.H / N.V, so that f N.L / density = F G / G1.
            k * g * (L::one() + FacetsOf::<L>::lambda(facets, view.z))
        } else {
            // Normals by D N.H: f N.L / density = F G V.H / (N.V N.H).
            k * g * vh / (view.z * h.z)
        };
        let valid = vh.gt(L::zero()) & light.z.gt(L::zero()) & view.z.gt(L::zero());
        Reflected {
            direction: frame.to_world(light).normalize(),
            weight: (self.reflectance.at(vh) * weight).only(valid),
        }
    }

    /// Density [1/sr] with which [`Finish::reflect`] draws `direction` before folding, one lane at a
    /// time, in double precision: what tests integrate. `None` for a mirror.
    pub fn density(
        &self,
        spread: &Spread<S>,
        incident: V3<f64>,
        n: V3<f64>,
        direction: V3<f64>,
    ) -> Option<f64> {
        let mirror = incident.reflect(n);
        match spread {
            Spread::Mirror => None,
            Spread::Cone { one_minus_cos } => {
                Some(warp::cone_pdf(mirror.dot(direction), one_minus_cos.to_f64()))
            }
            Spread::Square { side } => {
                let local = Frame::around(mirror).to_local(direction);
                Some(warp::square_pdf([local.x, local.y, local.z], side.to_f64()))
            }
            Spread::Facets(facets) => {
                let facets = Facets {
                    ggx: facets.ggx,
                    alpha: facets.alpha.to_f64(),
                    masking: facets.masking,
                };
                let view = -incident;
                let h = (view + direction).normalize();
                let (nh, tan2) = cos_tan2(h, n);
                let vh = view.dot(h);
                if nh <= 0.0 || vh <= 0.0 {
                    return Some(0.0);
                }
                let d = facets.density(nh, tan2);
                let nv = view.dot(n);
                Some(if facets.ggx {
                    d / ((1.0 + FacetsOf::<f64>::lambda(&facets, nv)) * 4.0 * nv)
                } else {
                    d * nh / (4.0 * vh)
                })
            }
        }
    }
}
