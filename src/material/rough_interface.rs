//! Reflection and transmission at rough interfaces.
//!
//! Microfacets reflect and refract like clear glass, each by its own normal (Walter et al. 2007,
//! *Microfacet Models for Refraction through Rough Surfaces*). The lobes `cone` and `square` are spread
//! about the refracted direction as they are about the mirror direction.

use crate::lanes::{Float, Frame, Mask, SimdFloat, Vec3};
use crate::material::bsdf::{Bsdf, ReflectionLobe, Transmission, along_tan2, spread};
use crate::material::microfacet::{MicrofacetDistribution, MicrofacetEval};
use crate::material::refraction::Interface;
use crate::sampling::warp;

/// Media on both sides of an interface, and the side from which rays arrive.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceMedia<L: SimdFloat> {
    /// Index of refraction on the side of the incident rays.
    pub n_i: L,
    /// Index of refraction behind the interface. For a thin surface, that of its material.
    pub n_t: L,
    /// Lanes whose rays arrive from outside of the solid.
    pub outer: L::Mask,
    /// Lanes of thin surfaces, which bound no solid and do not refract.
    pub thin: L::Mask,
}

impl<L: SimdFloat> InterfaceMedia<L> {
    /// Lanes with equal indices of refraction on both sides. Rays are not refracted there, even by
    /// a rough surface.
    #[inline(always)]
    fn same(&self) -> L::Mask {
        (self.n_i.le(self.n_t) & self.n_t.le(self.n_i)).and_not(self.thin)
    }
}

/// Directions and weights of the reflected and transmitted rays at a rough interface.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceSample<L> {
    /// Unit direction of the reflected ray.
    pub reflected: Vec3<L>,
    /// Factor of the radiance from `reflected`.
    pub reflected_weight: Vec3<L>,
    /// Unit direction of the transmitted ray.
    pub transmitted: Vec3<L>,
    /// Factor of the radiance from `transmitted`.
    pub transmitted_weight: L,
}

impl<S: Float> Bsdf<S> {
    /// Samples a reflected and a transmitted ray at an interface whose [`lobe`](Transmission::lobe)
    /// is not a mirror. Both use the same numbers `uv`, uniform in [0, 1). `incident` is the unit
    /// direction towards the surface, and `n` is the normal on the viewer's side. `reflecting`
    /// selects the lanes in which the BSDF's reflection is included; total internal reflection is
    /// included in all lanes.
    ///
    /// Directions of the lobes `cone` and `square` on the wrong side of the surface are mirrored to
    /// the right one if `fold` is `true`; otherwise their weight is 0. Like clear glass, a rough
    /// interface does not scale radiance by the squared index.
    #[inline(always)]
    pub fn sample_interface<L: SimdFloat<Scalar = S>>(
        &self,
        transmission: &Transmission<S>,
        media: &InterfaceMedia<L>,
        (incident, n): (Vec3<L>, Vec3<L>),
        uv: (L, L),
        (reflecting, fold): (L::Mask, bool),
    ) -> InterfaceSample<L> {
        let (zero, one) = (L::zero(), L::one());
        let strength = self.reflection.map_or(S::default(), |(strength, _)| strength);
        let k_r = L::splat(strength).masked(reflecting);
        let same = media.same();
        if let ReflectionLobe::MicrofacetDistribution(facets) = &transmission.lobe {
            let frame = Frame::around(n);
            let view = frame.to_local(-incident);
            let local = facets.sample_visible(uv, view);
            let (h, vh, nv, nh) =
                (frame.to_world(local).renormalize(), view.dot(local), view.z, local.z);
            let interface = Interface::new(incident, h, media.n_i, media.n_t);
            let shares = interface.split_at(transmission, media.outer, media.thin);
            let valid = vh.gt(zero) & nv.gt(zero);
            let reflected = h.mul_add(vh + vh, incident).renormalize();
            let nl = reflected.dot(n);
            let shadowing: L = facets.shadowing(nh, nv, nl, vh).masked(valid & nl.gt(zero));
            let fresnel = self.reflection_fresnel.times(|| vh, k_r * shares.reflected * shadowing);
            let tir = shares.tir * shadowing;
            let mirrored = n.mul_add(nl * L::from_f64(-2.0), reflected);
            let transmitted = Vec3::select(media.thin, mirrored, interface.refracted);
            let (nt, lh) = (-transmitted.dot(n), -transmitted.dot(h));
            let behind: L = facets.shadowing_behind((nh, nv, vh), (nt, lh));
            let behind = behind.masked(valid & nt.gt(zero) & lh.gt(zero));
            let passed = L::select(same, one, L::select(media.thin, shadowing, behind));
            return InterfaceSample {
                reflected,
                reflected_weight: fresnel + Vec3::new(tir, tir, tir),
                transmitted,
                transmitted_weight: shares.transmitted * passed,
            };
        }
        let interface = Interface::new(incident, n, media.n_i, media.n_t);
        let shares = interface.split_at(transmission, media.outer, media.thin);
        let sample = self.sample(strength, &transmission.lobe, incident, n, uv, fold);
        let kept = one.masked(sample.direction.dot(n).gt(zero));
        let tir = shares.tir * kept;
        let reflection = sample.weight.masked(reflecting) * shares.reflected;
        let straight = Vec3::select(media.thin, incident, interface.refracted);
        let direction = spread(&transmission.lobe, straight, uv);
        let wrong = direction.dot(n).ge(zero);
        let (direction, passed) = if fold {
            (Vec3::select(wrong, direction.reflect(n), direction), one)
        } else {
            (direction, one.masked(!wrong))
        };
        InterfaceSample {
            reflected: sample.direction,
            reflected_weight: reflection + Vec3::new(tir, tir, tir),
            transmitted: Vec3::select(same, incident, direction),
            transmitted_weight: shares.transmitted * L::select(same, one, passed),
        }
    }

    /// Returns the density [1/sr] with which [`Bsdf::sample_interface`] draws the transmitted ray
    /// `direction`, before directions on the wrong side are mirrored. The density is the largest
    /// finite number where all rays have the same direction. All directions are unit vectors.
    #[inline(always)]
    pub fn transmission_density<L: SimdFloat<Scalar = S>>(
        &self,
        transmission: &Transmission<S>,
        media: &InterfaceMedia<L>,
        (incident, n): (Vec3<L>, Vec3<L>),
        direction: Vec3<L>,
    ) -> L {
        let axis = || {
            let interface = Interface::new(incident, n, media.n_i, media.n_t);
            Vec3::select(media.thin, incident, interface.refracted).renormalize()
        };
        let density = match &transmission.lobe {
            ReflectionLobe::Mirror => L::from_f64(L::MAX),
            ReflectionLobe::Cone { one_minus_cos } => {
                warp::cone_pdf(axis(), direction, L::splat(*one_minus_cos))
            }
            ReflectionLobe::Square { side } => {
                let local = Frame::around(axis()).to_local(direction);
                warp::square_pdf(local, L::splat(*side))
            }
            ReflectionLobe::MicrofacetDistribution(facets) => {
                microfacet_density(facets, media, (incident, n), direction)
            }
        };
        L::select(media.same(), L::from_f64(L::MAX), density)
    }
}

/// Returns the density [1/sr] of rays that visible microfacets transmit into `direction`.
///
/// The half vector of refraction is n_i V + n_t L, and its solid angle per solid angle of L is n_t^2 L.h /
/// |n_i V + n_t L|^2 (Walter et al. 2007, eq. 16 and 17). Thin surfaces mirror the reflected ray to the
/// other side.
#[inline(always)]
fn microfacet_density<L: SimdFloat>(
    facets: &MicrofacetDistribution<L::Scalar>,
    media: &InterfaceMedia<L>,
    (incident, n): (Vec3<L>, Vec3<L>),
    direction: Vec3<L>,
) -> L {
    let refracted = direction * media.n_t - incident * media.n_i;
    let reflected = direction.reflect(n) - incident;
    let half = Vec3::select(media.thin, reflected, refracted);
    // Towards the viewer's side.
    let half = half * L::one().copysign(half.dot(n));
    let length2 = half.length_squared();
    let h = half * (L::one() / length2.sqrt());
    let (nh, tan2) = along_tan2(half, n);
    let nh = nh / length2.sqrt();
    let (vh, nv) = (-incident.dot(h), -incident.dot(n));
    let lh = -direction.dot(h);
    let (d, visible): (L, L) = (facets.density(tan2), facets.visibility(nh, nv, vh));
    let jacobian =
        L::select(media.thin, L::from_f64(0.25) / vh, media.n_t * media.n_t * lh / length2);
    let behind = direction.dot(n).lt(L::zero());
    let valid = vh.gt(L::zero()) & nv.gt(L::zero()) & behind & (media.thin | lh.gt(L::zero()));
    (d * visible * vh / nv * jacobian).masked(valid)
}
