//! Edits of the scene's mirror: a material that reflects.

use crate::edit::target::mirror_of;
use crate::edit::{Edit, EditError, Target, step};
use crate::shape::Shape;
use crate::{Object, Scene};
use std::slice;

/// Returns the name of the material that the mirror commands change: the first of the following.
///
/// - The selected material or the material of the selected object, if it reflects or transmits.
/// - The most reflecting material of the selected object and its parts.
/// - The most reflecting material of the first rectangle that reflects.
/// - The most reflecting material of all objects and parts.
/// - The selected material, or the material of the first rectangle, so that a reflection can be
///   increased from 0.
pub fn mirror(scene: &Scene, selected: Option<&Target>) -> Option<String> {
    let chosen = selected.and_then(|target| {
        let Target::Material(name) = target.material(scene)? else { return None };
        Some(name)
    });
    let is_specular = |material: &String| {
        scene.materials.get(material).is_some_and(|m| m.reflection > 0.0 || m.transmission > 0.0)
    };
    let reflecting = |objects: &[Object]| mirror_of(scene, objects).map(str::to_string);
    let selected_object = || match selected {
        Some(Target::Object(i) | Target::Part(i, _)) => scene.objects.get(*i),
        _ => None,
    };
    // Rectangles of any orientation count; the ground (`platform`) does not.
    let rectangles = || scene.objects.iter().filter(|o| matches!(o.shape, Shape::Rectangle(_)));
    let specular = chosen.clone().filter(is_specular);
    specular
        .or_else(|| reflecting(slice::from_ref(selected_object()?)))
        .or_else(|| rectangles().find_map(|object| reflecting(slice::from_ref(object))))
        .or_else(|| reflecting(&scene.objects))
        .or(chosen)
        .or_else(|| {
            let mut names = rectangles().map(|object| &object.material);
            names.find(|name| scene.materials.contains_key(*name)).cloned()
        })
}

/// Changes `key` of the [`mirror`] by arrow steps, as [`step`] does. Fails if there is no mirror.
pub fn step_mirror(
    scene: &Scene,
    selected: Option<&Target>,
    key: &str,
    steps: f64,
) -> Result<Edit, EditError> {
    let material = mirror(scene, selected).map(Target::Material).ok_or_else(|| {
        let help = "Give an object's material a reflection first.";
        EditError::new("nothing in this scene reflects", help)
    })?;
    step(scene, &material, key, None, steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Lobe;
    use crate::testing::mirror_room;

    #[test]
    fn mirror_prefers_selection_then_rectangle() {
        let mut scene = mirror_room();
        let at = |scene: &Scene, target: Option<Target>| mirror(scene, target.as_ref()).unwrap();
        assert_eq!(at(&scene, None), "mirror");
        assert_eq!(at(&scene, Some(Target::Object(2))), "red");
        assert_eq!(at(&scene, Some(Target::Object(3))), "mirror", "the cube does not reflect");
        assert_eq!(at(&scene, Some(Target::Material("floor".into()))), "floor");
        assert_eq!(at(&scene, Some(Target::Camera)), "mirror");
        let dusk = include_str!("../../../../scenes/gallery-dusk.toml");
        let dusk = Scene::parse(dusk, "gallery-dusk.toml").unwrap();
        assert_eq!(at(&dusk, None), "mirror", "wood reflects 4 %, brass less than silver");
        scene.materials.get_mut("green").unwrap().transmission = 0.5;
        assert_eq!(at(&scene, Some(Target::Object(3))), "green", "glass is as rough as a mirror");
        scene.materials.get_mut("green").unwrap().transmission = 0.0;
        scene.materials.get_mut("mirror").unwrap().reflection = 0.0;
        assert_eq!(at(&scene, None), "red");
        for material in scene.materials.values_mut() {
            material.reflection = 0.0;
        }
        assert_eq!(at(&scene, None), "mirror", "so that it can be increased again");
        assert_eq!(at(&scene, Some(Target::Object(3))), "green");
        scene.objects.clear();
        assert_eq!(mirror(&scene, None), None);
        assert!(step_mirror(&scene, None, "roughness", 1.0).unwrap_err().found.contains("nothing"));
    }

    #[test]
    fn mirror_is_found_in_compound_parts() {
        let text = "
            [materials.glossy]
            reflection = 0.5
            [[object]]
            [[object.shape.union.of]]
            shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }
            material = \"glossy\"
            [[object.shape.union.of]]
            shape.sphere = { center = [1.0, 0.0, 0.0], radius = 1.0 }
        ";
        let scene = Scene::parse(text, "test").unwrap();
        assert_eq!(mirror(&scene, None).as_deref(), Some("glossy"));
        assert_eq!(mirror(&scene, Some(&Target::Object(0))).as_deref(), Some("glossy"));
        let outline = crate::edit::outline(&scene);
        let (section, _) = outline.iter().find(|(_, s)| *s == Target::Object(0)).unwrap();
        assert_eq!(*section, crate::edit::Section::Objects);
    }

    #[test]
    fn adjust_roughness_from_zero_and_back() {
        let mut scene = mirror_room();
        scene.materials.get_mut("mirror").unwrap().roughness = 0.0;
        let start = scene.clone();
        let mut seen = vec![0.0];
        for _ in 0..60 {
            scene = step_mirror(&scene, None, "roughness", 1.0).unwrap().scene;
            seen.push(scene.materials["mirror"].roughness);
        }
        assert!(seen.is_sorted_by(|a, b| a < b), "{seen:?}");
        assert!(seen.contains(&0.32) && seen.contains(&0.0125) && seen.contains(&0.05), "{seen:?}");
        for expected in seen.iter().rev().skip(1) {
            scene = step_mirror(&scene, None, "roughness", -1.0).unwrap().scene;
            assert_eq!(scene.materials["mirror"].roughness, *expected);
        }
        assert_eq!(scene, start);
        assert_eq!(
            step_mirror(&scene, None, "roughness", -1.0).unwrap().scene,
            start,
            "0 is the end"
        );
        let fine = step_mirror(&scene, None, "roughness", 0.1).unwrap().scene;
        assert_eq!(fine.materials["mirror"].roughness, 0.01);
    }

    #[test]
    fn next_lobe_cycles_and_reflect_steps() {
        let mut scene = mirror_room();
        let mut lobes = Vec::new();
        for _ in 0..5 {
            scene = step_mirror(&scene, None, "lobe", 1.0).unwrap().scene;
            lobes.push(scene.materials["mirror"].lobe);
        }
        assert_eq!(lobes, [Lobe::Square, Lobe::Beckmann, Lobe::Ggx, Lobe::Mirror, Lobe::Cone]);
        assert_eq!(
            step_mirror(&scene, None, "lobe", -1.0).unwrap().scene.materials["mirror"].lobe,
            Lobe::Mirror
        );
        let edit = step_mirror(&scene, None, "reflection", 1.0).unwrap();
        assert_eq!(edit.scene.materials["mirror"].reflection, 0.97);
        assert_eq!(edit.label, "reflection of mirror");
        let edit = step_mirror(&scene, None, "reflection", -0.1).unwrap();
        assert_eq!(edit.scene.materials["mirror"].reflection, 0.915);
    }
}
