//! Light of emitters and environments that rough interfaces reflect and transmit, by multiple
//! importance sampling.
//!
//! Two strategies find this light. The first one samples a point of the emitter and traces a shadow
//! ray to it. The second one samples the direction of the reflected or transmitted ray, which may
//! hit the emitter. A shadow ray does not pass through solids: inside one, it ends at the far
//! side. Rays that enter a solid or stay in it therefore use the second strategy only, with full
//! weight. Both strategies are combined, with weights, in three cases: for rays that are reflected
//! outside, for rays that leave a solid, and at thin surfaces.

use crate::integrator::emitter_lighting::power_heuristic;
use crate::integrator::nested_dielectrics::{InterfaceHit, Media, NestedDielectrics, attenuated};
use crate::integrator::vertex::Vertex;
use crate::lights::emitters::Sampled;
use crate::world::{LaneGroups, LightSource};
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_scene::light::LightSample;
use zerkalo_scene::material::{BsdfValue, InterfaceQuery};

/// Hits of a packet on rough interfaces between transparent media.
pub(crate) struct RoughInterface<'a, L: SimdFloat> {
    pub hit: &'a InterfaceHit<L>,
    pub query: &'a InterfaceQuery<L>,
    /// Lanes whose reflected light is found by both strategies.
    pub reflecting: L::Mask,
    /// Lanes whose transmitted light is found by both strategies.
    pub transmitting: L::Mask,
}

/// Side of an interface from which light arrives.
struct Side<'a, L: SimdFloat> {
    /// `true` for the side of the transmitted rays, `false` for the side of the reflected rays.
    behind: bool,
    /// Lanes for which points of emitters are sampled on this side.
    lanes: L::Mask,
    /// Origins of the shadow rays.
    origin: Vec3<L>,
    media: Media<'a, L>,
}

impl<'a, L: SimdFloat> RoughInterface<'a, L> {
    /// Selects the rough interfaces out of `hit`, whose query is `query`. Surfaces that coincide
    /// with another one, in the lanes of `coincident`, are left out, because their transmitted rays
    /// start on the other surface.
    #[inline(always)]
    pub fn new(
        vertex: &Vertex<'_, L>,
        hit: &'a InterfaceHit<L>,
        query: &'a InterfaceQuery<L>,
        coincident: L::Mask,
    ) -> Self {
        let (world, interaction) = (vertex.world, vertex.interaction);
        // If shadows are off, emitters also light points that cannot see them. Reflected rays do
        // not find this light, so the two strategies cannot be combined.
        let combined = L::mask(world.lights.has_emitters() && world.shadows);
        let rough = vertex.not_delta(hit.lanes & combined);
        let lit = rough.and_not(hit.suppressed | coincident | interaction.covered);
        let (thin, outer) = (hit.media.thin, hit.media.outer);
        let (reflecting, transmitting) = (lit & (thin | outer), lit & (thin | !outer));
        Self { hit, query, reflecting, transmitting }
    }

    /// Returns the value of the interfaces for light from `direction`, and the density with which
    /// rays are sampled in this direction: transmitted rays if `behind` is `true`, otherwise
    /// reflected rays. In lanes in which only sampled rays find the light, the value is zero, and
    /// the density is the largest finite number.
    #[inline(never)]
    pub fn eval(&self, vertex: &Vertex<'_, L>, direction: &Vec3<L>, behind: bool) -> BsdfValue<L> {
        let (world, interaction) = (vertex.world, vertex.interaction);
        let mut out = BsdfValue { value: Vec3::zero(), density: L::from_f64(L::MAX) };
        let wanted = if behind { self.transmitting } else { self.reflecting };
        for (index, lanes) in interaction.bsdfs(wanted) {
            let bsdf = &world.bsdfs[index];
            let eval = |direction| bsdf.eval_interface(self.query, direction, L::mask(behind));
            let mut lobe = eval(*direction);
            if world.smooth {
                // Sampled rays on the wrong side of the geometric surface are mirrored to the right
                // side.
                let mirrored = eval(interaction.mirrored(*direction));
                lobe.value += mirrored.value;
                lobe.density = (lobe.density + mirrored.density).min(L::from_f64(L::MAX));
            }
            out.value = Vec3::select(lanes, lobe.value, out.value);
            out.density = L::select(lanes, lobe.density, out.density);
        }
        out
    }
}

impl<L: SimdFloat> Vertex<'_, L> {
    /// Adds the light of all visible emitters and environments that rough interfaces reflect and
    /// transmit.
    #[inline(never)]
    pub fn interface_lighting(
        &mut self,
        rough: &RoughInterface<'_, L>,
        nested_dielectrics: &NestedDielectrics<L>,
    ) {
        let (interaction, hit) = (self.interaction, rough.hit);
        let reflected = Side {
            behind: false,
            lanes: rough.reflecting,
            origin: interaction.ray_origin(),
            media: Media { nested_dielectrics, stack: &hit.medium_reflected },
        };
        let transmitted = Side {
            behind: true,
            lanes: rough.transmitting,
            origin: interaction.ray_origin_behind(),
            media: Media { nested_dielectrics, stack: &hit.medium_transmitted },
        };
        for side in [&reflected, &transmitted] {
            if side.lanes.none() {
                continue;
            }
            self.out.counts.glossy = true;
            let emitters = &self.world.lights.emitters;
            for index in 0..self.candidates.occluders.emitters.len() {
                match emitters.choices.get(index) {
                    Some(choice) if choice.few() => {
                        for number in choice.emitters() {
                            let number = *number as usize;
                            let source = self.sample_emitter(number, side.origin);
                            let Some(source) = source else { break };
                            self.add_scattered(rough, side, &source, Some(Sampled::One(number)));
                        }
                    }
                    Some(choice) => {
                        let normal = interaction.geometric;
                        let normal = if side.behind { -normal } else { normal };
                        let cells = choice.cells(side.origin, normal);
                        for way in 0..choice.ways {
                            let (source, chosen) =
                                self.sample_chosen((index, way), &cells, (side.origin, true));
                            self.add_scattered(rough, side, &source, Some(Sampled::Each(&chosen)));
                        }
                    }
                    None => {
                        let Some(source) = self.sample_emitter(index, side.origin) else { break };
                        self.add_scattered(rough, side, &source, Some(Sampled::One(index)));
                    }
                }
            }
            for index in 0..self.world.lights.environments.len() {
                let source = self.sample_environment(index, side.lanes);
                self.add_scattered(rough, side, &source, None);
            }
        }
    }

    /// Adds the light of `source` that rough interfaces scatter from one `side`. `emitters` are those
    /// on which `source` was sampled; `None` for environments.
    #[inline(always)]
    fn add_scattered(
        &mut self,
        rough: &RoughInterface<'_, L>,
        side: &Side<'_, L>,
        source: &LightSource<LightSample<L>, L::Scalar>,
        emitters: Option<Sampled<'_>>,
    ) {
        if !source.visible {
            return;
        }
        let (world, light) = (self.world, &source.light);
        let height = light.wi.dot(self.interaction.geometric);
        let arrives = if side.behind { height.lt(L::zero()) } else { height.gt(L::zero()) };
        let arrives = side.lanes & arrives & light.density.gt(L::zero());
        if arrives.none() {
            return;
        }
        let BsdfValue { value, density } = rough.eval(self, &light.wi, side.behind);
        let weight = power_heuristic(light.density, density);
        let value = value.component_mul(light.irradiance) * weight;
        let lit = arrives & value.max_element().gt(L::zero());
        let shadow = |vertex: &Self, lit| {
            let (ray, t_max) = (Ray { origin: side.origin, direction: light.wi }, light.distance);
            let occluded = world.geometry.occluded(&ray, t_max, lit, world.geometry.all());
            let media = Some(side.media);
            match emitters {
                Some(on) => vertex.emitter_shadow(on, (&ray, t_max), (lit, occluded), media),
                None => vertex.shadow(occluded, &ray, t_max, media),
            }
        };
        let groups = match emitters {
            Some(Sampled::Each(numbers)) => world.lights.emitters.groups(numbers),
            Some(Sampled::One(_)) | None => LaneGroups::All(source.group),
        };
        self.add_light(groups, lit, shadow, |vertex, _| {
            let radiance = vertex.path.throughput.component_mul(value);
            source.emitted(attenuated(Some(side.media), radiance, light.distance))
        });
    }
}
