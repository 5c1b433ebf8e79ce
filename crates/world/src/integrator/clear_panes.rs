//! Shadow rays through clear panes: thin transparent surfaces without roughness, which rays pass
//! straight.

use crate::integrator::interaction::interact;
use crate::integrator::nested_dielectrics::Media;
use crate::integrator::vertex::Vertex;
use crate::lights::emitters::Sampled;
use crate::world::World;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3, distinct, next_distinct};
use zerkalo_scene::material::{BsdfQuery, InterfaceQuery};

/// Smallest cosine of the angle of incidence at which shadow rays continue at full distance from the
/// pane that they have passed.
const MIN_COSINE: f64 = 1e-3;

/// Result of shadow rays.
pub(crate) struct Shadow<L: SimdFloat> {
    /// Lanes whose light is occluded.
    pub occluded: L::Mask,
    /// Fraction of the light that clear panes transmit in the other lanes; `None` if no shadow ray
    /// meets a pane.
    pub passed: Option<L>,
}

impl<L: SimdFloat> Vertex<'_, L> {
    /// Returns the shadows of rays that primitives occlude before `t_max` in the lanes `occluded`,
    /// some of them by clear panes alone. `media` are the media of the rays.
    #[inline(always)]
    pub fn shadow(
        &self,
        occluded: L::Mask,
        ray: &Ray<L>,
        t_max: L,
        media: Option<Media<'_, L>>,
    ) -> Shadow<L> {
        match media.filter(|media| media.nested_dielectrics.clear_panes.is_some()) {
            Some(media) if occluded.any() => pass_panes(self.world, *ray, t_max, occluded, &media),
            Some(_) | None => Shadow { occluded, passed: None },
        }
    }

    /// Returns the result of [`Self::shadow`] for rays of `lit` that end at points of the emitters
    /// `sampled`, which another object may hide.
    #[inline(always)]
    pub fn emitter_shadow(
        &self,
        sampled: Sampled<'_>,
        (ray, distance): (&Ray<L>, L),
        (lit, occluded): (L::Mask, L::Mask),
        media: Option<Media<'_, L>>,
    ) -> Shadow<L> {
        let World { lights, geometry, .. } = self.world;
        let Shadow { mut occluded, passed } = self.shadow(occluded, ray, distance, media);
        let emitters = &lights.emitters;
        match sampled {
            Sampled::One(index) => {
                let lanes = lit.and_not(occluded);
                occluded = occluded | emitters.covered(index, geometry, ray, distance, lanes);
                if let Some((media, primitive)) = media.zip(emitters.primitive(index)) {
                    occluded = occluded | media.hidden(primitive);
                }
            }
            Sampled::Each(chosen) => emitters.for_objects::<L>(chosen, |index, on_emitter| {
                let lanes = on_emitter & lit.and_not(occluded);
                occluded = occluded | emitters.covered(index, geometry, ray, distance, lanes);
                if let Some((media, primitive)) = media.zip(emitters.primitive(index)) {
                    occluded = occluded | (on_emitter & media.hidden(primitive));
                }
            }),
        }
        Shadow { occluded, passed }
    }
}

/// Follows the rays of `lanes` through clear panes up to the distance `t_max`.
#[inline(never)]
fn pass_panes<L: SimdFloat>(
    world: &World<L>,
    mut ray: Ray<L>,
    mut t_max: L,
    lanes: L::Mask,
    media: &Media<'_, L>,
) -> Shadow<L> {
    let Media { nested_dielectrics, stack } = *media;
    let is_pane = nested_dielectrics.clear_panes.as_deref().unwrap_or_default();
    let (mut active, mut occluded, mut passed) = (lanes, L::mask(false), L::one());
    loop {
        let hit = world.geometry.closest_masked(&ray, world.geometry.all(), active);
        active = active & hit.t.lt(t_max);
        for (primitive, lanes) in distinct(hit.primitive, active) {
            if !is_pane[primitive as usize] {
                occluded = occluded | lanes;
            }
        }
        active = active.and_not(occluded);
        let Some(first) = next_distinct(hit.primitive, active) else {
            return Shadow { occluded, passed: Some(passed) };
        };
        let interaction = interact::<_, false>(world, &ray, &hit, first, active);
        let (incident, normal) = (ray.direction, interaction.normal);
        for (index, lanes) in interaction.bsdfs(active) {
            let bsdf = &world.bsdfs[index];
            let Some(glass) = &bsdf.transmission else { continue };
            let index = L::splat(glass.index);
            let Some(hit) = nested_dielectrics.cross(&interaction, lanes, stack, index) else {
                continue;
            };
            let rays = BsdfQuery { incident, normal, fold: world.fold };
            let query = InterfaceQuery { rays, media: hit.media, reflecting: lanes };
            let split = bsdf.split(&query.interface(normal), &query);
            passed = L::select(lanes, passed * split.transmitted, passed);
        }
        // The ray continues on its line, because its end may be close to the surface of an emitter.
        let cos = -incident.dot(interaction.geometric);
        let step = hit.t + interaction.offset / cos.max(L::from_f64(MIN_COSINE));
        t_max = t_max - step;
        ray.origin = Vec3::select(active, ray.at(step), ray.origin);
    }
}
