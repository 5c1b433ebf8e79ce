//! Reflection and transmission at rough interfaces between transparent media.
//!
//! Each microfacet reflects and refracts like clear glass, about its own normal (Walter et al.
//! 2007, *Microfacet Models for Refraction through Rough Surfaces*). The lobes `cone` and `square`
//! distribute transmitted rays about the refracted direction.

use crate::material::bsdf::{Bsdf, BsdfQuery, BsdfValue, ReflectionLobe, along_tan2, spread};
use crate::material::microfacet::MicrofacetDistribution;
use crate::material::refraction::{FresnelSplit, Interface};
use zerkalo_kernel::lanes::{Float, Frame, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;

/// Relative difference of the indices of refraction below which transmitted rays count as parallel
/// to the incident ones: the half vector then has at most three valid digits in single precision.
const MIN_REFRACTION: f64 = 1e-3;

/// Media on both sides of an interface, and the side from which rays arrive.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceMedia<L: SimdFloat> {
    /// Index of refraction on the side of the incident rays.
    pub n_i: L,
    /// Index of refraction behind the interface; at a thin surface, the index of its material.
    pub n_t: L,
    /// Lanes whose rays arrive from outside the solid.
    pub outer: L::Mask,
    /// Lanes of thin surfaces, which bound no solid and do not refract.
    pub thin: L::Mask,
}

/// Incident rays at interfaces, for which a BSDF is sampled or evaluated.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceQuery<L: SimdFloat> {
    /// Incident rays, and the normal of the surface.
    pub rays: BsdfQuery<L>,
    /// Media of the interface.
    pub media: InterfaceMedia<L>,
    /// Lanes in which the reflection lobe of the BSDF reflects; total internal reflection occurs in
    /// all lanes.
    pub reflecting: L::Mask,
}

impl<L: SimdFloat> InterfaceQuery<L> {
    /// Returns the refraction at facets with the unit normal `normal`.
    #[inline(always)]
    pub fn interface(&self, normal: Vec3<L>) -> Interface<L> {
        Interface::new(self.rays.incident, normal, self.media.n_i, self.media.n_t)
    }

    /// Returns the lanes with equal indices of refraction on both sides of the interface, except
    /// those of thin surfaces. Rays are not refracted in these lanes, even by a rough surface.
    #[inline(always)]
    fn same(&self) -> L::Mask {
        (self.media.n_i.le(self.media.n_t) & self.media.n_t.le(self.media.n_i))
            .and_not(self.media.thin)
    }
}

/// Directions and weights of the reflected and transmitted rays at a rough interface.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceSample<L> {
    /// Unit direction of the reflected ray.
    pub reflected: Vec3<L>,
    /// Factor of the radiance that arrives from `reflected`.
    pub reflected_weight: Vec3<L>,
    /// Unit direction of the transmitted ray.
    pub transmitted: Vec3<L>,
    /// Factor of the radiance that arrives from `transmitted`.
    pub transmitted_weight: L,
}

impl<S: Float> Bsdf<S> {
    /// Samples a reflected and a transmitted ray at a rough interface, both from the same two random
    /// numbers `uv` in [0, 1). Like clear glass, a rough interface does not scale radiance by the
    /// squared ratio of the indices.
    #[inline(always)]
    pub fn sample_interface<L: SimdFloat<Scalar = S>>(
        &self,
        query: &InterfaceQuery<L>,
        uv: (L, L),
    ) -> InterfaceSample<L> {
        match self.lobe.facets() {
            Some(facets) => self.sample_facet_interface(facets, query, uv),
            None => self.sample_spread_interface(query, uv),
        }
    }

    /// Samples both rays at a visible microfacet.
    #[inline(always)]
    fn sample_facet_interface<L: SimdFloat<Scalar = S>>(
        &self,
        facets: &MicrofacetDistribution<S>,
        query: &InterfaceQuery<L>,
        uv: (L, L),
    ) -> InterfaceSample<L> {
        let (zero, one) = (L::zero(), L::one());
        let BsdfQuery { incident, normal: n, .. } = query.rays;
        let frame = Frame::around(n);
        let view = frame.to_local(-incident);
        let local = facets.sample_visible(uv, view);
        let (h, vh, nv, nh) =
            (frame.to_world(local).renormalize(), view.dot(local), view.z, local.z);
        let interface = query.interface(h);
        let shares = self.split(&interface, query);
        let valid = vh.gt(zero) & nv.gt(zero);
        let reflected = h.mul_add(vh + vh, incident).renormalize();
        let nl = reflected.dot(n);
        let shadowing = facets.shadowing(nh, nv, nl, vh).masked(valid & nl.gt(zero));
        let k_r = self.strength::<L>().masked(query.reflecting);
        let fresnel = self.reflection_fresnel.times(|| vh, k_r * shares.reflected * shadowing);
        let mirrored = n.mul_add(nl * L::from_f64(-2.0), reflected);
        let transmitted = Vec3::select(query.media.thin, mirrored, interface.refracted);
        let (nt, lh) = (-transmitted.dot(n), -transmitted.dot(h));
        let behind = facets.shadowing_behind(nh, nv, vh, nt, lh);
        let behind = behind.masked(valid & nt.gt(zero) & lh.gt(zero));
        let passed = L::select(query.same(), one, L::select(query.media.thin, shadowing, behind));
        InterfaceSample {
            reflected,
            reflected_weight: fresnel + Vec3::gray(shares.tir * shadowing),
            transmitted,
            transmitted_weight: shares.transmitted * passed,
        }
    }

    /// Samples both rays by a cone or square. A ray on the wrong side of the surface is mirrored to
    /// the right side, or gets the weight 0 if the query's `fold` is `false`.
    #[inline(always)]
    fn sample_spread_interface<L: SimdFloat<Scalar = S>>(
        &self,
        query: &InterfaceQuery<L>,
        uv: (L, L),
    ) -> InterfaceSample<L> {
        let (zero, one) = (L::zero(), L::one());
        let BsdfQuery { incident, normal: n, fold } = query.rays;
        let interface = query.interface(n);
        let shares = self.split(&interface, query);
        let sample = self.sample(&query.rays, uv);
        let kept = one.masked(sample.direction.dot(n).gt(zero));
        let reflection = sample.weight.masked(query.reflecting) * shares.reflected;
        let straight = Vec3::select(query.media.thin, incident, interface.refracted);
        let direction = spread(&self.lobe, straight, uv);
        let wrong = direction.dot(n).ge(zero);
        let (direction, passed) = if fold {
            (Vec3::select(wrong, direction.reflect(n), direction), one)
        } else {
            (direction, one.masked(!wrong))
        };
        let same = query.same();
        InterfaceSample {
            reflected: sample.direction,
            reflected_weight: reflection + Vec3::gray(shares.tir * kept),
            transmitted: Vec3::select(same, incident, direction),
            transmitted_weight: shares.transmitted * L::select(same, one, passed),
        }
    }

    /// Returns the density [1/sr] with which [`Bsdf::sample_interface`] draws the transmitted ray
    /// `direction` if directions are not folded. It is the largest finite number in lanes in which
    /// all transmitted rays have the same direction.
    #[inline(always)]
    pub fn transmission_pdf<L: SimdFloat<Scalar = S>>(
        &self,
        query: &InterfaceQuery<L>,
        direction: Vec3<L>,
    ) -> L {
        let axis = || {
            let refracted = query.interface(query.rays.normal).refracted;
            Vec3::select(query.media.thin, query.rays.incident, refracted).renormalize()
        };
        let density = match &self.lobe {
            ReflectionLobe::Mirror => L::from_f64(L::MAX),
            ReflectionLobe::Cone { evaluated, .. } => {
                warp::cone_pdf(axis(), direction, L::splat(*evaluated))
            }
            ReflectionLobe::Square { evaluated, .. } => {
                let local = Frame::around(axis()).to_local(direction);
                warp::square_pdf(local, L::splat(*evaluated))
            }
            ReflectionLobe::Microfacet(facets) => {
                facet(facets, query, direction, L::mask(true)).density
            }
        };
        L::select(query.same(), L::from_f64(L::MAX), density)
    }

    /// Returns the value and the density of the interface for light from `direction`: in the lanes
    /// of `behind` those of the transmitted ray, elsewhere those of the reflected ray. Both are zero
    /// for reflected rays behind the surface and for transmitted rays in front of it. Where all
    /// transmitted rays have about the same direction, the value is zero, and the density is the
    /// largest finite number.
    #[inline(always)]
    pub fn eval_interface<L: SimdFloat<Scalar = S>>(
        &self,
        query: &InterfaceQuery<L>,
        direction: Vec3<L>,
        behind: L::Mask,
    ) -> BsdfValue<L> {
        match self.lobe.facets() {
            Some(facets) => self.eval_facet_interface(facets, query, direction, behind),
            None => self.eval_spread_interface(query, direction, behind),
        }
    }

    /// Returns the value and the density of [`Bsdf::eval_interface`] for microfacets.
    #[inline(always)]
    fn eval_facet_interface<L: SimdFloat<Scalar = S>>(
        &self,
        facets: &MicrofacetDistribution<S>,
        query: &InterfaceQuery<L>,
        direction: Vec3<L>,
        behind: L::Mask,
    ) -> BsdfValue<L> {
        let Facet { normal, nh, nv, vh, no, oh, density } = facet(facets, query, direction, behind);
        let shares = self.split(&query.interface(normal), query);
        let shadowing = facets.shadowing(nh, nv, no, vh);
        let k_r = self.strength::<L>().masked(query.reflecting);
        let reflected = self.reflection_fresnel.times(|| vh, k_r * shares.reflected * shadowing)
            + Vec3::gray(shares.tir * shadowing);
        let through = facets.shadowing_behind(nh, nv, vh, no, oh);
        let passed = shares.transmitted * L::select(query.media.thin, shadowing, through);
        let value = Vec3::select(behind, Vec3::gray(passed), reflected) * density;
        // At nearly equal indices the half vector of refraction has too few valid digits, because
        // it is the difference of two nearly equal vectors.
        let same = behind.and_not(query.media.thin)
            & (query.media.n_t - query.media.n_i)
                .abs()
                .le(query.media.n_i * L::from_f64(MIN_REFRACTION));
        let possible = density.gt(L::zero()).and_not(same);
        BsdfValue {
            value: value.masked(possible),
            density: L::select(same, L::from_f64(L::MAX), density),
        }
    }

    /// Returns the value and the density of [`Bsdf::eval_interface`] for lobes without microfacets:
    /// mirror, cone and square.
    #[inline(always)]
    fn eval_spread_interface<L: SimdFloat<Scalar = S>>(
        &self,
        query: &InterfaceQuery<L>,
        direction: Vec3<L>,
        behind: L::Mask,
    ) -> BsdfValue<L> {
        let n = query.rays.normal;
        let shares = self.split(&query.interface(n), query);
        let BsdfValue { value, density } = self.eval(&query.rays, direction);
        let reflected =
            value.masked(query.reflecting) * shares.reflected + Vec3::gray(shares.tir * density);
        let mut through = self.transmission_pdf(query, direction);
        if query.rays.fold {
            through += self.transmission_pdf(query, direction.reflect(n));
        }
        let (is_behind, same) = (direction.dot(n).lt(L::zero()), query.same());
        let through = L::select(same, L::from_f64(L::MAX), through.masked(is_behind));
        let passed = (shares.transmitted * through).masked(is_behind.and_not(same));
        BsdfValue {
            value: Vec3::select(behind, Vec3::gray(passed), reflected),
            density: L::select(behind, through, density),
        }
    }

    /// Returns the weights of reflected and transmitted rays at `interface`; no transmitted light
    /// if the BSDF does not transmit.
    #[inline(always)]
    pub fn split<L: SimdFloat<Scalar = S>>(
        &self,
        interface: &Interface<L>,
        query: &InterfaceQuery<L>,
    ) -> FresnelSplit<L> {
        match &self.transmission {
            Some(transmission) => {
                interface.split(transmission, query.media.outer, query.media.thin)
            }
            None => FresnelSplit { reflected: L::one(), transmitted: L::zero(), tir: L::zero() },
        }
    }
}

/// Microfacet that reflects or transmits an incident ray into a direction.
struct Facet<L> {
    /// Unit normal of the microfacet, on the viewer's side.
    normal: Vec3<L>,
    /// Cosines N.H, N.V and V.H of the surface normal N, the microfacet normal H and the direction V
    /// to the viewer.
    nh: L,
    nv: L,
    vh: L,
    /// Cosines N.O and O.H of the outgoing direction O, with both normals reversed for transmitted
    /// rays.
    no: L,
    oh: L,
    /// Density [1/sr] with which O is drawn if visible microfacets are sampled.
    density: L,
}

/// Returns the microfacet that scatters the incident rays into `direction`: by transmission in the
/// lanes of `behind`, by reflection elsewhere. The density is 0 for directions on the wrong side of
/// the surface.
///
/// In refraction, the microfacet normal h has the direction n_i V + n_t L, with V the direction to
/// the viewer and L = `direction`. The solid angle of h per solid angle of L is
/// n_t^2 L.h / |n_i V + n_t L|^2 (Walter et al. 2007, eq. 16 and 17). At thin surfaces the
/// transmitted ray is the reflected ray, mirrored to the other side.
#[inline(always)]
fn facet<L: SimdFloat>(
    facets: &MicrofacetDistribution<L::Scalar>,
    query: &InterfaceQuery<L>,
    direction: Vec3<L>,
    behind: L::Mask,
) -> Facet<L> {
    let BsdfQuery { incident, normal: n, .. } = query.rays;
    let refracts = behind.and_not(query.media.thin);
    let reflected = Vec3::select(behind, direction.reflect(n), direction) - incident;
    let refracted = direction * query.media.n_t - incident * query.media.n_i;
    let half = Vec3::select(refracts, refracted, reflected);
    // Points the half vector to the viewer's side.
    let half = half * L::one().copysign(half.dot(n));
    let length2 = half.length_squared();
    let h = half * (L::one() / length2.sqrt());
    let (nh, tan2) = along_tan2(half, n);
    let nh = nh / length2.sqrt();
    let (vh, nv) = (-incident.dot(h), -incident.dot(n));
    let (no, oh) = (direction.dot(n), direction.dot(h));
    let (no, oh) = (L::select(behind, -no, no), L::select(behind, -oh, oh));
    let (d, visible) = (facets.density(tan2), facets.visibility(nh, nv, vh));
    let jacobian = L::select(
        refracts,
        query.media.n_t * query.media.n_t * oh / length2,
        L::from_f64(0.25) / vh,
    );
    let zero = L::zero();
    let valid = vh.gt(zero) & nv.gt(zero) & no.gt(zero);
    let valid = valid.and_not(refracts.and_not(oh.gt(zero)));
    let density = (d * visible * vh / nv * jacobian).masked(valid);
    Facet { normal: h, nh, nv, vh, no, oh, density }
}
