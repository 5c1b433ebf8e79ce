//! Direct lighting by a few lights out of many. Each lane chooses its lights at each hit.

use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::nested_dielectrics::Media;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::light_choice::LightChoice;
use crate::world::World;
use std::f64::consts::FRAC_1_PI;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Mask, SimdFloat};
use zerkalo_kernel::primitive::PrimitiveSet;
use zerkalo_kernel::sampling::PacketSampler;

/// Adds to `out` an estimate of the radiance that surfaces reflect in the light of all lights in
/// `choice`. `bounce` is the number of earlier surfaces of the path. `occluders` holds, for each
/// stratum of lights (spatial group of lights), the primitives that may occlude it. `media` are the
/// media of the paths; `None` in worlds without transmission.
#[inline(never)]
pub(crate) fn chosen_lights<L: SimdFloat, const SIMPLE: bool>(
    world: &World<L>,
    (choice, occluders): (&LightChoice<L::Scalar>, &[PrimitiveSet]),
    path: &Path<L>,
    interaction: &SurfaceInteraction<L>,
    (sampler, bounce): (&PacketSampler<'_, L>, u32),
    media: Option<Media<'_, L>>,
    (out, counts): (&mut Radiance<L>, &mut Counts),
) {
    let lanes = interaction.direct_mask;
    if lanes.none() {
        return;
    }
    counts.glossy = true;
    let origin = interaction.ray_origin();
    let lights = choice.choose(sampler.light_choice_1d(bounce));
    for (stratum, occluders) in occluders.iter().enumerate() {
        let to_light = lights.positions(stratum) - origin;
        let distance = to_light.length_squared().sqrt();
        let inverse = L::one() / distance;
        let wi = to_light * inverse;
        let cos_light = interaction.normal.dot(wi);
        let mut lit = lanes & cos_light.gt(L::zero());
        if !SIMPLE && world.smooth {
            lit = lit & interaction.geometric.dot(wi).gt(L::zero());
        }
        let cone = lights.cone(stratum, wi);
        if let Some(factor) = cone {
            lit = lit & factor.gt(L::zero());
        }
        if lit.none() {
            continue;
        }
        if world.shadows {
            counts.rays += u64::from(lit.bits().count_ones());
            let ray = Ray { origin, direction: wi };
            let occluded = match SIMPLE {
                true => world.geometry.occluded_linear(&ray, distance, lit, occluders),
                false => world.geometry.occluded(&ray, distance, lit, occluders),
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
            let highlight = bsdf.highlight(interaction.normal, view, wi, cos_light, cos_view);
            value += highlight.masked(lanes);
        }
        let mut value = path.throughput.component_mul(value);
        value = value * lights.irradiance(stratum, inverse);
        if let Some(factor) = cone {
            value = value * factor;
        }
        if let Some(left) = media.and_then(|media| media.transmittance(distance)) {
            value = value.component_mul(left);
        }
        value = value.component_mul(lights.emission(stratum));
        out.groups[choice.group] += value.masked(lit);
    }
}
