//! Direct lighting: the estimator that all kinds of lights share, ambient light, and lights without
//! a size.

use crate::culling::light_buffer::RayStart;
use crate::integrator::clear_panes::Shadow;
use crate::integrator::nested_dielectrics::attenuated;
use crate::integrator::vertex::Vertex;
use crate::lights::choice::LightChoice;
use crate::world::LaneGroups;
use std::f64::consts::FRAC_1_PI;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_scene::light::{DeltaLight, LightSample};

/// Returns the density [1/sr] of cosine-weighted directions whose angle to the normal has the
/// cosine `cos`.
#[inline(always)]
pub(crate) fn cosine_pdf<L: SimdFloat>(cos: L) -> L {
    cos * L::from_f64(FRAC_1_PI)
}

impl<L: SimdFloat> Vertex<'_, L> {
    /// Adds an estimate of the light of one light sample to its light groups (`SampleLd` of pbrt).
    /// `lit` are the lanes that the light reaches if nothing occludes it. `occluded` traces shadow
    /// rays for the given lanes. `radiance` returns the radiance
    /// that surfaces reflect or transmit.
    #[inline(always)]
    pub fn add_light(
        &mut self,
        groups: LaneGroups<L>,
        mut lit: L::Mask,
        shadow: impl FnOnce(&Self, L::Mask) -> Shadow<L>,
        radiance: impl FnOnce(&Self, L::Mask) -> Vec3<L>,
    ) {
        if lit.none() {
            return;
        }
        let mut passed = None;
        if self.world.shadows {
            self.out.counts.add_rays(lit);
            let shadow = shadow(self, lit);
            (lit, passed) = (lit.and_not(shadow.occluded), shadow.passed);
            if lit.none() {
                return;
            }
        }
        let mut radiance = radiance(self, lit).masked(lit);
        if let Some(passed) = passed {
            radiance = radiance * passed;
        }
        match groups {
            LaneGroups::All(group) => self.out.groups[group] += radiance,
            LaneGroups::Each(numbers) => {
                for group in 0..self.world.info.scales.len() {
                    let number = L::from_f64(group as f64);
                    let own = numbers.ge(number) & numbers.le(number);
                    self.out.groups[group] += radiance.masked(own);
                }
            }
        }
    }

    /// Returns the radiance that `light`, of unit emission, adds to the samples if nothing occludes
    /// it. `value` is the BSDF [1/sr] times the cosine of the angle of incidence.
    #[inline(always)]
    pub fn unoccluded(&self, value: Vec3<L>, light: &LightSample<L>) -> Vec3<L> {
        let radiance = self.path.throughput.component_mul(value).component_mul(light.irradiance);
        attenuated(self.media, radiance, light.distance)
    }

    /// Returns the lanes with a diffuse part or highlights that face the light from `wi`.
    #[inline(always)]
    pub fn facing<const SIMPLE: bool>(&self, wi: Vec3<L>) -> L::Mask {
        let interaction = self.interaction;
        let mut facing = interaction.direct_mask & interaction.normal.dot(wi).gt(L::zero());
        if !SIMPLE && self.world.smooth {
            facing = facing & self.arrives(wi);
        }
        facing
    }

    /// Returns the lanes in which the surface does not face away from light from `wi`. Where shadow
    /// rays start above the surface, they decide whether it occludes the light.
    #[inline(always)]
    pub fn arrives(&self, wi: Vec3<L>) -> L::Mask {
        let faces = self.interaction.geometric.dot(wi).gt(L::zero());
        match &self.interaction.lift {
            Some(lift) => faces | lift.max_abs().gt(L::zero()),
            None => faces,
        }
    }

    /// Returns the origins of shadow rays.
    #[inline(always)]
    pub fn shadow_origin<const SIMPLE: bool>(&self) -> Vec3<L> {
        let origin = self.interaction.ray_origin();
        match &self.interaction.lift {
            Some(lift) if !SIMPLE => origin + *lift,
            Some(_) | None => origin,
        }
    }

    /// Returns the diffuse part and, in `lanes`, the highlights for light from `wi`: the BSDF
    /// [1/sr] times the cosine of the angle of incidence. `diffuse` is this product for the
    /// diffuse part of a white surface.
    #[inline(always)]
    pub fn direct_value(&self, wi: Vec3<L>, diffuse: L, lanes: L::Mask) -> Vec3<L> {
        let interaction = self.interaction;
        let mut value = interaction.diffuse * diffuse;
        for (index, lanes) in interaction.bsdfs(interaction.highlight_mask & lanes) {
            value += self.world.bsdfs[index].highlight(&self.query(), wi).masked(lanes);
        }
        value
    }

    /// Adds ambient light, which approximates indirect light. The lanes `bouncing` get none,
    /// because their diffuse bounces compute indirect light.
    #[inline(always)]
    pub fn ambient_light<const SIMPLE: bool>(&mut self, bouncing: Option<L::Mask>) {
        let (world, interaction) = (self.world, self.interaction);
        let Some(group) = world.ambient else { return };
        let lanes = match bouncing {
            Some(bouncing) => interaction.has_bsdf.and_not(bouncing),
            None => interaction.has_bsdf,
        };
        for (index, lanes) in interaction.bsdfs(lanes) {
            let mut ambient = Vec3::splat(world.bsdfs[index].ambient);
            if !SIMPLE && world.colored {
                ambient = ambient.component_mul(interaction.albedo_factor);
            }
            self.out.groups[group] += self.path.throughput.component_mul(ambient).masked(lanes);
        }
    }

    /// Adds the light of the lights without a size to which all paths trace shadow rays.
    #[inline(always)]
    pub fn delta_lights<const SIMPLE: bool>(&mut self) {
        let (world, interaction) = (self.world, self.interaction);
        if interaction.direct_mask.none() {
            return;
        }
        let origin = self.shadow_origin::<SIMPLE>();
        let lights = world.lights.delta_lights.iter().zip(&self.candidates.occluders.delta_lights);
        for (index, (source, occluders)) in lights.enumerate() {
            let target = &source.light;
            let light = target.light.sample_li(origin);
            let mut lit = self.facing::<SIMPLE>(light.wi);
            if let DeltaLight::Point { cone: Some(_), .. } = target.light {
                lit = lit & light.irradiance.x.gt(L::zero());
            }
            self.add_light(
                LaneGroups::All(source.group),
                lit,
                #[inline(always)]
                |vertex, lit| {
                    let (direction, t_max) = match &target.on_surface {
                        None => (light.wi, light.distance),
                        Some(on_surface) => on_surface.end(origin),
                    };
                    let ray = Ray { origin, direction };
                    if SIMPLE {
                        let geometry = &world.geometry;
                        let occluded = geometry.occluded_linear(&ray, t_max, lit, occluders);
                        return Shadow { occluded, passed: None };
                    }
                    let occluded =
                        if let Some(Some(buffer)) = world.culling.light_buffers.get(index) {
                            let (primitive, outside) = (interaction.primitive, interaction.front);
                            let start = RayStart { primitive, outside };
                            buffer.occluded(&world.geometry, &ray, start, t_max, lit, occluders)
                        } else {
                            world.geometry.occluded(&ray, t_max, lit, occluders)
                        };
                    vertex.shadow(occluded, &ray, t_max, vertex.media)
                },
                #[inline(always)]
                |vertex, lit| {
                    let diffuse = cosine_pdf(interaction.normal.dot(light.wi));
                    let value = vertex.direct_value(light.wi, diffuse, lit);
                    source.emitted(vertex.unoccluded(value, &light))
                },
            );
        }
    }

    /// Adds an estimate of the light of all lights in `choice`: each lane chooses a few of them.
    #[inline(never)]
    pub fn chosen_lights<const SIMPLE: bool>(&mut self, choice: &LightChoice<L::Scalar>) {
        let (world, interaction) = (self.world, self.interaction);
        if interaction.direct_mask.none() {
            return;
        }
        self.out.counts.glossy = true;
        let origin = self.shadow_origin::<SIMPLE>();
        let lights = choice.choose(self.sampler.light_choice_1d(self.bounce));
        for (stratum, occluders) in self.candidates.occluders.strata.iter().enumerate() {
            let to_light = lights.positions(stratum) - origin;
            let distance = to_light.length_squared().sqrt();
            let inverse = L::one() / distance;
            let wi = to_light * inverse;
            let mut lit = self.facing::<SIMPLE>(wi);
            let cone = lights.cone(stratum, wi);
            if let Some(factor) = cone {
                lit = lit & factor.gt(L::zero());
            }
            let shadow = |vertex: &Self, lit| {
                let ray = Ray { origin, direction: wi };
                let occluded = match SIMPLE {
                    true => world.geometry.occluded_linear(&ray, distance, lit, occluders),
                    false => world.geometry.occluded(&ray, distance, lit, occluders),
                };
                vertex.shadow(occluded, &ray, distance, vertex.media)
            };
            self.add_light(lights.groups(stratum), lit, shadow, |vertex, lit| {
                let diffuse = cosine_pdf(interaction.normal.dot(wi));
                let value = vertex.direct_value(wi, diffuse, lit);
                let mut radiance = vertex.path.throughput.component_mul(value);
                radiance = radiance * lights.irradiance(stratum, inverse);
                if let Some(factor) = cone {
                    radiance = radiance * factor;
                }
                attenuated(vertex.media, radiance, distance).component_mul(lights.emission(stratum))
            });
        }
    }
}
