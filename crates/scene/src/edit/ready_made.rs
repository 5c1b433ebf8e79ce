//! Ready-made parts of scenes: solids of a material, a floor, a framed mirror, lights of a colour.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

use crate::edit::add::{add_light_as, add_object, free_color, usual_size};
use crate::edit::properties::Word;
use crate::edit::unique_name::{free_material, free_object};
use crate::edit::{Edit, EditError, Target, set};
use crate::material::{Checker, Material, Preset, Texture};
use crate::shape::{CsgOperand, Cuboid, Difference, Rectangle, Shape};
use crate::value::{Choice, Color, KeyNode, KeyValue, round_nice, round_significant, rounded_to};
use crate::{Object, Scene, TransformOp};
use glam::DVec3;

/// Name and kind of each solid that is added with a preset.
const BODIES: [(&str, &str); 6] = [
    ("ball", "sphere"),
    ("cube", "cube"),
    ("box", "box"),
    ("cylinder", "cylinder"),
    ("cone", "cone"),
    ("torus", "torus"),
];

const FLOOR: &str = "checker floor";
const MIRROR: &str = "mirror with frame";

/// Name, kind and colour of the lights, and their size in units of that of a new light.
const LIGHTS: [(&str, &str, Color, f64); 2] = [
    ("warm lamp", "sphere", Color([1.0, 0.72, 0.4]), 1.0),
    ("cool window", "rectangle", Color([0.55, 0.74, 1.0]), 2.0),
];

/// Returns the name and a description of each ready-made object.
pub fn ready_objects() -> Vec<Word> {
    let word = |name: &str, doc: &str| Word { name: name.into(), doc: doc.into() };
    let mut words = vec![
        word(FLOOR, "glossy squares without end, at height 0"),
        word(MIRROR, "slightly rough, behind the objects, facing the camera"),
    ];
    for (body, _) in BODIES {
        let name = |preset: &str| format!("{preset} {body}");
        words.extend(Preset::CHOICES.iter().map(|preset| word(&name(preset.name), preset.doc)));
    }
    words
}

/// Returns the name and a description of each ready-made light.
pub fn ready_lights() -> Vec<Word> {
    let words = LIGHTS.map(|(name, kind, ..)| Word {
        name: name.into(),
        doc: format!("{kind}, aimed at what the camera looks at"),
    });
    words.into()
}

/// Returns the name and a description of each preset of materials.
pub fn presets() -> Vec<Word> {
    let word = |preset: &Choice| Word { name: preset.name.into(), doc: preset.doc.into() };
    Preset::CHOICES.iter().map(word).collect()
}

/// Adds a ready-made object: one of [`ready_objects`].
pub fn add_ready_object(scene: &Scene, name: &str) -> Result<Edit, EditError> {
    match name {
        FLOOR => floor(scene),
        MIRROR => framed_mirror(scene),
        _ => solid(scene, name),
    }
}

/// Adds a ready-made light: one of [`ready_lights`].
pub fn add_ready_light(scene: &Scene, name: &str) -> Result<Edit, EditError> {
    let Some((name, kind, color, size)) = LIGHTS.into_iter().find(|light| light.0 == name) else {
        return Err(EditError::new(&format!("there is no light called \"{name}\""), ""));
    };
    add_light_as(scene, kind, (name, color, size))
}

/// Gives an object the material of a preset, or a material the preset itself. A plastic or diffuse
/// object keeps its colour.
pub fn give_preset(scene: &Scene, target: &Target, word: &str) -> Result<Edit, EditError> {
    let Target::Object(i) = target else {
        let Target::Material(_) = target else {
            return Err(EditError::new("only objects and materials can be made of it", ""));
        };
        return set(scene, target, "preset", word);
    };
    let object = scene.objects.get(*i).ok_or_else(|| EditError::gone(target))?;
    let color = scene.materials.get(&object.material).map(|material| material.color);
    let mut next = scene.clone();
    next.objects[*i].material = material_of(&mut next, preset(word)?, color);
    Edit::checked(next, target.clone(), format!("make {} {word}", target.label(scene)))
}

/// Removes the materials that no object uses. Fails if there are none.
pub fn purge_materials(scene: &Scene) -> Result<Edit, EditError> {
    let mut next = scene.clone();
    next.materials.retain(|name, _| scene.objects.iter().any(|object| object.names_material(name)));
    let removed = scene.materials.len() - next.materials.len();
    if removed == 0 {
        return Err(EditError::new("every material is used", ""));
    }
    let note = format!("{removed} unused materials removed.");
    let edit = Edit::checked(next, Target::Camera, "remove unused materials".to_string())?;
    Ok(edit.with_note(Some(note)))
}

fn preset(word: &str) -> Result<Preset, EditError> {
    let mut preset = Preset::default();
    let found = preset.set_value(KeyValue::Text(word.to_string()));
    let unknown = || EditError::new(&format!("there is no material \"{word}\" ready made"), "");
    found.then_some(preset).ok_or_else(unknown)
}

/// Returns the name of the material of `preset`, which is added unless the scene has it. Plastic and
/// diffuse materials get `color`, or else a free colour.
fn material_of(scene: &mut Scene, preset: Preset, color: Option<Color>) -> String {
    let mut material = preset.material();
    let word = Preset::CHOICES[preset as usize].name;
    let mut name = word.to_string();
    if matches!(preset, Preset::Plastic | Preset::Diffuse) {
        let (hue, free) = free_color(scene);
        material.color = color.unwrap_or(free);
        if color.is_none() {
            name = if preset == Preset::Diffuse { hue.into() } else { format!("{hue} {word}") };
        }
    }
    let known = scene.materials.iter().find(|(_, known)| **known == material);
    known.map(|(name, _)| name.clone()).unwrap_or_else(|| {
        let name = free_material(scene, &name);
        scene.materials.insert(name.clone(), material);
        name
    })
}

/// Adds a solid whose `name` has a preset and one of [`BODIES`].
fn solid(scene: &Scene, name: &str) -> Result<Edit, EditError> {
    let (word, body) = name.rsplit_once(' ').unwrap_or((name, ""));
    let preset = preset(word)?;
    let kind = BODIES.iter().find(|(known, _)| *known == body).map_or(body, |(_, kind)| *kind);
    let mut with_material = scene.clone();
    let material = material_of(&mut with_material, preset, None);
    let called = if preset == Preset::Diffuse { format!("{material} {body}") } else { name.into() };
    let edit = add_object(&with_material, kind, Some(&material))?;
    named(edit, &free_object(scene, &called))
}

/// Gives the object that `edit` has added the name `name`.
fn named(mut edit: Edit, name: &str) -> Result<Edit, EditError> {
    if let Some(object) = edit.scene.objects.last_mut() {
        object.name = name.to_string();
    }
    Edit::checked(edit.scene, edit.target, format!("add {name}"))
}

fn floor(scene: &Scene) -> Result<Edit, EditError> {
    let mut next = scene.clone();
    // Squares of half the size of a new object, two in a repetition.
    let mut checker = Checker {
        even: Color([0.42, 0.36, 0.31]),
        odd: Color([0.16, 0.13, 0.12]),
        ..Checker::default()
    };
    checker.placement.scale = [round_significant(1.0 / usual_size(scene), 2); 2];
    let material = Material {
        color: Color::WHITE,
        diffuse: 0.8,
        reflection: 0.15,
        roughness: 0.08,
        texture: Some(Texture::Checker(checker)),
        ..Material::default()
    };
    let material_name = free_material(scene, "floor");
    next.materials.insert(material_name.clone(), material);
    named(add_object(&next, "plane", Some(&material_name))?, &free_object(scene, "floor"))
}

/// Adds a mirror and its frame, which stand behind all solids and in front of a wall behind them.
fn framed_mirror(scene: &Scene) -> Result<Edit, EditError> {
    let camera = &scene.camera;
    let ([_, up, forward], eye) = (camera.frame(), DVec3::from_array(camera.eye));
    let heading = (-forward.x).atan2(-forward.z).to_degrees();
    let turn = rounded_to(heading / 5.0, 0) * 5.0;
    let away = -DVec3::new(turn.to_radians().sin(), 0.0, turn.to_radians().cos());
    let size = usual_size(scene);
    let aim = eye + forward * crate::edit::pivot_distance(scene);
    let forms: Vec<_> = scene.objects.iter().map(Object::form).collect();
    let depth_of = |corner: DVec3| away.dot(corner - aim);
    let solids = forms.iter().filter(|form| form.is_solid()).filter_map(|form| form.bounds());
    let depths = solids.map(|(low, high)| {
        let middle = (low + high) / 2.0;
        depth_of(middle) + ((high - low) / 2.0).dot(away.abs())
    });
    let behind = depths.reduce(f64::max).unwrap_or(0.0).max(0.0) + 1.5 * size;
    let walls = forms.iter().filter(|form| !form.is_solid());
    let wall = walls.filter_map(|wall| wall.cast(aim, away)).reduce(f64::min);
    let depth = wall.map_or(behind, |wall| behind.min(wall - 0.2 * size));
    let ground = super::placement::ground_height(scene, aim, size);
    let nice = |x: f64| round_nice(x, 10.0 * size);
    let base = (aim + away * depth).with_y(ground).map(nice);
    // The upper edge is seen, with some room above it.
    let distance = forward.dot(base - eye).max(size);
    let [half_width, half_height] = camera.half_size(scene.film.size.map(f64::from));
    let ray = forward + up * (0.8 * half_height);
    let level = |v: DVec3| v.with_y(0.0).length().max(1e-9);
    let top = eye.y + ray.y * level(base - eye) / level(ray);
    let width = round_significant(half_width * distance, 2);
    let bar = round_significant(0.04 * width, 1);
    let height = round_significant((top - ground - 2.0 * bar).clamp(0.3 * width, 0.66 * width), 2);
    let mut next = scene.clone();
    let glass = Material { roughness: 0.05, two_sided: false, ..Preset::Mirror.material() };
    let wood = Material {
        color: Color([0.5, 0.27, 0.1]),
        diffuse: 0.6,
        specular: 0.3,
        exponent: 40.0,
        ..Material::default()
    };
    let middle = bar + height / 2.0;
    let mirror = Rectangle {
        center: (base + DVec3::Y * middle).map(nice).to_array(),
        size: [width, height],
        normal: (-away).map(|x| rounded_to(x, -6)).to_array(),
        up: [0.0, 1.0, 0.0],
    };
    let block = |size: [f64; 3]| {
        CsgOperand::new(Shape::Cuboid(Cuboid { center: [0.0, nice(middle), 0.0], size }))
    };
    let outside = block([nice(width + 2.0 * bar), nice(height + 2.0 * bar), bar]);
    let frame = Difference { of: vec![outside, block([width, height, 2.0 * bar])] };
    let steps = [TransformOp::RotateY(turn), TransformOp::Translate(base.to_array())];
    let steps = if turn == 0.0 { steps[1..].to_vec() } else { steps.to_vec() };
    let parts = [
        ("mirror frame", "frame", wood, Shape::Difference(frame), steps),
        ("mirror", "mirror", glass, Shape::Rectangle(mirror), Vec::new()),
    ];
    for (name, material_name, material, shape, transform) in parts {
        let material_name = free_material(&next, material_name);
        next.materials.insert(material_name.clone(), material);
        let name = free_object(&next, name);
        next.objects.push(Object { name, material: material_name, shape, transform });
    }
    let target = Target::Object(next.objects.len() - 1);
    Edit::checked(next, target, format!("add {MIRROR}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::add::view_size;
    use crate::edit::bounds::Extent;

    /// Scene of the new file that the dashboard opens.
    fn empty() -> Scene {
        Scene::parse(
            "film.size = [960, 540]\ncamera = { eye = [0, 1.5, 5], target = [0, 0.5, 0] }",
            "",
        )
        .unwrap()
    }

    fn boxes(scene: &Scene) -> Vec<Extent> {
        scene.objects.iter().filter_map(|object| object.form().bounds()).collect()
    }

    #[test]
    fn ready_made_objects_fit_the_view_and_each_other() {
        let mut scene = empty();
        for name in
            ["gold ball", "checker floor", "glass ball", MIRROR, "diffuse ball", "rubber cone"]
        {
            scene = add_ready_object(&scene, name).unwrap_or_else(|e| panic!("{name}: {e}")).scene;
        }
        let names: Vec<_> = scene.objects.iter().map(|object| object.name.as_str()).collect();
        let expected = [
            "gold ball",
            "floor",
            "glass ball",
            "mirror frame",
            "mirror",
            "red ball",
            "rubber cone",
        ];
        assert_eq!(names, expected);
        let eighth = view_size(&scene)[0] / 8.0;
        let boxes = boxes(&scene);
        for (i, (low, high)) in boxes.iter().enumerate() {
            assert!(low.y.abs() < 0.3, "{low}");
            let is_ball = [0, 1, 4].contains(&i);
            assert!(!is_ball || ((high.x - low.x) / eighth - 1.0).abs() < 0.1, "{low} {high}");
            for (other_low, other_high) in &boxes[..i] {
                let apart = !(low.cmplt(*other_high).all() && other_low.cmplt(*high).all());
                assert!(apart || i == 3, "{i}");
            }
        }
        assert_eq!(scene.materials["red"].color, Color([0.85, 0.16, 0.11]));
        let again = add_ready_object(&scene, "gold cube").unwrap().scene;
        assert_eq!(again.materials.len(), scene.materials.len(), "gold is there");
        assert!(add_ready_object(&scene, "paper ball").is_err());
    }

    #[test]
    fn presets_are_given_to_one_object_and_unused_materials_removed() {
        let scene = add_ready_object(&empty(), "diffuse ball").unwrap().scene;
        let ball = Target::Object(0);
        let gold = give_preset(&scene, &ball, "gold").unwrap();
        assert_eq!(gold.scene.objects[0].material, "gold");
        let plastic = give_preset(&scene, &ball, "plastic").unwrap().scene;
        assert_eq!(plastic.materials["plastic"].color, scene.materials["red"].color);
        assert!(give_preset(&scene, &Target::Camera, "gold").is_err());
        let purged = purge_materials(&gold.scene).unwrap().scene;
        assert_eq!(purged.materials.keys().collect::<Vec<_>>(), ["gold"]);
        assert!(purge_materials(&purged).is_err());
        let direct = give_preset(&scene, &Target::Material("red".into()), "copper").unwrap().scene;
        assert_eq!(direct.materials["red"], Preset::Copper.material());
    }
}
