//! Integrator of worlds without transmission (Whitted 1980). At each hit it computes direct
//! lighting and continues the path with one reflected ray, sampled from the reflection lobe.

use crate::culling::tile::TileCandidates;
use crate::integrator::chosen_lights::chosen_lights;
use crate::integrator::direct_lighting::direct_lighting;
use crate::integrator::emitter_lighting::{
    ReflectingLobes, emitter_lighting, reflected_density, surface_emission, visible_emitters,
};
use crate::integrator::indirect_diffuse::DiffuseReservoir;
use crate::integrator::interaction::{SurfaceInteraction, interact};
use crate::integrator::nested_dielectrics::MediumStack;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::world::World;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3, next_distinct};
use zerkalo_kernel::sampling::PacketSampler;
use zerkalo_scene::material::ReflectionLobe;

/// Traces paths in a world without transmissive surfaces, and adds their radiance to `out`. The
/// paths start in the lanes `active` and end after at most `depth` reflections. `path` is
/// overwritten. `reservoir` collects the hits from which indirect diffuse light may bounce.
///
/// `EMITTERS` is `true` if the world has emitters or indirect diffuse light. If `EMITTERS` is
/// `true`, `SIMPLE` is `false`; otherwise it is the value of [`World::simple`]. `SIMPLE` has the
/// same meaning in all called functions.
#[inline(never)]
pub(crate) fn trace_opaque<'a, L: SimdFloat, const SIMPLE: bool, const EMITTERS: bool>(
    world: &'a World<L>,
    (path, mut active, depth): (&mut Path<L>, L::Mask, u32),
    mut candidates: &'a TileCandidates,
    sampler: &PacketSampler<'_, L>,
    mut reservoir: Option<&mut DiffuseReservoir<L>>,
    out: &mut Radiance<L>,
) -> Counts {
    let mut counts = Counts::default();
    let mut bounce = 0;
    loop {
        counts.rays += u64::from(active.bits().count_ones());
        let hit = if SIMPLE {
            world.geometry.closest_linear(&path.ray, &candidates.primary, active)
        } else {
            world.geometry.closest_masked(&path.ray, &candidates.primary, active)
        };
        let is_hit = hit.t.lt(L::from_f64(L::MAX));
        if let Some(group) = world.background {
            out.groups[group] += path.throughput.masked(active.and_not(is_hit));
        }
        if EMITTERS {
            visible_emitters(world, path, hit.t, active, None, out);
        }
        active = active & is_hit;
        let Some(first) = next_distinct(hit.primitive, active) else { return counts };
        let interaction = interact::<_, SIMPLE>(world, &path.ray, &hit, first, active);
        if EMITTERS && !world.emission.is_empty() {
            surface_emission(world, path, &hit, &interaction, out);
        }
        let mut bouncing = None;
        if EMITTERS && let Some(reservoir) = &mut reservoir {
            let media = (&MediumStack::vacuum(), None);
            bouncing = Some(reservoir.offer(path, &interaction, media, sampler));
        }
        direct_lighting::<_, SIMPLE>(
            world,
            path,
            &interaction,
            candidates,
            bouncing,
            None,
            (&mut *out, &mut counts),
        );
        if let Some(choice) = &world.light_choice {
            chosen_lights::<_, SIMPLE>(
                world,
                (choice, &candidates.occluders[world.first_stratum()..]),
                path,
                &interaction,
                (sampler, bounce),
                None,
                (&mut *out, &mut counts),
            );
        }
        let is_last = bounce == depth;
        if EMITTERS {
            let lanes = if is_last { L::mask(false) } else { interaction.reflecting };
            emitter_lighting(
                world,
                path,
                &interaction,
                candidates,
                (sampler, bounce),
                (&ReflectingLobes { lanes, share: L::one() }, None),
                (out, &mut counts),
            );
        }
        if is_last || interaction.reflecting.none() {
            return counts;
        }
        active = sample_reflection::<_, SIMPLE>(
            world,
            path,
            &interaction,
            (sampler, bounce),
            EMITTERS,
            &mut counts,
        );
        if active.none() {
            return counts;
        }
        bounce += 1;
        candidates = &world.all_candidates;
    }
}

/// Replaces the rays of `path` by reflected rays, with directions sampled from the reflection
/// lobes. `bounce` is the number of earlier reflections. The density of the directions is computed
/// only if `emitters` is `true`. Returns the lanes whose paths continue: their new throughput is at
/// least [`min_weight`](World::min_weight).
#[inline(always)]
pub(crate) fn sample_reflection<L: SimdFloat, const SIMPLE: bool>(
    world: &World<L>,
    path: &mut Path<L>,
    interaction: &SurfaceInteraction<L>,
    (sampler, bounce): (&PacketSampler<'_, L>, u32),
    emitters: bool,
    counts: &mut Counts,
) -> L::Mask {
    let mut lobe_sample = None;
    let (incident, throughput) = (path.ray.direction, path.throughput);
    for (index, lanes) in interaction.bsdfs(interaction.reflecting) {
        let bsdf = &world.bsdfs[index];
        let Some((strength, lobe)) = &bsdf.reflection else { continue };
        let uv = if matches!(lobe, ReflectionLobe::Mirror) {
            (L::zero(), L::zero())
        } else {
            counts.glossy = true;
            *lobe_sample.get_or_insert_with(|| sampler.lobe_2d(bounce))
        };
        let sample = bsdf.sample(*strength, lobe, incident, interaction.normal, uv, world.fold);
        let mut direction = sample.direction;
        if !SIMPLE && world.smooth {
            direction = interaction.reflect_into_hemisphere(direction);
        }
        if emitters {
            let density = reflected_density(world, &incident, interaction, index, direction);
            path.lobe_density = L::select(lanes, density, path.lobe_density);
        }
        path.ray.direction = Vec3::select(lanes, direction, path.ray.direction);
        let throughput = Path::bounded(throughput.component_mul(sample.weight));
        path.throughput = Vec3::select(lanes, throughput, path.throughput);
    }
    path.ray.origin = interaction.ray_origin();
    let max_throughput = path.throughput.max_element();
    interaction.reflecting
        & max_throughput.gt(L::zero())
        & max_throughput.ge(L::from_f64(world.min_weight))
}
