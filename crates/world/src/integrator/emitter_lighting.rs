//! Light of emitters with a size, by multiple importance sampling (Veach and Guibas 1995,
//! *Optimally Combining Sampling Techniques for Monte Carlo Rendering*).
//!
//! Two strategies find the light that a glossy lobe reflects. The first one samples a point of the
//! emitter and traces a shadow ray to it. The second one samples the direction of the reflected
//! ray, which may hit the emitter. Both samples are weighted by the power heuristic (exponent 2).
//! Matt surfaces and highlights of lights use only the first strategy. Mirrors and the camera use
//! only the second one.
//!
//! Objects that emit light are emitters, too. They may have any shape, because rays find the
//! emission of an object where they hit it. If no points of a shape can be sampled, only these rays
//! find its emission.

use crate::culling::tile::TileCandidates;
use crate::integrator::environment_lighting::{environment_lighting, visible_environments};
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::nested_dielectrics::Media;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::world::{LightSource, World};
use std::f64::consts::FRAC_1_PI;
use zerkalo_kernel::bvh::{Hit, Ray};
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3, next_distinct};
use zerkalo_kernel::sampling::PacketSampler;
use zerkalo_scene::light::EmitterSample;
use zerkalo_scene::material::ReflectionLobe;

/// Returns the weight of a sample by the power heuristic: p^2 / (p^2 + q^2) for its density `p` and
/// the density `q` with which the other strategy draws the same direction. It is 1 if `p` is the
/// largest finite number, which means that no other strategy is used.
#[inline(always)]
pub(crate) fn power_heuristic<L: SimdFloat>(p: L, q: L) -> L {
    let ratio = q / p;
    L::one() / (ratio * ratio + L::one())
}

/// Adds to `out` the radiance, weighted for multiple importance sampling, of the visible area
/// lights that the rays of `lanes` hit before the distance `t_max`. A ray whose `t_max` is the
/// largest finite number hits no surface; for such rays the radiance of the visible environments is
/// added, too. `media` are the media of the paths; `None` in worlds without transmission.
#[inline(never)]
pub(crate) fn visible_emitters<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    t_max: L,
    lanes: L::Mask,
    media: Option<Media<'_, L>>,
    out: &mut Radiance<L>,
) {
    for source in world.emitters.iter().filter(|source| source.visible) {
        let Ray { origin, direction } = path.ray;
        let t = source.light.hit(origin, direction);
        let seen = lanes & t.lt(t_max);
        if seen.none() {
            continue;
        }
        let mut radiance = path.throughput * L::splat(source.light.radiance);
        if path.lobe_density.lt(L::from_f64(L::MAX)).any() {
            let density = source.light.density(origin, t);
            radiance = radiance * power_heuristic(path.lobe_density, density);
        }
        if let Some(left) = media.and_then(|media| media.transmittance(t)) {
            radiance = radiance.component_mul(left);
        }
        out.groups[source.group] += source.emitted(radiance).masked(seen);
    }
    let escaped = lanes.and_not(t_max.lt(L::from_f64(L::MAX)));
    if !world.environments.is_empty() && escaped.any() {
        let left = media.and_then(|media| media.transmittance(L::from_f64(L::MAX)));
        visible_environments(world, path, left, escaped, out);
    }
}

/// Adds to `out` the radiance, weighted for multiple importance sampling, that emissive surfaces
/// emit at the hit points of `path`.
#[inline(never)]
pub(crate) fn surface_emission<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    hit: &Hit<L>,
    interaction: &SurfaceInteraction<L>,
    out: &mut Radiance<L>,
) {
    let mut remaining = interaction.has_bsdf;
    while let Some((primitive, lanes)) = next_distinct(interaction.primitive, remaining) {
        remaining = remaining.and_not(lanes);
        let Some(source) = world.emission.of_primitive(primitive) else { continue };
        let mut radiance = path.throughput;
        if let Some(light) = &source.light
            && path.lobe_density.lt(L::from_f64(L::MAX)).any()
        {
            let density = light.density(path.ray.origin, hit.t, hit.triangle);
            radiance = radiance * power_heuristic(path.lobe_density, density);
        }
        out.groups[source.group] += source.emitted(radiance).masked(lanes);
    }
}

/// Reflected rays at the hit points of a packet, for multiple importance sampling of emitters.
pub(crate) struct ReflectingLobes<L: SimdFloat> {
    /// Lanes whose reflected rays the integrator follows.
    pub lanes: L::Mask,
    /// Fraction of the light that the surface reflects rather than transmits, by lane.
    pub share: L,
}

/// Adds to `out` the radiance that surfaces reflect in the light of all emitters: lights with a
/// size, emissive objects, environments. `bounce` is the number of earlier surfaces of the path.
/// `media` are the media of the paths; `None` in worlds without transmission.
#[inline(never)]
pub(crate) fn emitter_lighting<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    interaction: &SurfaceInteraction<L>,
    candidates: &TileCandidates,
    (sampler, bounce): (&PacketSampler<'_, L>, u32),
    (lobes, media): (&ReflectingLobes<L>, Option<Media<'_, L>>),
    (out, counts): (&mut Radiance<L>, &mut Counts),
) {
    let mut glossy = L::mask(false);
    for (index, lanes) in interaction.bsdfs(lobes.lanes.and_not(interaction.shaded)) {
        if !matches!(&world.bsdfs[index].reflection, None | Some((_, ReflectionLobe::Mirror))) {
            glossy = glossy | lanes;
        }
    }
    if (interaction.direct_mask | glossy).none() {
        return;
    }
    if !world.environments.is_empty() {
        counts.glossy = true;
        let random = (sampler, bounce);
        let sums = (&mut *out, &mut *counts);
        environment_lighting(world, path, interaction, random, (glossy, lobes), sums);
    }
    let origin = interaction.ray_origin();
    let view = -path.ray.direction;
    let occluders = &candidates.occluders[world.sources.len()..world.first_stratum()];
    for (index, occluders) in occluders.iter().enumerate() {
        let numbers = sampler.light_2d(bounce, index as u32);
        let Some(source) = sample_emitter(world, index, origin, numbers) else { break };
        let light = &source.light;
        let arrives = light.irradiance.gt(L::zero());
        let arrives = arrives & interaction.geometric.dot(light.wi).gt(L::zero());
        let cos_light = interaction.normal.dot(light.wi);
        let direct = interaction.direct_mask & arrives & cos_light.gt(L::zero());
        let mut value = Vec3::zero();
        if direct.any() {
            value = interaction.diffuse * (cos_light * L::from_f64(FRAC_1_PI));
            for (index, lanes) in interaction.bsdfs(interaction.highlight_mask & direct) {
                let (bsdf, cos_view) = (&world.bsdfs[index], interaction.normal.dot(view));
                let normal = interaction.normal;
                let highlight = bsdf.highlight(normal, view, light.wi, cos_light, cos_view);
                value += highlight.masked(lanes);
            }
            value = value.masked(direct);
        }
        if source.visible {
            for (index, lanes) in interaction.bsdfs(glossy & arrives) {
                let incident = &path.ray.direction;
                let (lobe, density) = lobe_value(world, incident, interaction, index, light.wi);
                let weight = power_heuristic(light.density, density) * lobes.share;
                value += (lobe * weight).masked(lanes);
            }
        }
        counts.glossy = true;
        let mut lit = value.max_element().gt(L::zero());
        if lit.none() {
            continue;
        }
        if world.shadows {
            counts.rays += u64::from(lit.bits().count_ones());
            let ray = Ray { origin, direction: light.wi };
            let occluded = world.geometry.occluded(&ray, light.distance, lit, occluders);
            lit = lit.and_not(occluded);
            if let Some(object) = index.checked_sub(world.emitters.len()) {
                let shadow_ray = (&ray, light.distance);
                let emission = &world.emission;
                lit = lit.and_not(emission.covered(object, &world.geometry, shadow_ray, lit));
            }
            if lit.none() {
                continue;
            }
        }
        let mut radiance = path.throughput.component_mul(value) * light.irradiance;
        if let Some(left) = media.and_then(|media| media.transmittance(light.distance)) {
            radiance = radiance.component_mul(left);
        }
        out.groups[source.group] += source.emitted(radiance).masked(lit);
    }
}

/// Samples a point of the emitter with the number `index`. Emitters are the lights with a size,
/// followed by the emissive objects. `origin` are the hit points to be lit. `numbers` are two
/// random numbers for each lane, uniform in [0, 1). Returns the sample with the emitter's light
/// group, or `None` if there is no such emitter.
#[inline(always)]
pub(crate) fn sample_emitter<L: SimdFloat>(
    world: &World<L>,
    index: usize,
    origin: Vec3<L>,
    numbers: (L, L),
) -> Option<LightSource<EmitterSample<L>, L::Scalar>> {
    match world.emitters.get(index) {
        Some(source) => Some(source.with_light(source.light.sample(origin, numbers))),
        None => {
            let (light, source) = world.emission.sampled(index - world.emitters.len())?;
            Some(source.with_light(light.sample(origin, numbers)))
        }
    }
}

/// Returns two values for the reflection lobe of the BSDF number `index`. The first is the value
/// \[1/sr\] of the lobe for light from `direction`, times the cosine of the angle of incidence. The
/// second is the density \[1/sr\] with which reflected rays are sampled in `direction`. `incident`
/// are the directions of the incoming rays.
#[inline(never)]
pub(crate) fn lobe_value<L: SimdFloat>(
    world: &World<L>,
    incident: &Vec3<L>,
    interaction: &SurfaceInteraction<L>,
    index: usize,
    direction: Vec3<L>,
) -> (Vec3<L>, L) {
    let bsdf = &world.bsdfs[index];
    let Some((strength, lobe)) = &bsdf.reflection else {
        return (Vec3::zero(), L::zero());
    };
    let evaluate = |direction: Vec3<L>| {
        let normal = interaction.normal;
        bsdf.evaluate_lobe(*strength, lobe, *incident, normal, direction, world.fold)
    };
    let (value, density) = evaluate(direction);
    if !world.smooth {
        return (value, density);
    }
    // Sampled rays that point into the surface are mirrored out of it. The values of `direction`
    // therefore include those of its mirror image.
    let height = direction.dot(interaction.geometric);
    let mirrored = interaction.geometric.mul_add(height * L::from_f64(-2.0), direction);
    let (mirrored_value, mirrored_density) = evaluate(mirrored);
    (value + mirrored_value, density + mirrored_density)
}

/// Returns the density \[1/sr\] with which the BSDF number `index` samples reflected rays in
/// `direction`, for incoming rays in direction `incident`. For a mirror it is the largest finite
/// number.
#[inline(always)]
pub(crate) fn reflected_density<L: SimdFloat>(
    world: &World<L>,
    incident: &Vec3<L>,
    interaction: &SurfaceInteraction<L>,
    index: usize,
    direction: Vec3<L>,
) -> L {
    match &world.bsdfs[index].reflection {
        None | Some((_, ReflectionLobe::Mirror)) => L::from_f64(L::MAX),
        Some(_) => lobe_value(world, incident, interaction, index, direction).1,
    }
}
