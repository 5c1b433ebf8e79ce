//! Light of emitters and environments that rough interfaces reflect and transmit, by multiple
//! importance sampling.
//!
//! Two strategies find this light. The first one samples a point of the emitter and traces a shadow
//! ray to it. The second one samples the direction of the reflected or transmitted ray, which may
//! hit the emitter. A shadow ray does not pass through glass: inside a solid, it ends at the far
//! side. Rays that enter a solid therefore use the second strategy only, with full weight. Both
//! strategies are combined, with weights, in three cases: for reflected rays, for rays that leave a
//! solid, and at thin surfaces.

use crate::integrator::emitter_lighting::{power_heuristic, sample_emitter};
use crate::integrator::environment_lighting::ENVIRONMENT_SALT;
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::nested_dielectrics::{InterfaceHit, Media, NestedDielectrics};
use crate::integrator::path::{Counts, Path, Radiance};
use crate::world::World;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::PacketSampler;
use zerkalo_scene::material::{InterfaceMedia, ReflectionLobe};

/// Hits of a packet on rough interfaces between transparent media.
pub(crate) struct RoughInterface<'a, L: SimdFloat> {
    pub hit: &'a InterfaceHit<L>,
    /// Lanes whose reflected light is found by two strategies: samples of emitter points and
    /// samples of ray directions, both with finite densities.
    pub reflecting: L::Mask,
    /// Lanes whose transmitted light is found by two strategies: samples of emitter points and
    /// samples of ray directions, both with finite densities.
    pub transmitting: L::Mask,
}

impl<'a, L: SimdFloat> RoughInterface<'a, L> {
    /// Selects the rough interfaces out of `hit`. Surfaces that coincide with another one, in the
    /// lanes of `coincident`, are left out, because their transmitted rays start on the other
    /// surface.
    pub fn new(
        world: &World<L>,
        interaction: &SurfaceInteraction<L>,
        hit: &'a InterfaceHit<L>,
        coincident: L::Mask,
    ) -> Self {
        let mut rough = L::mask(false);
        // If shadows are off, emitters also light points that cannot see them. Reflected rays do
        // not find this light, so the two strategies cannot be combined.
        if world.has_emitters() && world.shadows {
            for (index, lanes) in interaction.bsdfs(hit.lanes) {
                if let Some(transmission) = &world.bsdfs[index].transmission
                    && !matches!(transmission.lobe, ReflectionLobe::Mirror)
                {
                    rough = rough | lanes;
                }
            }
        }
        let reflecting = rough.and_not(hit.suppressed | coincident | interaction.shaded);
        Self { hit, reflecting, transmitting: reflecting & (hit.thin | !hit.outer) }
    }

    /// Returns two values for light from `direction`. The first is the value [1/sr] of the
    /// interfaces, times the cosine of the angle of incidence. The second is the density [1/sr]
    /// with which rays are sampled in `direction`: transmitted rays if `behind` is `true`,
    /// otherwise reflected rays. In lanes where no emitter points are sampled for these rays, the
    /// value is zero, and the density is the largest finite number.
    #[inline(never)]
    pub fn evaluate(
        &self,
        world: &World<L>,
        incident: &Vec3<L>,
        interaction: &SurfaceInteraction<L>,
        direction: &Vec3<L>,
        behind: bool,
    ) -> (Vec3<L>, L) {
        let InterfaceHit { n_i, n_t, outer, thin, .. } = *self.hit;
        let media = InterfaceMedia { n_i, n_t, outer, thin };
        let (mut value, mut density) = (Vec3::zero(), L::from_f64(L::MAX));
        let wanted = if behind { self.transmitting } else { self.reflecting };
        for (index, lanes) in interaction.bsdfs(wanted) {
            let bsdf = &world.bsdfs[index];
            let Some(transmission) = &bsdf.transmission else { continue };
            let evaluate = |direction: Vec3<L>| {
                bsdf.evaluate_interface(
                    transmission,
                    &media,
                    (*incident, interaction.normal),
                    (direction, L::mask(behind)),
                    (interaction.reflecting, world.fold),
                )
            };
            let (mut lobe, mut pdf) = evaluate(*direction);
            if world.smooth {
                // Sampled rays on the wrong side of the geometric surface are mirrored to the right
                // side. The value and the density therefore include those of the mirror image.
                let height = direction.dot(interaction.geometric);
                let mirrored =
                    interaction.geometric.mul_add(height * L::from_f64(-2.0), *direction);
                let (mirrored_lobe, mirrored_pdf) = evaluate(mirrored);
                lobe += mirrored_lobe;
                pdf = (pdf + mirrored_pdf).min(L::from_f64(L::MAX));
            }
            value = Vec3::select(lanes, lobe, value);
            density = L::select(lanes, pdf, density);
        }
        (value, density)
    }
}

/// Adds to `out` the radiance that rough interfaces reflect and transmit in the light of all
/// visible emitters and environments. `bounce` is the number of earlier surfaces of the path.
#[inline(never)]
pub(crate) fn interface_lighting<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    interaction: &SurfaceInteraction<L>,
    (rough, nested_dielectrics): (&RoughInterface<'_, L>, &NestedDielectrics<L>),
    (sampler, bounce): (&PacketSampler<'_, L>, u32),
    (out, counts): (&mut Radiance<L>, &mut Counts),
) {
    let hit = rough.hit;
    let sides = [
        (false, rough.reflecting, interaction.ray_origin(), &hit.medium_reflected),
        (true, rough.transmitting, interaction.ray_origin_behind(), &hit.medium_transmitted),
    ];
    for (behind, lanes, origin, stack) in sides {
        if lanes.none() {
            continue;
        }
        counts.glossy = true;
        let media = Media { nested_dielectrics, stack };
        // Returns the radiance that reaches the eye from the sampled directions `wi`, in the lanes
        // whose shadow ray of length `distance` is not occluded. `density` is the density of the
        // samples. `object` is the index of the emissive object that was sampled, if any.
        let mut lit_radiance = |(wi, distance): (Vec3<L>, L),
                                (irradiance, density): (Vec3<L>, L),
                                object: Option<usize>| {
            let height = wi.dot(interaction.geometric);
            let is_behind = height.lt(L::zero());
            let arrives = if behind { is_behind } else { height.gt(L::zero()) };
            let (value, pdf) = rough.evaluate(world, &path.ray.direction, interaction, &wi, behind);
            let value = value.component_mul(irradiance) * power_heuristic(density, pdf);
            let mut lit = lanes & arrives & value.max_element().gt(L::zero());
            if lit.none() {
                return None;
            }
            counts.rays += u64::from(lit.bits().count_ones());
            let ray = Ray { origin, direction: wi };
            lit = lit.and_not(world.geometry.occluded(&ray, distance, lit, world.geometry.all()));
            if let Some(object) = object {
                let shadow_ray = (&ray, distance);
                lit = lit.and_not(world.emission.covered(object, &world.geometry, shadow_ray, lit));
            }
            let mut radiance = path.throughput.component_mul(value);
            if let Some(left) = media.transmittance(distance) {
                radiance = radiance.component_mul(left);
            }
            Some(radiance.masked(lit))
        };
        for index in 0.. {
            let numbers = sampler.light_2d(bounce, index);
            let Some(source) = sample_emitter(world, index as usize, origin, numbers) else {
                break;
            };
            if !source.visible {
                continue;
            }
            let light = &source.light;
            let irradiance = Vec3::new(light.irradiance, light.irradiance, light.irradiance);
            let ray = (light.wi, light.distance);
            let object = (index as usize).checked_sub(world.emitters.len());
            if let Some(radiance) = lit_radiance(ray, (irradiance, light.density), object) {
                out.groups[source.group] += source.emitted(radiance);
            }
        }
        for (index, source) in (0..).zip(&world.environments) {
            let numbers = sampler.light_2d(bounce, ENVIRONMENT_SALT + 2 * index);
            let light = source.light.sample(numbers, lanes);
            let ray = (light.wi, L::from_f64(L::MAX));
            if source.visible
                && let Some(radiance) = lit_radiance(ray, (light.irradiance, light.density), None)
            {
                out.groups[source.group] += source.emitted(radiance);
            }
        }
    }
}
