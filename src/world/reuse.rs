//! Which scenes the samples of a world serve.
//!
//! Descriptions are compared whole, by `==`, after the few fields that may differ were set to one value, or were
//! named in a pattern without `..`. So a key that is added to a description counts as soon as it exists: it is
//! compared, or the program does not compile before it is named here.

use crate::light::Light;
use crate::material::Material;
use crate::scene::{FilmSettings, Object, Scene};
use crate::shape::Shape;
use crate::value::Color;
use crate::world::light_groups::{LightGroupSource, LightGroups, emission, emits};
use std::borrow::Cow;

impl LightGroups {
    /// Whether the samples of the world compiled from `compiled` (whose groups these are) are samples
    /// of `scene` too, mixed otherwise: they differ in nothing but the strength of lights, ambient and
    /// background that have groups, in names, in materials that nothing is made of, and in the cap on
    /// rays per pixel, which only says how many samples there are to be.
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
                .all(|(a, b)| same_object((compiled, a), (scene, b)))
            && self.can_relight(compiled, scene)
    }

    /// The part of [`LightGroups::can_reuse`] that is about lights. One that does not shine may stand anywhere.
    fn can_relight(&self, compiled: &Scene, scene: &Scene) -> bool {
        let is_compiled = |i: usize| {
            let of = |m: &LightGroupSource| match m {
                LightGroupSource::Light(own) => *own == i,
                LightGroupSource::Shared(list) => list.contains(&i),
                LightGroupSource::Ambient | LightGroupSource::Background => false,
            };
            self.members.iter().any(of)
        };
        let same_place = |i: usize, light: &Light| of_unit(&compiled.lights[i]) == of_unit(light);
        let mut shining = scene.lights.iter().enumerate().filter(|(_, light)| emits(light));
        let shared = |member: &LightGroupSource| match member {
            LightGroupSource::Shared(list) => list.iter().all(|i| {
                scene.lights.get(*i).is_some_and(|l| emission(l) == emission(&compiled.lights[*i]))
            }),
            LightGroupSource::Ambient
            | LightGroupSource::Background
            | LightGroupSource::Light(_) => true,
        };
        !self.lit
            || shining.all(|(i, light)| is_compiled(i) && same_place(i, light))
                && self.members.iter().all(shared)
    }
}

/// The raster, whatever the number of samples.
fn uncapped(film: &FilmSettings) -> FilmSettings {
    FilmSettings { rays_per_pixel: 0, ..film.clone() }
}

/// The light without name, white and of unit strength: what its own samples hold.
fn of_unit(light: &Light) -> Light {
    Light { name: String::new(), color: Color::WHITE, intensity: 1.0, on: true, ..light.clone() }
}

/// Whether objects of two scenes are the same but for names, their own and those of their materials.
fn same_object((scene_a, a): (&Scene, &Object), (scene_b, b): (&Scene, &Object)) -> bool {
    let Object { name: _, material: _, shape, transform } = b;
    *transform == a.transform
        && *unnamed(shape) == *unnamed(&a.shape)
        && finishes(scene_b, b).eq(finishes(scene_a, a))
}

/// The shape without the names of its parts' materials.
fn unnamed(shape: &Shape) -> Cow<'_, Shape> {
    if shape.named_materials().is_empty() {
        return Cow::Borrowed(shape);
    }
    let mut shape = shape.clone();
    shape.part_names_mut().into_iter().for_each(String::clear);
    Cow::Owned(shape)
}

/// What each part of the object is made of.
fn finishes<'a>(scene: &'a Scene, object: &'a Object) -> impl Iterator<Item = Cow<'a, Material>> {
    object.materials().into_iter().map(|name| match scene.materials.get(name) {
        Some(material) => Cow::Borrowed(material),
        None => Cow::Owned(Material::default()),
    })
}
