//! Light of environments, by multiple importance sampling.
//!
//! Three strategies find the light of an environment. The first samples a direction with a density
//! in proportion to the luminance of the environment. The second is the reflected ray of a glossy
//! lobe. The third samples a cosine-weighted direction at a matt surface. Glossy lobes combine the
//! first and the second by the power heuristic, matt surfaces the first and the third. Highlights
//! of lights use only the first. Mirrors and the camera use only the light at the end of their ray.
//!
//! A ray that starts at a diffuse bounce adds nothing where it escapes, because direct lighting at
//! the start of the ray already includes all environments.

use crate::integrator::emitter_lighting::{ReflectingLobes, lobe_value, power_heuristic};
use crate::integrator::indirect_diffuse::NO_DENSITY;
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::world::{EnvironmentSource, World};
use std::f64::consts::FRAC_1_PI;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Frame, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::{PacketSampler, warp};

/// First salt of the random numbers for environments. A salt is a number that scrambles random
/// numbers. Each emitter has a salt of its own and each environment has two, so that their random
/// numbers are independent. The salts of emitters are smaller than this one.
pub(crate) const ENVIRONMENT_SALT: u32 = 1 << 30;

/// Adds the radiance of the visible environments, weighted for multiple importance sampling, to
/// `out`. The rays of `lanes` must hit no surface; other lanes are unchanged. `transmittance` is
/// the fraction of light that the medium around the rays lets through. If it is `None`, the medium
/// lets all light through.
pub(crate) fn visible_environments<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    transmittance: Option<Vec3<L>>,
    lanes: L::Mask,
    out: &mut Radiance<L>,
) {
    let lanes = lanes & path.lobe_density.gt(L::from_f64(NO_DENSITY));
    if lanes.none() {
        return;
    }
    for source in world.environments.iter().filter(|source| source.visible) {
        let (radiance, density) = source.light.radiance(path.ray.direction, lanes);
        let weight = power_heuristic(path.lobe_density, density);
        let mut radiance = path.throughput.component_mul(radiance) * weight;
        if let Some(left) = transmittance {
            radiance = radiance.component_mul(left);
        }
        out.groups[source.group] += source.emitted(radiance).masked(lanes);
    }
}

/// Adds to `out` the radiance that surfaces reflect in the light of all environments. `bounce` is
/// the number of earlier surfaces of the path. `glossy` selects lanes with a glossy lobe, which
/// samples directions with a finite density; mirrors do not.
#[inline(never)]
pub(crate) fn environment_lighting<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    interaction: &SurfaceInteraction<L>,
    (sampler, bounce): (&PacketSampler<'_, L>, u32),
    (glossy, lobes): (L::Mask, &ReflectingLobes<L>),
    (out, counts): (&mut Radiance<L>, &mut Counts),
) {
    let normal = interaction.normal;
    let view = -path.ray.direction;
    let cosine_density = |cos: L| cos * L::from_f64(FRAC_1_PI);
    let is_matt = interaction.direct_mask & interaction.diffuse.max_element().gt(L::zero());
    for (index, source) in (0..).zip(&world.environments) {
        let salt = ENVIRONMENT_SALT + 2 * index;
        let numbers = sampler.light_2d(bounce, salt);
        let light = source.light.sample(numbers, interaction.direct_mask | glossy);
        let arrives = interaction.geometric.dot(light.wi).gt(L::zero());
        let cos_light = normal.dot(light.wi);
        let direct = interaction.direct_mask & arrives & cos_light.gt(L::zero());
        let mut value = Vec3::zero();
        if direct.any() {
            let density = cosine_density(cos_light);
            value = interaction.diffuse * (density * power_heuristic(light.density, density));
            for (index, lanes) in interaction.bsdfs(interaction.highlight_mask & direct) {
                let (bsdf, cos_view) = (&world.bsdfs[index], normal.dot(view));
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
        let value = value.component_mul(light.irradiance);
        add(world, path, interaction, source, light.wi, value, (out, counts));
        if is_matt.none() {
            continue;
        }
        let (u, v) = sampler.light_2d(bounce, salt + 1);
        let (x, y, r2) = warp::disk(u, v);
        let cos = (L::one() - r2).max(L::zero()).sqrt();
        let wi = Frame::around(normal).to_world(Vec3::new(x, y, cos)).renormalize();
        let arrives = is_matt & interaction.geometric.dot(wi).gt(L::zero()) & cos.gt(L::zero());
        let (radiance, density) = source.light.radiance(wi, arrives);
        let weight = power_heuristic(cosine_density(cos), density).masked(arrives);
        let value = interaction.diffuse.component_mul(radiance) * weight;
        let value = value.masked(arrives);
        add(world, path, interaction, source, wi, value, (out, counts));
    }
}

/// Adds reflected light of the environment to `out`, in lanes whose shadow ray reaches the
/// environment. `wi` are the directions from which the light arrives. `value` is the reflected
/// radiance if nothing occludes these directions.
#[inline(always)]
fn add<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    interaction: &SurfaceInteraction<L>,
    source: &EnvironmentSource<L::Scalar>,
    wi: Vec3<L>,
    value: Vec3<L>,
    (out, counts): (&mut Radiance<L>, &mut Counts),
) {
    let mut lit = value.max_element().gt(L::zero());
    if lit.any() && world.shadows {
        counts.rays += u64::from(lit.bits().count_ones());
        let ray = Ray { origin: interaction.ray_origin(), direction: wi };
        let (t_max, occluders) = (L::from_f64(L::MAX), world.geometry.all());
        let occluded = world.geometry.occluded(&ray, t_max, lit, occluders);
        lit = lit.and_not(occluded);
    }
    let radiance = path.throughput.component_mul(value);
    out.groups[source.group] += source.emitted(radiance).masked(lit);
}
