//! Light of emitters (lights with a size, emissive objects), by multiple importance sampling (Veach
//! and Guibas 1995, *Optimally Combining Sampling Techniques for Monte Carlo Rendering*).
//!
//! Two strategies find the light that a glossy lobe reflects. The first one samples a point of the
//! emitter and traces a shadow ray to it. The second one samples the direction of the reflected
//! ray, which may hit the emitter. Both samples are weighted by the power heuristic (exponent 2).
//! Diffuse surfaces and highlights use only the first strategy. Mirrors and the camera use only the
//! second one.
//!
//! Emissive objects may have any shape, because rays find their emission where they hit them. If no
//! points of a shape can be sampled, only these rays find its emission.

use crate::integrator::direct_lighting::cosine_pdf;
use crate::integrator::environment_lighting::visible_environments;
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::nested_dielectrics::{Media, attenuated};
use crate::integrator::path::{Path, Radiance};
use crate::integrator::vertex::Vertex;
use crate::lights::emitter_choice::{Cells, MAX_WAYS};
use crate::lights::emitters::{EmissiveSource, Emitters, Sampled};
use crate::world::{LaneGroups, LightSource, World};
use zerkalo_kernel::bvh::{Hit, Ray};
use zerkalo_kernel::lanes::{MAX_WIDTH, Mask, SimdFloat, Vec3, distinct};
use zerkalo_kernel::primitive::PrimitiveSet;
use zerkalo_scene::light::{Emitter, LightSample};
use zerkalo_scene::material::{BsdfQuery, BsdfValue};

/// Returns the weight of a sample by the power heuristic: p^2 / (p^2 + q^2) for its density `p` and
/// the density `q` with which the other strategy draws the same direction. It is 1 if `p` is the
/// largest finite number, which means that no other strategy is used.
#[inline(always)]
pub(crate) fn power_heuristic<L: SimdFloat>(p: L, q: L) -> L {
    let ratio = q / p;
    L::one() / (ratio * ratio + L::one())
}

/// Adds to `out` the radiance of the visible lights with a size that the rays of `lanes` hit before
/// the distance `t_max`. Where `t_max` is the largest finite number, the rays hit no surface, and
/// the radiance of the visible environments is added, too.
#[inline(never)]
pub(crate) fn visible_emitters<L: SimdFloat>(
    world: &World<L>,
    path: &Path<L>,
    t_max: L,
    lanes: L::Mask,
    media: Option<Media<'_, L>>,
    out: &mut Radiance<L>,
) {
    let emitters = &world.lights.emitters;
    let seen = Seen { path, t_max, lanes, media };
    if emitters.choices.is_empty() {
        for (light, source) in emitters.visible_lights() {
            seen.add(light, source, || None, out);
        }
    } else {
        seen.add_chosen(emitters, out);
    }
    let escaped = lanes.and_not(t_max.lt(L::from_f64(L::MAX)));
    if !world.lights.environments.is_empty() && escaped.any() {
        visible_environments(world, path, escaped, media, out);
    }
}

/// Radiance of the lights with a size along the rays of a packet before the distance `t_max`.
struct Seen<'a, L: SimdFloat> {
    path: &'a Path<L>,
    t_max: L,
    lanes: L::Mask,
    media: Option<Media<'a, L>>,
}

impl<L: SimdFloat> Seen<'_, L> {
    /// Adds the radiance of `light` to `out`. `expected` returns the factor of the density of its
    /// points.
    #[inline(always)]
    fn add(
        &self,
        light: &Emitter<L::Scalar>,
        source: &EmissiveSource<L::Scalar>,
        expected: impl FnOnce() -> Option<L>,
        out: &mut Radiance<L>,
    ) {
        let Self { path, t_max, lanes, media } = *self;
        let Ray { origin, direction } = path.ray;
        let t = light.hit(origin, direction);
        let seen = lanes & t.lt(t_max);
        if seen.none() {
            return;
        }
        let mut radiance = path.throughput * L::splat(light.radiance);
        if path.lobe_pdf.lt(L::from_f64(L::MAX)).any() {
            let mut pdf = path.light_density(light, t, L::from_id(0));
            if let Some(expected) = expected() {
                pdf *= expected;
            }
            radiance = radiance * power_heuristic(path.lobe_pdf, pdf);
        }
        radiance = attenuated(media, radiance, t);
        out.groups[source.group] += source.emitted(radiance).masked(seen);
    }

    /// Adds the radiance of many lights, among which paths choose.
    #[inline(never)]
    fn add_chosen(&self, emitters: &Emitters<L::Scalar>, out: &mut Radiance<L>) {
        let (receiver, limits) = (self.path.receiver(), (self.t_max, self.lanes));
        emitters.for_visible_lights(&self.path.ray, limits, |index, light, source| {
            self.add(light, source, || Some(emitters.expected(index, receiver)), out);
        });
    }
}

/// Reflected rays of a packet, which may hit emitters (the second strategy).
pub(crate) struct ReflectedRays<L: SimdFloat> {
    /// Lanes whose reflected rays the integrator follows.
    pub lanes: L::Mask,
    /// Fraction of the light that the surface reflects rather than transmits.
    pub share: L,
}

/// Returns the value and the density of the reflection lobe of BSDF number `index` for light from
/// `direction`. For a mirror the value is zero, and the density is the largest finite number.
#[inline(never)]
pub(crate) fn eval_lobe<L: SimdFloat>(
    world: &World<L>,
    interaction: &SurfaceInteraction<L>,
    query: &BsdfQuery<L>,
    index: usize,
    direction: Vec3<L>,
) -> BsdfValue<L> {
    let bsdf = &world.bsdfs[index];
    if bsdf.is_delta() {
        return BsdfValue { value: Vec3::zero(), density: L::from_f64(L::MAX) };
    }
    let mut lobe = bsdf.eval(query, direction);
    if world.smooth {
        // Sampled rays that point into the surface are mirrored out of it.
        let mirrored = bsdf.eval(query, interaction.mirrored(direction));
        lobe.value += mirrored.value;
        lobe.density += mirrored.density;
    }
    lobe
}

impl<L: SimdFloat> Vertex<'_, L> {
    /// Adds the radiance that emissive surfaces emit at the hit points, weighted for multiple
    /// importance sampling.
    #[inline(never)]
    pub fn surface_emission(&mut self, hit: &Hit<L>) {
        let path = &*self.path;
        let interaction = self.interaction;
        for (primitive, lanes) in distinct(interaction.primitive, interaction.has_bsdf) {
            let emitters = &self.world.lights.emitters;
            let Some((index, source)) = emitters.of_primitive(primitive) else { continue };
            let mut radiance = path.throughput;
            if let Some(light) = &source.light
                && path.lobe_pdf.lt(L::from_f64(L::MAX)).any()
            {
                let mut pdf = path.light_density(light, hit.t, hit.triangle);
                if !emitters.choices.is_empty() {
                    pdf *= emitters.expected(index, path.receiver());
                }
                radiance = radiance * power_heuristic(path.lobe_pdf, pdf);
            }
            self.out.groups[source.group] += source.emitted(radiance).masked(lanes);
        }
    }

    /// Adds the light of all emitters and environments that the surfaces reflect. `rays` are the
    /// reflected rays, which may hit emitters.
    #[inline(never)]
    pub fn emitter_lighting(&mut self, rays: &ReflectedRays<L>) {
        let (world, interaction) = (self.world, self.interaction);
        let glossy = self.not_delta(rays.lanes.and_not(interaction.covered));
        if (interaction.direct_mask | glossy).none() {
            return;
        }
        let glossy = ReflectedRays { lanes: glossy, share: rays.share };
        if !world.lights.environments.is_empty() {
            self.environment_lighting(&glossy);
        }
        let origin = self.shadow_origin::<false>();
        if !world.lights.emitters.choices.is_empty() {
            return self.chosen_emitters(&glossy);
        }
        for (index, occluders) in self.candidates.occluders.emitters.iter().enumerate() {
            let Some(source) = self.sample_emitter(index, origin) else { break };
            let rays = source.visible.then_some(&glossy);
            let arrives = source.light.irradiance.x.gt(L::zero());
            self.add_emitter(&source, Sampled::One(index), (rays, arrives), occluders);
        }
    }

    /// Adds the light of many emitters: each lane chooses a few of them.
    #[inline(never)]
    fn chosen_emitters(&mut self, glossy: &ReflectedRays<L>) {
        let emitters = &self.world.lights.emitters;
        let (origin, weighted) = (self.shadow_origin::<false>(), glossy.lanes.any());
        let choices = emitters.choices.iter().zip(&self.candidates.occluders.emitters);
        for (index, (choice, occluders)) in choices.enumerate() {
            // Highlights and reflections may show any one of the emitters.
            let shown = self.interaction.highlight_mask | glossy.lanes;
            let asking = shown & L::mask(choice.few());
            let choosing = L::mask(true).and_not(asking);
            let asked = if asking.any() { choice.emitters() } else { &[] };
            for number in asked {
                let number = *number as usize;
                let Some(source) = self.sample_emitter(number, origin) else { break };
                let rays = source.visible.then_some(glossy);
                let arrives = asking & source.light.irradiance.x.gt(L::zero());
                self.add_chosen(&source, Sampled::One(number), (rays, arrives), occluders);
            }
            if (choosing & (self.interaction.direct_mask | glossy.lanes)).none() {
                continue;
            }
            let cells = choice.cells(self.interaction.ray_origin(), self.interaction.geometric);
            for way in 0..choice.ways {
                let (source, chosen) = self.sample_chosen((index, way), &cells, (origin, weighted));
                let lanes = glossy.lanes & source.light.density.gt(L::zero());
                let rays = ReflectedRays { lanes, share: glossy.share };
                let arrives = choosing & source.light.irradiance.max_element().gt(L::zero());
                let rays = (Some(&rays), arrives);
                self.add_chosen(&source, Sampled::Each(&chosen), rays, occluders);
            }
        }
    }

    /// [`Self::add_emitter`] among many, as a function of its own.
    #[inline(never)]
    fn add_chosen(
        &mut self,
        source: &LightSource<LightSample<L>, L::Scalar>,
        sampled: Sampled<'_>,
        rays: (Option<&ReflectedRays<L>>, L::Mask),
        occluders: &PrimitiveSet,
    ) {
        self.add_emitter(source, sampled, rays, occluders);
    }

    /// Adds the light of the point `source` on the emitters `sampled` in the lanes in which it
    /// `arrives`. `rays` are the reflected rays that may hit the emitters. `occluders` are the
    /// primitives that shadow rays are tested against.
    #[inline(always)]
    fn add_emitter(
        &mut self,
        source: &LightSource<LightSample<L>, L::Scalar>,
        sampled: Sampled<'_>,
        (rays, arrives): (Option<&ReflectedRays<L>>, L::Mask),
        occluders: &PrimitiveSet,
    ) {
        self.out.counts.glossy = true;
        let world = self.world;
        let (origin, light) = (self.shadow_origin::<false>(), &source.light);
        let arrives = arrives & self.arrives(light.wi);
        let value = self.reflected(light, arrives, rays, |_| L::one());
        let lit = value.max_element().gt(L::zero());
        let groups = match sampled {
            Sampled::One(_) => LaneGroups::All(source.group),
            Sampled::Each(numbers) => world.lights.emitters.groups(numbers),
        };
        self.add_light(
            groups,
            lit,
            #[inline(always)]
            |vertex, lit| {
                let ray = Ray { origin, direction: light.wi };
                let occluded = world.geometry.occluded(&ray, light.distance, lit, occluders);
                let end = (&ray, light.distance);
                vertex.emitter_shadow(sampled, end, (lit, occluded), vertex.media)
            },
            #[inline(always)]
            |vertex, _| source.emitted(vertex.unoccluded(value, light)),
        );
    }

    /// Samples a point of an emitter of choice number `index`; see [`Emitters::sample_chosen`].
    #[inline(always)]
    pub fn sample_chosen(
        &self,
        (index, way): (usize, usize),
        cells: &Cells,
        (origin, weighted): (Vec3<L>, bool),
    ) -> (LightSource<LightSample<L>, L::Scalar>, [u32; MAX_WIDTH]) {
        let emitters = &self.world.lights.emitters;
        let numbers = self.sampler.light_2d(self.bounce, (MAX_WAYS * index + way) as u32);
        let choice = &emitters.choices[index];
        emitters.sample_chosen(choice, (cells, way), origin, (numbers, weighted))
    }

    /// Returns the lanes of `lanes` whose BSDF scatters light: no mirrors and no smooth glass.
    #[inline(always)]
    pub fn not_delta(&self, lanes: L::Mask) -> L::Mask {
        let bsdfs = self.interaction.bsdfs(lanes);
        bsdfs.fold(L::mask(false), |found, (index, lanes)| {
            if self.world.bsdfs[index].is_delta() { found } else { found | lanes }
        })
    }

    /// Returns the lanes of `lanes` in which a light adds highlights. If it is `visible`, it adds none
    /// where reflected rays show the same.
    #[inline(always)]
    pub fn highlights_beside(&self, visible: bool, lanes: L::Mask) -> L::Mask {
        if visible { lanes.and_not(self.interaction.reflected_highlight) } else { lanes }
    }

    /// Returns the BSDF [1/sr] times the cosine of the angle of incidence, weighted for multiple
    /// importance sampling, in the lanes in which `light` `arrives` at the surface. `rays` are the
    /// reflected rays that may hit the light; `None` if it is invisible to them. `weight` gets the
    /// density [1/sr] of cosine-weighted directions and returns the weight of the diffuse part and
    /// the highlights.
    #[inline(always)]
    pub fn reflected(
        &self,
        light: &LightSample<L>,
        arrives: L::Mask,
        rays: Option<&ReflectedRays<L>>,
        weight: impl FnOnce(L) -> L,
    ) -> Vec3<L> {
        let (world, interaction) = (self.world, self.interaction);
        let cos_light = interaction.normal.dot(light.wi);
        let direct = interaction.direct_mask & arrives & cos_light.gt(L::zero());
        let mut value = Vec3::zero();
        if direct.any() {
            let pdf = cosine_pdf(cos_light);
            let highlights = self.highlights_beside(rays.is_some(), direct);
            value = (self.direct_value(light.wi, pdf, highlights) * weight(pdf)).masked(direct);
        }
        let Some(rays) = rays else { return value };
        let query = self.query();
        let mut lanes = rays.lanes & arrives;
        if interaction.lift.is_some() {
            lanes = lanes & interaction.geometric.dot(light.wi).gt(L::zero());
        }
        for (index, lanes) in interaction.bsdfs(lanes) {
            let lobe = eval_lobe(world, interaction, &query, index, light.wi);
            let weight = power_heuristic(light.density, lobe.density) * rays.share;
            value += (lobe.value * weight).masked(lanes);
        }
        value
    }

    /// Samples a point of the emitter with the number `index`, to light the points `origin`.
    /// Emitters are the lights with a size, followed by the emissive objects. Returns `None` if
    /// there is no emitter with this number whose points can be sampled.
    #[inline(always)]
    pub fn sample_emitter(
        &self,
        index: usize,
        origin: Vec3<L>,
    ) -> Option<LightSource<LightSample<L>, L::Scalar>> {
        let numbers = self.sampler.light_2d(self.bounce, index as u32);
        self.world.lights.emitters.sample(index, origin, numbers)
    }
}
