//! Direct lighting by ambient light, and by shadow rays to lights without a size.

use crate::culling::tile::TileCandidates;
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::nested_dielectrics::Media;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::world::World;
use std::f64::consts::FRAC_1_PI;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_scene::light::DeltaLight;

/// Adds to `out` the radiance that surfaces reflect in ambient light and in the light of
/// `world.sources` (lights without a size). Ambient light approximates indirect light. Lanes in
/// `bouncing` get no ambient light, because their diffuse bounces compute the indirect light.
/// `media` are the media of the paths; `None` in worlds without transmission.
#[inline(always)]
pub(crate) fn direct_lighting<L: SimdFloat, const SIMPLE: bool>(
    world: &World<L>,
    path: &Path<L>,
    interaction: &SurfaceInteraction<L>,
    candidates: &TileCandidates,
    bouncing: Option<L::Mask>,
    media: Option<Media<'_, L>>,
    (out, counts): (&mut Radiance<L>, &mut Counts),
) {
    if let Some(group) = world.ambient {
        let lanes = match bouncing {
            Some(bouncing) => interaction.has_bsdf.and_not(bouncing),
            None => interaction.has_bsdf,
        };
        for (index, lanes) in interaction.bsdfs(lanes) {
            let mut ambient = Vec3::splat(world.bsdfs[index].ambient);
            if !SIMPLE && world.colored {
                ambient = ambient.component_mul(interaction.albedo_factor);
            }
            out.groups[group] += path.throughput.component_mul(ambient).masked(lanes);
        }
    }
    if interaction.direct_mask.none() {
        return;
    }
    let origin = interaction.ray_origin();
    for (index, (source, occluders)) in world.sources.iter().zip(&candidates.occluders).enumerate()
    {
        let target = &source.light;
        let light = target.light.sample_li(origin);
        let cos_light = interaction.normal.dot(light.wi);
        let mut lit = interaction.direct_mask & cos_light.gt(L::zero());
        if !SIMPLE && world.smooth {
            lit = lit & interaction.geometric.dot(light.wi).gt(L::zero());
        }
        if let DeltaLight::Point { cone: Some(_), .. } = target.light {
            lit = lit & light.irradiance.gt(L::zero());
        }
        if lit.none() {
            continue;
        }
        if world.shadows {
            counts.rays += u64::from(lit.bits().count_ones());
            let (direction, t_max) = match &target.on_surface {
                None => (light.wi, light.distance),
                Some(on_surface) => on_surface.end(origin),
            };
            let ray = Ray { origin, direction };
            let occluded = if SIMPLE {
                world.geometry.occluded_linear(&ray, t_max, lit, occluders)
            } else if let Some(Some(buffer)) = world.light_buffers.get(index) {
                let start = (interaction.primitive, interaction.front);
                buffer.occluded(&world.geometry, &ray, start, t_max, lit, occluders)
            } else {
                world.geometry.occluded(&ray, t_max, lit, occluders)
            };
            lit = lit.and_not(occluded);
            if lit.none() {
                continue;
            }
        }
        let mut value = interaction.diffuse * (cos_light * L::from_f64(FRAC_1_PI));
        for (index, lanes) in interaction.bsdfs(interaction.highlight_mask & lit) {
            let (bsdf, view) = (&world.bsdfs[index], -path.ray.direction);
            let cos_view = interaction.normal.dot(view);
            let highlight = bsdf.highlight(interaction.normal, view, light.wi, cos_light, cos_view);
            value += highlight.masked(lanes);
        }
        let mut value = path.throughput.component_mul(value) * light.irradiance;
        if let Some(left) = media.and_then(|media| media.transmittance(light.distance)) {
            value = value.component_mul(left);
        }
        out.groups[source.group] += source.emitted(value).masked(lit);
    }
}
