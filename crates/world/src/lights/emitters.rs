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
use crate::lights::groups::{GroupedSource, LightGroupSource, LightGroups};
use crate::world::LightSource;
use std::collections::{HashMap, HashSet};
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3, distinct};
use zerkalo_kernel::primitive::{Aggregate, BoundingSphere, Form, PrimitiveId};
use zerkalo_scene::Scene;
use zerkalo_scene::light::{Emitter, LightSample};
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
        Self { sources, lights: lights_len, sampled, source_of, touching, primitives, lift }
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

    /// Returns the emission of `primitive`. Returns `None` if it emits nothing.
    #[inline(always)]
    pub fn of_primitive(&self, primitive: u32) -> Option<&EmissiveSource<S>> {
        let source = *self.source_of.get(primitive as usize)?;
        Some(&self.sources[source? as usize])
    }

    /// Returns the visible lights with a size, which are not part of the geometry: rays pass
    /// through them.
    #[inline(always)]
    pub fn visible_lights(&self) -> impl Iterator<Item = (&Emitter<S>, &EmissiveSource<S>)> {
        let visible = self.sources[..self.lights].iter().filter(|source| source.visible);
        visible.filter_map(|source| Some((source.light.as_ref()?, source)))
    }

    /// Returns a sphere around each emitter from which light is sampled.
    pub fn balls(&self) -> impl Iterator<Item = BoundingSphere> {
        let emitters = self.sources.iter().filter_map(|source| source.light.as_ref());
        emitters.map(|light| BoundingSphere { center: light.center, radius: light.radius })
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
