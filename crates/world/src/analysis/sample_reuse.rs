//! Reuse of film samples after an edit.

use crate::lights::groups::{LightGroupSource, LightGroups, contributes};
use zerkalo_scene::light::Light;
use zerkalo_scene::material::Material;
use zerkalo_scene::value::{Color, truncated};
use zerkalo_scene::{Object, Scene};

impl LightGroups {
    /// Returns `true` if the samples of the scene `compiled` are valid for `scene`, so that only
    /// the weights of the light groups have to change. `self` are the light groups of `compiled`.
    /// The scenes may differ in names, in unused materials, in the largest number of samples per
    /// pixel of glossy tiles, in the mixes of light groups, and in the emission of sources that have a
    /// group of their own.
    pub fn can_reuse(&self, compiled: &Scene, scene: &Scene) -> bool {
        let has_background = compiled.background.color != Color::BLACK;
        let has_ambient = !self.ambient || self.members.contains(&LightGroupSource::Ambient);
        (scene.background.color == Color::BLACK || has_background)
            && (scene.ambient.color == Color::BLACK || has_ambient)
            && fixed_parts(scene) == fixed_parts(compiled)
            && material_names(compiled)
                .zip(material_names(scene))
                .all(|(a, b)| self.same_material((compiled, a), (scene, b)))
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
        emitting.all(|(i, light)| is_compiled(i) && same_but_emission(i, light))
            && self.changed_in_shared(compiled, scene).is_none()
    }

    /// Returns a light group whose proportions differ between `compiled` and `scene`.
    fn changed_in_shared(&self, compiled: &Scene, scene: &Scene) -> Option<&LightGroupSource> {
        self.members.iter().filter(|group| group.is_shared()).find(|group| {
            let differs = |source| group.traced(source, scene) != group.traced(source, compiled);
            group.emitting().iter().any(differs)
        })
    }

    /// Returns why a change of lights from `compiled` to `scene` needs new samples, if a light group
    /// with several lights is the reason.
    pub fn restart_reason(&self, compiled: &Scene, scene: &Scene) -> Option<String> {
        let group = self.changed_in_shared(compiled, scene)?;
        let lights = group.emitting().len();
        Some(match group.name(scene) {
            "" => {
                format!("The film has no room to keep these {lights} lights apart: it starts again")
            }
            name => format!(
                "The {lights} lights of {} share their samples, which start again · the group mixes at once",
                truncated(name)
            ),
        })
    }

    /// Returns `true` if the material `name_a` of the scene `compiled` and the material `name_b` of
    /// `scene` are equal except for their emission. If the first material has a light group, both
    /// names must be equal, too. If it has none, the second material must not emit.
    fn same_material(
        &self,
        (compiled, name_a): (&Scene, &str),
        (scene, name_b): (&Scene, &str),
    ) -> bool {
        let is_a =
            |source: &_| matches!(source, LightGroupSource::Material(name) if name == name_a);
        let has_group = self.members.iter().flat_map(LightGroupSource::emitting).any(is_a);
        let material = |scene: &Scene, name| scene.materials.get(name).cloned().unwrap_or_default();
        let (a, b) = (material(compiled, name_a), material(scene, name_b));
        let may_emit = if has_group { name_a == name_b } else { !b.emits() };
        may_emit && without_emission(a) == without_emission(b)
    }
}

/// Returns the names of the materials of all parts of all objects.
fn material_names(scene: &Scene) -> impl Iterator<Item = &str> {
    scene.objects.iter().flat_map(Object::materials)
}

/// Returns what must be equal in scenes that share samples, apart from lights and materials.
fn fixed_parts(scene: &Scene) -> Scene {
    let Scene { film, trace, camera, background, ambient, objects, .. } = scene.clone();
    let mut fixed = Scene { film, trace, camera, background, ambient, objects, ..Scene::default() };
    (fixed.film.rays_per_pixel, fixed.film.tone) = (0, zerkalo_scene::Tone::Clip);
    fixed.film.solo.clear();
    (fixed.background.color, fixed.ambient.color) = (Color::BLACK, Color::BLACK);
    for object in &mut fixed.objects {
        let names = [&mut object.name, &mut object.material];
        names.into_iter().chain(object.shape.part_names_mut()).for_each(String::clear);
    }
    fixed
}

fn without_emission(material: Material) -> Material {
    Material { emission: 0.0, emission_color: Color::WHITE, ..material }
}

/// Returns the light without its name and with the emission 1, as it is traced if it has a light
/// group of its own.
fn with_unit_emission(light: &Light) -> Light {
    Light { name: String::new(), color: Color::WHITE, intensity: 1.0, on: true, ..light.clone() }
}
