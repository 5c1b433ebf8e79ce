//! Reflection and transmission at rough interfaces between transparent media.
//!
//! Each microfacet reflects and refracts like clear glass, about its own normal (Walter et al.
//! 2007, *Microfacet Models for Refraction through Rough Surfaces*). The lobes `cone` and `square`
//! have no microfacets. They distribute transmitted rays about the refracted direction as they
//! distribute reflected rays about the mirror direction.

use crate::material::bsdf::{Bsdf, ReflectionLobe, Transmission, along_tan2, spread};
use crate::material::microfacet::{MicrofacetDistribution, MicrofacetEval};
use crate::material::refraction::Interface;
use zerkalo_kernel::lanes::{Float, Frame, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp;

/// Relative difference of the indices of refraction below which transmitted rays count as parallel
/// to the incident ones. Below it, the half vector of a microfacet has at most three valid digits
/// in single precision.
const MIN_REFRACTION: f64 = 1e-3;

/// Media on both sides of an interface, and the side from which rays arrive.
#[derive(Clone, Copy, Debug)]
pub struct InterfaceMedia<L: SimdFloat> {
    /// Index of refraction on the side of the incident rays.
    pub n_i: L,
    /// Index of refraction behind the interface; at a thin surface, the index of its material.
    pub n_t: L,
    /// Lanes whose rays arrive from outside of the solid.
    pub outer: L::Mask,
    /// Lanes of thin surfaces, which bound no solid and do not refract.
    pub thin: L::Mask,
}

impl<L: SimdFloat> InterfaceMedia<L> {
    /// Returns the lanes with equal indices of refraction on both sides of the interface, except
    /// those of thin surfaces. Rays are not refracted in these lanes, even by a rough surface.
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
    /// Factor by which the radiance that arrives from the direction `reflected` is multiplied.
    pub reflected_weight: Vec3<L>,
    /// Unit direction of the transmitted ray.
    pub transmitted: Vec3<L>,
    /// Factor by which the radiance that arrives from the direction `transmitted` is multiplied.
    pub transmitted_weight: L,
}

impl<S: Float> Bsdf<S> {
    /// Samples a reflected and a transmitted ray at an interface whose [`lobe`](Transmission::lobe)
    /// is not a mirror. Both rays are computed from the same two random numbers `uv` in [0, 1).
    /// `incident` is the unit direction towards the surface, and `n` is the normal on the viewer's
    /// side. `reflecting` selects the lanes in which the reflection lobe of the BSDF counts; total
    /// internal reflection counts in all lanes.
    ///
    /// The lobes `cone` and `square` can give a reflected ray behind the surface, or a transmitted
    /// ray in front of it. Such a ray is mirrored to the right side if `fold` is `true`; otherwise
    /// its weight is 0. Like clear glass, a rough interface does not scale radiance by the squared
    /// ratio of the indices.
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
    /// `direction` if its parameter `fold` is `false`, so that no rays are mirrored. The density is
    /// the largest finite number in lanes in which all transmitted rays have the same direction.
    /// All directions are unit vectors.
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
                facet(facets, media, (incident, n), (direction, L::mask(true))).density
            }
        };
        L::select(media.same(), L::from_f64(L::MAX), density)
    }

    /// Returns two values for light that arrives from `direction`: the BSDF [1/sr] of the interface
    /// times the cosine between `direction` and the normal, and the density [1/sr] with which
    /// [`Bsdf::sample_interface`] draws `direction`. In the lanes of `behind` both values are for
    /// the transmitted ray, elsewhere for the reflected ray.
    ///
    /// The weight of a sample is the first value divided by the second. Both are zero for reflected
    /// rays behind the surface and for transmitted rays in front of it. Where all transmitted rays
    /// have about the same direction, the first value is zero, and the density is the largest
    /// finite number. The other parameters are those of [`Bsdf::sample_interface`].
    #[inline(always)]
    pub fn evaluate_interface<L: SimdFloat<Scalar = S>>(
        &self,
        transmission: &Transmission<S>,
        media: &InterfaceMedia<L>,
        (incident, n): (Vec3<L>, Vec3<L>),
        (direction, behind): (Vec3<L>, L::Mask),
        (reflecting, fold): (L::Mask, bool),
    ) -> (Vec3<L>, L) {
        let strength = self.reflection.map_or(S::default(), |(strength, _)| strength);
        let gray = |x: L| Vec3::new(x, x, x);
        if let ReflectionLobe::MicrofacetDistribution(facets) = &transmission.lobe {
            let Facet { normal, nh, nv, vh, no, oh, density } =
                facet(facets, media, (incident, n), (direction, behind));
            let interface = Interface::new(incident, normal, media.n_i, media.n_t);
            let shares = interface.split_at(transmission, media.outer, media.thin);
            let shadowing: L = facets.shadowing(nh, nv, no, vh);
            let k_r = L::splat(strength).masked(reflecting);
            let reflected =
                self.reflection_fresnel.times(|| vh, k_r * shares.reflected * shadowing)
                    + gray(shares.tir * shadowing);
            let through: L = facets.shadowing_behind((nh, nv, vh), (no, oh));
            let passed = shares.transmitted * L::select(media.thin, shadowing, through);
            let value = Vec3::select(behind, gray(passed), reflected) * density;
            // At nearly equal indices the half vector of refraction has too few valid digits,
            // because it is the difference of two nearly equal vectors.
            let same = behind.and_not(media.thin)
                & (media.n_t - media.n_i).abs().le(media.n_i * L::from_f64(MIN_REFRACTION));
            let possible = density.gt(L::zero()).and_not(same);
            return (value.masked(possible), L::select(same, L::from_f64(L::MAX), density));
        }
        let interface = Interface::new(incident, n, media.n_i, media.n_t);
        let shares = interface.split_at(transmission, media.outer, media.thin);
        let (value, density) =
            self.evaluate_lobe(strength, &transmission.lobe, incident, n, direction, fold);
        let reflected = value.masked(reflecting) * shares.reflected + gray(shares.tir * density);
        let density_of = |direction: Vec3<L>| {
            self.transmission_density(transmission, media, (incident, n), direction)
        };
        let mut through = density_of(direction);
        if fold {
            through += density_of(direction.reflect(n));
        }
        let (is_behind, same) = (direction.dot(n).lt(L::zero()), media.same());
        let through = L::select(same, L::from_f64(L::MAX), through.masked(is_behind));
        let passed = gray((shares.transmitted * through).masked(is_behind.and_not(same)));
        (Vec3::select(behind, passed, reflected), L::select(behind, through, density))
    }
}

/// Microfacet that reflects or transmits an incident ray into a direction.
struct Facet<L> {
    /// Unit normal of the microfacet, on the viewer's side.
    normal: Vec3<L>,
    /// Cosine of the angle between microfacet normal and surface normal.
    nh: L,
    /// Cosine of the angle between the direction to the viewer and the surface normal.
    nv: L,
    /// Cosine of the angle between the direction to the viewer and the microfacet normal.
    vh: L,
    /// Cosine of the angle between the outgoing direction and the surface normal. For transmitted
    /// rays the normal is reversed.
    no: L,
    /// Cosine of the angle between the outgoing direction and the microfacet normal. For
    /// transmitted rays the normal is reversed.
    oh: L,
    /// Density [1/sr] with which the outgoing direction is drawn if visible microfacets are
    /// sampled.
    density: L,
}

/// Returns the microfacet that scatters rays of the direction `incident` into `direction`: by
/// transmission in the lanes of `behind`, by reflection elsewhere. `n` is the surface normal. The
/// density is 0 for directions on the wrong side of the surface.
///
/// The half vector of refraction is n_i V + n_t L, with V the direction to the viewer and L =
/// `direction`. Its solid angle per solid angle of L is n_t^2 L.h / |n_i V + n_t L|^2 (Walter et
/// al. 2007, eq. 16 and 17). At thin surfaces the transmitted ray is the reflected ray, mirrored to
/// the other side.
#[inline(always)]
fn facet<L: SimdFloat>(
    facets: &MicrofacetDistribution<L::Scalar>,
    media: &InterfaceMedia<L>,
    (incident, n): (Vec3<L>, Vec3<L>),
    (direction, behind): (Vec3<L>, L::Mask),
) -> Facet<L> {
    let refracts = behind.and_not(media.thin);
    let reflected = Vec3::select(behind, direction.reflect(n), direction) - incident;
    let refracted = direction * media.n_t - incident * media.n_i;
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
    let (d, visible): (L, L) = (facets.density(tan2), facets.visibility(nh, nv, vh));
    let jacobian =
        L::select(refracts, media.n_t * media.n_t * oh / length2, L::from_f64(0.25) / vh);
    let zero = L::zero();
    let valid = vh.gt(zero) & nv.gt(zero) & no.gt(zero);
    let valid = valid.and_not(refracts.and_not(oh.gt(zero)));
    let density = (d * visible * vh / nv * jacobian).masked(valid);
    Facet { normal: h, nh, nv, vh, no, oh, density }
}
