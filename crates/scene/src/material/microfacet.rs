//! Microfacet distributions, Beckmann and GGX, and their masking by V-cavities or by Smith's model.
//! `visible_normals.rs` samples them.

use crate::material::Masking;
use crate::material::visible_normals::{beckmann_visible, ggx_visible, ggx_visible_v_cavity};
use std::f64::consts::{FRAC_1_PI, PI};
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, Vec3, polynomial};

/// Smallest alpha of a microfacet distribution. A reflection lobe of smaller alpha is treated as a
/// mirror. Highlights of smaller alpha are computed with this value.
pub const SMOOTH_ALPHA: f64 = 1e-3;

/// Family of distributions of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FacetNormals {
    /// Beckmann distribution.
    Beckmann,
    /// GGX, also known as Trowbridge-Reitz.
    Ggx,
}

/// Distribution of microfacet normals, with its masking model.
#[derive(Clone, Copy, Debug)]
pub struct MicrofacetDistribution<S> {
    /// Family of the distribution.
    pub normals: FacetNormals,
    /// Roughness parameter alpha, at least [`SMOOTH_ALPHA`].
    pub alpha: S,
    alpha2: S,
    inverse_alpha2: S,
    /// Model of masking and shadowing.
    pub masking: Masking,
    /// Part of the reflection lobe that is left out; `None` for a whole lobe.
    hole: Option<Hole<S>>,
}

/// Reflection lobe of a smaller alpha that is left out of a lobe.
#[derive(Clone, Copy, Debug)]
struct Hole<S> {
    alpha2: S,
    inverse_alpha2: S,
    /// Share of the smaller lobe in the larger one.
    share: S,
}

/// Value of a = 1 / (alpha tan theta) from which on masking by microfacets is neglected; theta is
/// the angle between the direction and the surface normal. Beckmann's Lambda is below 3e-10 there.
const STEEP: f64 = 4.0;

/// Returns Beckmann's Lambda (erf(a) - 1) / 2 + exp(-a^2) / (2 a sqrt(pi)) for 0 < a < [`STEEP`]
/// (Heitz 2014, eq. 57); undefined for larger `a`.
///
/// Computed as exp(-a^2) k(a) / (2 a sqrt(pi) (1 + 2 a^2)). The function k is smooth, has values
/// between 0.6 and 1, and is approximated by a Chebyshev series of degree 10. Its variable is 2 - 6
/// / (a + 2), which is from -1 to 1 for these a. The error is below 1e-8 (1 + Lambda).
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
    let a2 = a * a;
    let below = a * a2.mul_add(L::from_f64(4.0 * PI.sqrt()), L::from_f64(2.0 * PI.sqrt()));
    (-a2).exp() * polynomial(&K, x) / below
}

impl<S: Float> MicrofacetDistribution<S> {
    /// Creates a distribution of `normals` with the roughness parameter `alpha`.
    pub fn new(normals: FacetNormals, alpha: f64, masking: Masking) -> Self {
        let alpha2 = alpha * alpha;
        let [alpha, alpha2, inverse_alpha2] = [alpha, alpha2, 1.0 / alpha2].map(S::from_f64);
        Self { normals, alpha, alpha2, inverse_alpha2, masking, hole: None }
    }

    /// Returns this distribution, for a reflection lobe without that of `inner`, and the share that is
    /// left out. `None` if the lobes are not nested.
    ///
    /// The share is the least ratio of the values of both lobes: that of D, alpha^2 / alpha'^2 at
    /// the normal, and for Smith's masking that of G, at least alpha / alpha' at grazing angles.
    pub(super) fn outside(&self, inner: &Self) -> Option<(Self, f64)> {
        let ratio = inner.alpha.to_f64() / self.alpha.to_f64();
        let share = S::from_f64(match self.masking {
            Masking::VCavity => ratio.powi(2),
            Masking::Smith => ratio.powi(3),
        });
        let alike = (self.normals, self.masking) == (inner.normals, inner.masking);
        let Self { alpha2, inverse_alpha2, .. } = *inner;
        let hole = Some(Hole { alpha2, inverse_alpha2, share });
        alike.then_some((Self { hole, ..*self }, share.to_f64()))
    }

    /// Returns `true` if a part of the reflection lobe is left out.
    #[inline(always)]
    pub(super) fn has_hole(&self) -> bool {
        self.hole.is_some()
    }

    /// Returns the factor of a sample or value of the reflection lobe that leaves out its hole. `tan2`
    /// is that of [`density`](Self::density), `cosines` are those of [`masking`](Self::masking).
    #[inline(always)]
    pub(super) fn rest<L: SimdFloat<Scalar = S>>(&self, tan2: L, cosines: [L; 4]) -> L {
        let Some(Hole { alpha2, inverse_alpha2, share }) = self.hole else { return L::one() };
        let inner = Self { alpha2, inverse_alpha2, hole: None, ..*self };
        let [nh, nv, nl, vh] = cosines;
        let [(visible, total), (inner_visible, inner_total)] =
            [self, &inner].map(|facets| facets.masking(nh, nv, nl, vh));
        let g = inner_visible * total / (visible * inner_total);
        let part = L::splat(share) * g * inner.density(tan2) / self.density(tan2);
        (L::one() - part).max(L::zero()) * L::from_f64(1.0 / (1.0 - share.to_f64()))
    }

    /// Samples a microfacet normal H that is visible from the direction `view` (V). Both are in the
    /// frame of the surface normal N. `u` and `v` are uniform in [0, 1). The density of H is G_1 D
    /// V.H / N.V, with G_1 of [`visibility`](Self::visibility) and D of [`density`](Self::density).
    #[inline(always)]
    pub fn sample_visible<L: SimdFloat<Scalar = S>>(
        &self,
        (u, v): (L, L),
        view: Vec3<L>,
    ) -> Vec3<L> {
        let alpha = L::splat(self.alpha);
        match (self.normals, self.masking) {
            (FacetNormals::Ggx, Masking::VCavity) => ggx_visible_v_cavity(u, v, alpha, view),
            (FacetNormals::Ggx, Masking::Smith) => ggx_visible(u, v, alpha, view),
            (FacetNormals::Beckmann, masking) => beckmann_visible(u, v, alpha, view, masking),
        }
    }

    /// Returns the density D of microfacet normals [1/sr]. `tan2` is the squared tangent of the
    /// angle between microfacet normal and surface normal.
    #[inline(always)]
    pub fn density<L: SimdFloat<Scalar = S>>(&self, tan2: L) -> L {
        let inverse_alpha2 = L::splat(self.inverse_alpha2);
        match self.normals {
            FacetNormals::Beckmann => beckmann_d(tan2, inverse_alpha2),
            FacetNormals::Ggx => ggx_d(tan2, inverse_alpha2),
        }
    }

    /// Returns the numerator and the denominator of G, the fraction of the microfacets with normal
    /// H that are visible both from the viewer V and from the light L. `nh`, `nv`, `nl` and `vh`
    /// are the positive cosines N.H, N.V, N.L and V.H. H need not be a unit vector: `nh` and `vh`
    /// may both be multiplied by its length.
    ///
    /// For V-cavities G is min(1, 2 N.H min(N.V, N.L) / V.H) (Torrance and Sparrow 1967). For
    /// height-correlated Smith masking it is 1 / (1 + Lambda(V) + Lambda(L)) (Heitz 2014,
    /// *Understanding the Masking-Shadowing Function*).
    #[inline(always)]
    pub fn masking<L: SimdFloat<Scalar = S>>(&self, nh: L, nv: L, nl: L, vh: L) -> (L, L) {
        match self.masking {
            Masking::VCavity => ((L::from_f64(2.0) * nh * nv.min(nl)).min(vh), vh),
            Masking::Smith => (L::one(), L::one() + self.lambda(nv) + self.lambda(nl)),
        }
    }

    /// Returns G_1, the fraction of the microfacets with normal H that are visible from the viewer,
    /// given the cosines that [`masking`](Self::masking) takes.
    #[inline(always)]
    pub fn visibility<L: SimdFloat<Scalar = S>>(&self, nh: L, nv: L, vh: L) -> L {
        match self.masking {
            Masking::VCavity => (L::from_f64(2.0) * nh * nv / vh).min(L::one()),
            Masking::Smith => L::one() / (L::one() + self.lambda(nv)),
        }
    }

    /// Returns G / G_1 in [0, 1], the weight of a reflected ray if visible normals are sampled and
    /// the reflectance is 1, given the cosines that [`masking`](Self::masking) takes.
    #[inline(always)]
    pub fn shadowing<L: SimdFloat<Scalar = S>>(&self, nh: L, nv: L, nl: L, vh: L) -> L {
        match self.masking {
            Masking::VCavity => {
                let twice = L::from_f64(2.0) * nh;
                let visible = (twice * nv).min(vh);
                (twice * nl).min(visible) / visible
            }
            Masking::Smith => {
                let visible = L::one() + self.lambda(nv);
                visible / (visible + self.lambda(nl))
            }
        }
    }

    /// Returns G / G_1 in [0, 1] of rays that are transmitted to the other side: the weight of a
    /// transmitted ray if visible normals are sampled and the transmittance is 1. `nh`, `nv` and
    /// `vh` are the cosines N.H, N.V and V.H; `nt` and `lh` are the positive cosines of the
    /// transmitted ray with -N and with -H.
    ///
    /// Let G_1' be the G_1 of the transmitted ray. The result is G_1' for Smith's masking (Walter et
    /// al. 2007, eq. 23). For V-cavities G is G_1 + G_1' - 1, because the sides of a groove that are
    /// visible from above and from below overlap (Heitz and d'Eon 2014).
    #[inline(always)]
    pub fn shadowing_behind<L: SimdFloat<Scalar = S>>(
        &self,
        nh: L,
        nv: L,
        vh: L,
        nt: L,
        lh: L,
    ) -> L {
        match self.masking {
            Masking::VCavity => {
                let visible = self.visibility(nh, nv, vh);
                let behind = self.visibility(nh, nt, lh);
                (L::one() - (L::one() - behind) / visible).max(L::zero())
            }
            Masking::Smith => L::one() / (L::one() + self.lambda(nt)),
        }
    }

    /// Returns the function Lambda of Smith's masking model for a direction whose angle theta from
    /// the surface normal has the cosine `c` > 0. It depends on a = 1 / (alpha tan theta).
    #[inline(always)]
    fn lambda<L: SimdFloat<Scalar = S>>(&self, c: L) -> L {
        let alpha2 = L::splat(self.alpha2);
        let (cos2, sin2) = (c * c, (L::one() - c * c).max(L::zero()));
        match self.normals {
            FacetNormals::Ggx => {
                ((alpha2 * sin2 / cos2 + L::one()).sqrt() - L::one()) * L::from_f64(0.5)
            }
            FacetNormals::Beckmann => {
                // In most packets every lane hits the surface so steeply that masking is neglected.
                let grazing = cos2.lt(sin2 * alpha2 * L::from_f64(STEEP * STEEP));
                if grazing.none() {
                    return L::zero();
                }
                beckmann_lambda(c / (alpha2 * sin2).sqrt()).masked(grazing)
            }
        }
    }
}

/// Returns the Beckmann distribution D [1/sr] of microfacet normals: exp(-tan2 / alpha^2) / (pi
/// alpha^2 cos^4). `tan2` is the squared tangent of the angle to the surface normal, with 1 / cos^2
/// = 1 + tan2. `inverse_alpha2` is 1 / alpha^2.
#[inline(always)]
fn beckmann_d<L: SimdFloat>(tan2: L, inverse_alpha2: L) -> L {
    let secant2 = tan2 + L::one();
    (-(tan2 * inverse_alpha2)).exp()
        * (secant2 * secant2)
        * (inverse_alpha2 * L::from_f64(FRAC_1_PI))
}

/// Returns the GGX distribution D [1/sr]: 1 / (pi alpha^2 cos^4 (1 + tan2 / alpha^2)^2), with the
/// parameters of [`beckmann_d`].
#[inline(always)]
fn ggx_d<L: SimdFloat>(tan2: L, inverse_alpha2: L) -> L {
    let ratio = (tan2 + L::one()) / (tan2 * inverse_alpha2 + L::one());
    ratio * ratio * (inverse_alpha2 * L::from_f64(FRAC_1_PI))
}
