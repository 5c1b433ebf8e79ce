//! Emitters of a compiled scene: lights with a size, and emissive objects.
//!
//! Light is sampled from the surfaces of lights with a size, spheres, flat shapes, convex polyhedra,
//! and meshes of limited size. The emission of other shapes is found only by rays that hit them.
//!
//! Points sampled on an emissive object are lifted off its surface. Where another object touches
//! the emissive one, a lifted point is behind the other object's surface: below the floor on which
//! an emissive box stands, or inside a glass that stands on an emissive floor. Shadow rays that
//! start behind this surface would reach the point, although the other object covers the emissive
//! surface there. Compilation therefore lists the objects that touch an emissive one, if rays can
//! start behind their surfaces. Shadow rays are tested against these objects a second time, up to
//! the surface from which the point was lifted.

use crate::integrator::coincident_surfaces::{first_primitives, touching_pairs};
use crate::lights::emissive_forms::surface_of;
use crate::lights::emitter_choice::{Cells, EmitterBounds, EmitterChoice, MIN_EMITTERS};
use crate::lights::groups::{GroupedSource, LightGroupSource, LightGroups};
use crate::world::{LaneGroups, LightSource};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap, HashSet};
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, MAX_WIDTH, SimdFloat, Vec3, distinct};
use zerkalo_kernel::primitive::{Aggregate, BoundingSphere, Form, PrimitiveId};
use zerkalo_scene::Scene;
use zerkalo_scene::light::{Emitter, EmitterTable, LightSample, lanes_with};
use zerkalo_scene::material::Material;

/// Largest distance behind the surface of a touching object at which points of an emissive object
/// count as covered by it. The unit is the height of the sampled points above the emissive surface.
pub(crate) const CONTACT_LIFTS: f64 = 4.0;

/// Light with a size or emissive object, with its light group. The emitter is `None` if points of
/// the object cannot be sampled.
pub(crate) type EmissiveSource<S> = LightSource<Option<Emitter<S>>, S>;

/// Emitters of a scene.
#[derive(Default)]
pub(crate) struct Emitters<S> {
    /// All emitters: lights with a size, objects whose points are sampled, other emissive objects.
    sources: Vec<EmissiveSource<S>>,
    /// Number of lights with a size.
    lights: usize,
    /// Number of lights with a size and objects whose points are sampled.
    sampled: usize,
    /// For each primitive, the index of its emission in `sources`; `None` if it emits nothing.
    source_of: Vec<Option<u32>>,
    /// For each sampled object, the objects that touch it.
    touching: Vec<Vec<TouchingObject>>,
    /// For each sampled object, its primitive.
    primitives: Vec<u32>,
    /// Height above the surface of an emissive object at which its points are sampled.
    lift: S,
    /// Choices that together have every emitter whose points are sampled, if there are many.
    pub choices: Vec<EmitterChoice<S>>,
    /// `true` if some choice has emitters of several light groups.
    mixed: bool,
    /// For each of these emitters, its choice and its place there.
    place_of: Vec<(u32, u32)>,
    table: EmitterTable<S>,
}

/// Emitters on which a packet has sampled points.
#[derive(Clone, Copy)]
pub(crate) enum Sampled<'a> {
    /// Number of the only emitter.
    One(usize),
    /// Number of the emitter in each lane.
    Each(&'a [u32; MAX_WIDTH]),
}

/// Object that touches an emissive one.
#[derive(Clone, Copy)]
struct TouchingObject {
    first_primitive: u32,
    flat: bool,
}

/// Objects of a scene, from which its emitters are compiled.
pub(crate) struct ObjectGeometry<'a> {
    pub scene: &'a Scene,
    pub forms: &'a [Form],
    pub primitives: &'a [PrimitiveId],
    /// Height of sampled points above the surfaces.
    pub lift: f64,
    /// Returns `true` for an object that rays can be inside.
    pub is_entered: &'a dyn Fn(usize) -> bool,
}

impl<S: Float> Emitters<S> {
    /// Compiles the emission of `objects` and adds it to `lights`, the lights with a size.
    pub fn new(
        lights: Vec<EmissiveSource<S>>,
        objects: &ObjectGeometry,
        groups: &LightGroups,
    ) -> Self {
        let ObjectGeometry { scene, forms, primitives, lift, .. } = *objects;
        let mut emitting: Vec<(&str, GroupedSource)> = Vec::new();
        for light in groups.sources(scene) {
            if let LightGroupSource::Material(name) = light.source {
                emitting.push((name, light));
            }
        }
        // For a primitive whose material emits: its object, and the material's index in `emitting`.
        let part_of = |id: &PrimitiveId| {
            let name = scene.objects[id.form].materials()[id.part];
            Some((id.form, emitting.iter().position(|(known, _)| *known == name)?))
        };
        let parts: Vec<Option<(usize, usize)>> = match emitting.is_empty() {
            true => Vec::new(),
            false => primitives.iter().map(part_of).collect(),
        };
        let mut known = HashSet::new();
        let distinct = parts.iter().flatten().filter(|part| known.insert(**part)).copied();
        let compile = |part: (usize, usize)| {
            // Only compounds have several materials, and no points of compounds are sampled.
            let material = scene.materials.get(&scene.objects[part.0].material);
            let both_sides = material.is_none_or(|material: &Material| material.two_sided);
            let light = surface_of(&forms[part.0])
                .and_then(|surface| Emitter::of_object(&surface, both_sides, lift));
            (part, emitting[part.1].1.with_light(light, true))
        };
        let (mut compiled, unsampled): (Vec<_>, Vec<_>) =
            distinct.map(compile).partition(|(_, source)| source.light.is_some());
        let touching = objects.touching(compiled.iter().map(|((object, _), _)| *object));
        let primitive_of: HashMap<_, u32> = parts.iter().zip(0..).collect();
        let primitives = compiled.iter().map(|(part, _)| primitive_of[&Some(*part)]).collect();
        let (lights_len, sampled) = (lights.len(), lights.len() + compiled.len());
        compiled.extend(unsampled);
        let indices: HashMap<_, u32> =
            compiled.iter().map(|(part, _)| *part).zip(lights_len as u32..).collect();
        let source_of = parts.iter().map(|part| indices.get(&(*part)?).copied()).collect();
        let mut sources = lights;
        sources.extend(compiled.into_iter().map(|(_, source)| source));
        let lift = S::from_f64(lift);
        let emitters = Self {
            sources,
            lights: lights_len,
            sampled,
            source_of,
            touching,
            primitives,
            lift,
            ..Self::default()
        };
        match sampled >= MIN_EMITTERS {
            true => emitters.with_choices(forms, groups),
            false => emitters,
        }
    }

    /// Adds the choices among emitters: one for all that share their light groups, one for each other
    /// group, and one for each distant light.
    fn with_choices(mut self, forms: &[Form], groups: &LightGroups) -> Self {
        let is_shared = |source: &EmissiveSource<S>| groups.members[source.group].is_shared();
        let emission = |i: usize| {
            self.sources[i]
                .emission
                .map_or(1.0, |e| e.map(S::to_f64).into_iter().fold(0.0, f64::max))
        };
        let mut choices: BTreeMap<(usize, usize), Vec<(u32, EmitterBounds)>> = BTreeMap::new();
        let sampled = self.sources[..self.sampled].iter().enumerate();
        for (i, source) in sampled {
            let Some(light) = &source.light else { continue };
            let distant = if light.is_distant() { i + 1 } else { 0 };
            let ball = BoundingSphere { center: light.center, radius: light.radius };
            let normal = light.normal();
            // A convex solid shows a quarter of its surface on average.
            let shown = if normal.is_some() { 1.0 } else { 0.25 };
            let power = light.radiance.to_f64() * light.area.min(f64::MAX) * emission(i) * shown;
            let bounds = EmitterBounds { ball, normal, power };
            let group = if is_shared(source) { usize::MAX } else { source.group };
            choices.entry((group, distant)).or_default().push((i as u32, bounds));
        }
        let boxes = || forms.iter().filter_map(|form| form.bounds());
        let low = boxes().map(|b| b.0).reduce(DVec3::min).unwrap_or_default();
        let high = boxes().map(|b| b.1).reduce(DVec3::max).unwrap_or_default();
        self.place_of = vec![(0, 0); self.sampled];
        for mut list in choices.into_values() {
            let largest = list.iter().map(|(_, bounds)| bounds.power).fold(0.0, f64::max);
            for (_, bounds) in &mut list {
                // Relative to the largest, so that no sum overflows.
                bounds.power = (bounds.power / largest).clamp(1e-9, 1.0);
            }
            let mut choice = EmitterChoice::new(list, (low, high));
            let sources = || choice.emitters().iter().map(|number| &self.sources[*number as usize]);
            let all_visible = sources().all(|source| source.visible);
            let colored = sources().any(|source| source.emission.is_some());
            let group = self.sources[choice.emitters()[0] as usize].group;
            let mixed = sources().any(|source| source.group != group);
            (choice.all_visible, choice.colored) = (all_visible, colored);
            self.mixed |= mixed;
            for (emitter, place) in choice.emitters().iter().zip(0..) {
                self.place_of[*emitter as usize] = (self.choices.len() as u32, place);
            }
            self.choices.push(choice);
        }
        self.table = EmitterTable::new(self.sampled());
        self
    }

    fn sampled(&self) -> impl Iterator<Item = &Emitter<S>> {
        self.sources[..self.sampled].iter().filter_map(|source| source.light.as_ref())
    }

    /// Samples a point of an emitter of `choice` for each of the receivers at `origin`, which are in
    /// `cells`. `way` and `numbers` are those of [`EmitterChoice::choose`]. Returns the emitters, and
    /// the sample. Its density is for multiple importance sampling, if this is `weighted`: that of the
    /// emitter times [`Self::expected`], zero if rays do not see the emitter.
    #[inline(never)]
    pub fn sample_chosen<L: SimdFloat<Scalar = S>>(
        &self,
        choice: &EmitterChoice<S>,
        (cells, way): (&Cells, usize),
        origin: Vec3<L>,
        (numbers, weighted): ((L, L), bool),
    ) -> (LightSource<LightSample<L>, S>, [u32; MAX_WIDTH]) {
        let chosen = choice.choose(&cells.facing, way, numbers);
        let source = |i: usize| &self.sources[chosen.emitters[i] as usize];
        let emitter = |number: u32| self.sources[number as usize].light.as_ref();
        let mut light = self.table.sample(&chosen.emitters, origin, chosen.numbers, emitter);
        let inverse = L::one() / chosen.expected;
        // Stays finite, because infinity times a black reflectance would be NaN.
        light.irradiance = light.irradiance * inverse;
        light.irradiance = light.irradiance.min(Vec3::of([L::MAX; 3]));
        if weighted {
            let expected =
                |i| S::from_f64(choice.expected(cells.all[i], chosen.places[i] as usize));
            light.density = (light.density * L::from_fn(expected)).min(L::from_f64(L::MAX));
        }
        if choice.colored {
            let one = [S::from_f64(1.0); 3];
            let emission = Vec3::from_fn(|i| source(i).emission.unwrap_or(one));
            light.irradiance = light.irradiance.component_mul(emission);
        }
        if !choice.all_visible {
            let visible = |i: usize| S::from_f64(f64::from(source(i).visible));
            light.density = light.density.masked(L::from_fn(visible).gt(L::zero()));
        }
        let LightSource { group, .. } = self.sources[choice.emitters()[0] as usize];
        let source = LightSource { light, group, emission: None, visible: true };
        (source, chosen.emitters)
    }

    /// Returns the light groups of the emitters with these numbers, which are of one choice.
    #[inline(always)]
    pub fn groups<L: SimdFloat<Scalar = S>>(&self, numbers: &[u32; MAX_WIDTH]) -> LaneGroups<L> {
        let group = |lane: usize| self.sources[numbers[lane] as usize].group;
        match self.mixed {
            true => LaneGroups::Each(L::from_fn(|lane| S::from_f64(group(lane) as f64))),
            false => LaneGroups::All(group(0)),
        }
    }

    /// Returns the factor of the density of emitter number `index` for receivers that choose: the
    /// mean number of samples over the directions that they may face.
    #[inline(never)]
    pub fn expected<L: SimdFloat<Scalar = S>>(&self, index: usize, receivers: Vec3<L>) -> L {
        let Some((choice, place)) = self.place_of.get(index) else { return L::one() };
        let choice = &self.choices[*choice as usize];
        if choice.few() { L::one() } else { choice.expected_at(receivers, *place) }
    }

    /// Samples a point of the emitter with the number `index` for each of the receivers at
    /// `origin`. `numbers` are uniform in [0, 1). Returns `None` if there is no such emitter.
    #[inline(always)]
    pub fn sample<L: SimdFloat<Scalar = S>>(
        &self,
        index: usize,
        origin: Vec3<L>,
        numbers: (L, L),
    ) -> Option<LightSource<LightSample<L>, S>> {
        let source = self.sources[..self.sampled].get(index)?;
        Some(source.with_light(source.light.as_ref()?.sample(origin, numbers)))
    }

    /// Calls `test` with each emitter of `chosen`, and with its lanes, if some emitters are objects.
    #[inline(always)]
    pub fn for_objects<L: SimdFloat<Scalar = S>>(
        &self,
        chosen: &[u32; MAX_WIDTH],
        mut test: impl FnMut(usize, L::Mask),
    ) {
        let lanes = if self.primitives.is_empty() { 0 } else { L::WIDTH };
        for lane in 0..lanes {
            if !chosen[..lane].contains(&chosen[lane]) {
                test(chosen[lane] as usize, lanes_with::<L>(chosen, chosen[lane]));
            }
        }
    }

    /// Returns the lanes of `lanes` whose point at `distance` along `ray`, which was sampled on
    /// emitter number `index`, is just inside an object that touches the emitter.
    #[inline(always)]
    pub fn covered<L: SimdFloat<Scalar = S>>(
        &self,
        index: usize,
        geometry: &Aggregate<L>,
        ray: &Ray<L>,
        distance: L,
        lanes: L::Mask,
    ) -> L::Mask {
        match index.checked_sub(self.lights).and_then(|object| self.touching.get(object)) {
            Some(touching) if !touching.is_empty() => {
                self.covered_by(touching, geometry, ray, distance, lanes)
            }
            Some(_) | None => L::mask(false),
        }
    }

    /// Returns the primitive on which points of emitter number `index` are sampled; `None` for a
    /// light.
    #[inline(always)]
    pub fn primitive(&self, index: usize) -> Option<u32> {
        self.primitives.get(index.checked_sub(self.lights)?).copied()
    }

    /// Returns the lanes of `lanes` whose point, at `distance` along `ray`, is just inside one of
    /// the objects `touching`, which touch the emitter of the point.
    #[inline(never)]
    fn covered_by<L: SimdFloat<Scalar = S>>(
        &self,
        touching: &[TouchingObject],
        geometry: &Aggregate<L>,
        ray: &Ray<L>,
        distance: L,
        lanes: L::Mask,
    ) -> L::Mask {
        let lift = L::splat(self.lift) * L::from_f64(CONTACT_LIFTS);
        let mut covered = L::mask(false);
        for TouchingObject { first_primitive, flat } in touching {
            let limit = L::select(lanes, L::from_f64(L::MAX), L::from_f64(-1.0));
            let hit = geometry.closest_to(*first_primitive, ray, limit);
            for (part, part_lanes) in distinct(hit.primitive, lanes & hit.t.lt(limit)) {
                let normal = geometry.surface(part, hit.triangle, ray.at(hit.t)).normal;
                // The cosine is positive where a ray leaves a solid, because normals point
                // outwards. A flat object covers points on either side.
                let cosine = normal.dot(ray.direction);
                let cosine = if *flat { cosine.abs() } else { cosine };
                let is_near = ((hit.t - distance) * cosine).le(lift);
                covered = covered | (part_lanes & cosine.gt(L::zero()) & is_near);
            }
        }
        covered
    }

    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Returns `true` if objects of the scene emit light.
    #[inline(always)]
    pub fn has_objects(&self) -> bool {
        self.sources.len() > self.lights
    }

    /// Returns the number of emissive objects, and how many of them are found only by rays that hit
    /// them.
    pub fn object_counts(&self) -> (usize, usize) {
        (self.sources.len() - self.lights, self.sources.len() - self.sampled)
    }

    /// Returns the number and the emission of `primitive`. Returns `None` if it emits nothing.
    #[inline(always)]
    pub fn of_primitive(&self, primitive: u32) -> Option<(usize, &EmissiveSource<S>)> {
        let source = (*self.source_of.get(primitive as usize)?)? as usize;
        Some((source, &self.sources[source]))
    }

    /// Calls `seen` for each visible light with a size that `ray` may meet before `t_max` in
    /// `lanes`, if paths choose among emitters.
    #[inline(always)]
    pub fn for_visible_lights<L: SimdFloat<Scalar = S>>(
        &self,
        ray: &Ray<L>,
        (t_max, lanes): (L, L::Mask),
        mut seen: impl FnMut(usize, &Emitter<S>, &EmissiveSource<S>),
    ) {
        let mut see = |index: usize| {
            let source = &self.sources[index];
            if let Some(light) = source.light.as_ref().filter(|_| source.visible) {
                seen(index, light, source);
            }
        };
        let choices = if self.lights > 0 { self.choices.as_slice() } else { &[] };
        for choice in choices {
            choice.near_rays(ray, (t_max, lanes), |index| {
                if (index as usize) < self.lights {
                    see(index as usize);
                }
            });
        }
    }

    /// Returns the visible lights with a size, which are not part of the geometry: rays pass
    /// through them.
    #[inline(always)]
    pub fn visible_lights(&self) -> impl Iterator<Item = (&Emitter<S>, &EmissiveSource<S>)> {
        let visible = self.sources[..self.lights].iter().filter(|source| source.visible);
        visible.filter_map(|source| Some((source.light.as_ref()?, source)))
    }

    /// Returns a sphere around each emitter near the scene, and the normal of its only side, if it
    /// is flat and has one.
    pub fn outlines(&self) -> Vec<(BoundingSphere, Option<DVec3>)> {
        let outline = |light: &Emitter<S>| {
            (BoundingSphere { center: light.center, radius: light.radius }, light.normal())
        };
        self.sampled().filter(|light| !light.is_distant()).map(outline).collect()
    }

    /// Returns a sphere around each emitter from which light is sampled, or around the emitters of
    /// each choice.
    pub fn balls(&self) -> Vec<BoundingSphere> {
        if !self.choices.is_empty() {
            return self.choices.iter().map(EmitterChoice::ball).collect();
        }
        let ball =
            |light: &Emitter<S>| BoundingSphere { center: light.center, radius: light.radius };
        self.sampled().map(ball).collect()
    }
}

impl ObjectGeometry<'_> {
    /// Returns one list for each of the objects `emissive`: the objects that touch it, if rays can
    /// start behind their surfaces.
    fn touching(&self, emissive: impl Iterator<Item = usize> + Clone) -> Vec<Vec<TouchingObject>> {
        let Self { forms, primitives, lift, is_entered, .. } = *self;
        let emits: HashSet<usize> = emissive.clone().collect();
        if emits.is_empty() {
            return Vec::new();
        }
        let mut touching: HashMap<usize, Vec<TouchingObject>> = HashMap::new();
        let first = first_primitives(forms, primitives);
        let is_behind = |form: usize| forms[form].is_flat() || is_entered(form);
        let wanted = |a: usize, b: usize| {
            (emits.contains(&a) && is_behind(b)) || (emits.contains(&b) && is_behind(a))
        };
        // Excludes pairs whose bounds overlap although their surfaces are far apart, such as a lamp
        // and the room around it.
        let is_close = |a: &Form, b: &Form| {
            let ball = a.bounding_sphere();
            b.clearance(ball.center).is_none_or(|distance| distance <= ball.radius + lift)
        };
        for (a, b) in touching_pairs(forms, wanted, lift) {
            if !is_close(&forms[a], &forms[b]) || !is_close(&forms[b], &forms[a]) {
                continue;
            }
            for (form, other) in [(a, b), (b, a)] {
                // A flat emissive object lights both sides of a flat object that it lies on, as a
                // flat light does.
                let flat = forms[other].is_flat();
                if emits.contains(&form) && is_behind(other) && !(forms[form].is_flat() && flat) {
                    let touches = TouchingObject { first_primitive: first[other], flat };
                    touching.entry(form).or_default().push(touches);
                }
            }
        }
        emissive.map(|form| touching.get(&form).cloned().unwrap_or_default()).collect()
    }
}
