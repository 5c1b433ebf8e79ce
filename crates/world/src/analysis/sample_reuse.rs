//! Reuse of film samples after an edit.

use crate::lights::groups::{LightGroupSource, LightGroups, contributes};
use std::borrow::Cow;
use zerkalo_scene::light::Light;
use zerkalo_scene::material::Material;
use zerkalo_scene::shape::Shape;
use zerkalo_scene::value::Color;
use zerkalo_scene::{FilmSettings, Object, Scene};

impl LightGroups {
    /// Returns `true` if the samples of the scene `compiled` are valid for `scene`, so that only
    /// the weights of the light groups have to change. `self` are the light groups of `compiled`.
    /// The scenes may differ in names, in unused materials, in the largest number of samples per
    /// pixel of glossy tiles, and in the emission of sources that have a group of their own.
    pub fn can_reuse(&self, compiled: &Scene, scene: &Scene) -> bool {
        let Scene {
            film,
            trace,
            camera,
            cameras: _,
            background,
            ambient,
            lights: _,
            materials: _,
            objects,
            resolver: _,
        } = scene;
        uncapped(film) == uncapped(&compiled.film)
            && *trace == compiled.trace
            && *camera == compiled.camera
            && (background.color == Color::BLACK || compiled.background.color != Color::BLACK)
            && (ambient.color == Color::BLACK
                || !self.ambient
                || self.members.contains(&LightGroupSource::Ambient))
            && objects.len() == compiled.objects.len()
            && compiled
                .objects
                .iter()
                .zip(objects)
                .all(|(a, b)| self.same_object((compiled, a), (scene, b)))
            && self.can_relight(compiled, scene)
    }

    /// Returns `true` if the lights of `scene` that emit differ at most in names, and in the
    /// emission of lights that have a group of their own.
    fn can_relight(&self, compiled: &Scene, scene: &Scene) -> bool {
        let is_compiled = |i: usize| {
            let contains = |source: &_| matches!(source, LightGroupSource::Light(j) if *j == i);
            self.members.iter().flat_map(LightGroupSource::emitting).any(contains)
        };
        let same_but_emission = |i: usize, light: &Light| {
            with_unit_emission(&compiled.lights[i]) == with_unit_emission(light)
        };
        let mut emitting =
            scene.lights.iter().enumerate().filter(|(_, light)| contributes(light, self.lit));
        let same_emission_if_shared = |source: &LightGroupSource| {
            let LightGroupSource::Shared(list) = source else { return true };
            list.iter().all(|source| source.emission(scene) == source.emission(compiled))
        };
        emitting.all(|(i, light)| is_compiled(i) && same_but_emission(i, light))
            && self.members.iter().all(same_emission_if_shared)
    }

    /// Returns `true` if the object `a` of the scene `compiled` and the object `b` of `scene` are
    /// equal except for their names, the names of their materials, and the emission of materials
    /// that have a light group of their own.
    fn same_object(&self, (compiled, a): (&Scene, &Object), (scene, b): (&Scene, &Object)) -> bool {
        let Object { name: _, material: _, shape, transform } = b;
        let names = a.materials().into_iter().zip(b.materials());
        *transform == a.transform
            && *unnamed(shape) == *unnamed(&a.shape)
            && a.materials().len() == b.materials().len()
            && names.into_iter().all(|(a, b)| self.same_material((compiled, a), (scene, b)))
    }

    /// Returns `true` if the material `name_a` of the scene `compiled` and the material `name_b` of
    /// `scene` are equal except for their emission. If the first material has a light group, both
    /// names must be equal, too. If it has none, the second material must not emit.
    fn same_material(
        &self,
        (compiled, name_a): (&Scene, &str),
        (scene, name_b): (&Scene, &str),
    ) -> bool {
        let (a, b) = (material(compiled, name_a), material(scene, name_b));
        let is_a =
            |source: &_| matches!(source, LightGroupSource::Material(name) if name == name_a);
        if self.members.iter().flat_map(LightGroupSource::emitting).any(is_a) {
            name_a == name_b && without_emission(&a) == without_emission(&b)
        } else {
            !b.emits() && without_emission(&a) == without_emission(&b)
        }
    }
}

fn without_emission(material: &Material) -> Material {
    Material { emission: 0.0, emission_color: Color::WHITE, ..material.clone() }
}

fn uncapped(film: &FilmSettings) -> FilmSettings {
    FilmSettings { rays_per_pixel: 0, ..film.clone() }
}

/// Returns the light without its name and with the emission 1, with which samples of a group of its
/// own are computed.
fn with_unit_emission(light: &Light) -> Light {
    Light { name: String::new(), color: Color::WHITE, intensity: 1.0, on: true, ..light.clone() }
}

fn unnamed(shape: &Shape) -> Cow<'_, Shape> {
    if shape.named_materials().is_empty() {
        return Cow::Borrowed(shape);
    }
    let mut shape = shape.clone();
    shape.part_names_mut().into_iter().for_each(String::clear);
    Cow::Owned(shape)
}

fn material<'a>(scene: &'a Scene, name: &str) -> Cow<'a, Material> {
    match scene.materials.get(name) {
        Some(material) => Cow::Borrowed(material),
        None => Cow::Owned(Material::default()),
    }
}
