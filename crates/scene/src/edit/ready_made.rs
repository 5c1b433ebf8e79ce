//! Ready-made parts of scenes: solids of a material, a floor, a framed mirror, lights of a colour.

use crate::edit::add::{
    PALETTE, ReadyLight, add_light_as, add_object, free_color, plane_height, usual_size,
};
use crate::edit::bounds::pivot_distance;
use crate::edit::compound::{body, material, set_body};
use crate::edit::placement::ground_height;
use crate::edit::properties::Word;
use crate::edit::unique_name::{free_material, free_object};
use crate::edit::{Edit, EditError, Target, set};
use crate::material::Preset;
use crate::value::{
    Color, KeyNode, KeyValue, number, rotated_y, round_nice, round_significant, rounded_to,
};
use crate::{Object, Scene};
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

const LIGHTS: [ReadyLight; 2] = [
    ReadyLight { name: "warm lamp", kind: "sphere", color: Color([1.0, 0.72, 0.4]), size: 1.0 },
    ReadyLight {
        name: "cool window",
        kind: "rectangle",
        color: Color([0.55, 0.74, 1.0]),
        size: 2.0,
    },
];

/// Returns the name and a description of each ready-made object. Of the diffuse ones, the first have a
/// colour that the scene has not.
pub fn ready_objects(scene: &Scene) -> Vec<Word> {
    let mut words = vec![
        Word::new(FLOOR, "glossy squares without end, at height 0"),
        Word::new(MIRROR, "slightly rough, behind the objects, facing the camera"),
    ];
    for (body, _) in BODIES {
        let word = |word: &str, doc| Word::new(format!("{word} {body}"), doc);
        let diffuse = Preset::CHOICES[Preset::Diffuse as usize].name;
        let presets = Preset::CHOICES.iter().filter(|preset| preset.name != diffuse);
        words.extend(presets.map(|preset| word(preset.name, preset.doc)));
        let free = PALETTE.iter().position(|(hue, _)| *hue == free_color(scene).0).unwrap_or(0);
        let hues = PALETTE.iter().cycle().skip(free).take(PALETTE.len());
        words.extend(hues.map(|(hue, _)| word(hue, "diffuse, matte, without gloss")));
    }
    words
}

/// Returns the name and a description of each ready-made light.
pub fn ready_lights() -> Vec<Word> {
    let doc = |kind: &str| format!("{kind}, aimed at what the camera looks at");
    LIGHTS.map(|light| Word::new(light.name, doc(light.kind))).into()
}

/// Returns the name and a description of each preset of materials.
pub fn presets() -> Vec<Word> {
    Preset::CHOICES.iter().map(|preset| Word::new(preset.name, preset.doc)).collect()
}

/// Adds one of [`ready_objects`] or [`ready_lights`].
pub fn add_ready_made(scene: &Scene, name: &str) -> Result<Edit, EditError> {
    let light = LIGHTS.iter().find(|light| light.name == name);
    match (name, light) {
        (FLOOR, _) => floor(scene),
        (MIRROR, _) => framed_mirror(scene),
        (_, Some(light)) => add_light_as(scene, light),
        _ => solid(scene, name),
    }
}

/// Gives an object or a part the material of a preset, or a material the preset itself. A plastic or diffuse
/// object keeps its colour.
pub fn give_preset(scene: &Scene, target: &Target, word: &str) -> Result<Edit, EditError> {
    let Ok(mut body) = body(scene, target) else {
        let Target::Material(_) = target else {
            return Err(EditError::new("only objects and materials can be made of it", ""));
        };
        return set(scene, target, "preset", word);
    };
    let color = material(scene, target).map(|material| material.color);
    let mut next = scene.clone();
    body.material = material_of(&mut next, preset(word)?, color);
    set_body(&mut next, target, body);
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
    let unknown = || EditError::new(format!("there is no material \"{word}\" ready made"), "");
    found.then_some(preset).ok_or_else(unknown)
}

/// Returns the name of the material of `preset`, which is added unless the scene has it. Plastic and
/// diffuse materials get `color`, or else a free colour.
fn material_of(scene: &mut Scene, preset: Preset, color: Option<Color>) -> String {
    let mut material = preset.material();
    let word = Preset::CHOICES[preset as usize].name;
    let mut name = word.to_string();
    if matches!(preset, Preset::Plastic | Preset::Diffuse) {
        material.color = color.unwrap_or(free_color(scene).1);
        if let Some((hue, _)) = PALETTE.iter().find(|(_, known)| *known == material.color.0) {
            let is_plain = preset == Preset::Diffuse;
            name = if is_plain { hue.to_string() } else { format!("{hue} {word}") };
        }
    }
    let known = scene.materials.iter().find(|(_, known)| **known == material);
    known.map(|(name, _)| name.clone()).unwrap_or_else(|| {
        let name = free_material(scene, &name);
        scene.materials.insert(name.clone(), material);
        name
    })
}

/// Adds a solid whose `name` has a preset, or the colour of a diffuse one, and one of [`BODIES`].
fn solid(scene: &Scene, name: &str) -> Result<Edit, EditError> {
    let (word, body) = name.rsplit_once(' ').unwrap_or((name, ""));
    let color = PALETTE.iter().find(|(hue, _)| *hue == word).map(|(_, color)| Color(*color));
    let preset = if color.is_some() { Preset::Diffuse } else { preset(word)? };
    let kind = BODIES.iter().find(|(known, _)| *known == body).map_or(body, |(_, kind)| *kind);
    let mut with_material = scene.clone();
    let material = material_of(&mut with_material, preset, color);
    let mut edit = add_object(&with_material, kind, Some(&material))?;
    let name = free_object(scene, name);
    edit.scene
        .objects
        .iter_mut()
        .next_back()
        .into_iter()
        .for_each(|last| last.name.clone_from(&name));
    Edit::checked(edit.scene, edit.target, format!("add {name}"))
}

/// Adds the materials and objects of the scene file `text` under names that are free. `numbers` are
/// the values of the words in angle brackets.
fn add_parts(
    scene: &Scene,
    name: &str,
    text: &str,
    numbers: &[(&str, f64)],
) -> Result<Edit, EditError> {
    let fill =
        |text: String, (word, x): &(&str, f64)| text.replace(&format!("<{word}>"), &number(*x));
    let text = numbers.iter().fold(text.to_string(), fill);
    let mut parts = Scene::parse(&text, name).map_err(|e| EditError::new(e.to_string(), ""))?;
    let mut next = scene.clone();
    for (name, material) in parts.materials {
        let free = free_material(&next, &name);
        parts.objects.iter_mut().for_each(|object| object.rename_material(&name, &free));
        next.materials.insert(free, material);
    }
    for object in parts.objects {
        let name = free_object(&next, &object.name);
        next.objects.push(Object { name, ..object });
    }
    let target = Target::Object(next.objects.len() - 1);
    Edit::checked(next, target, format!("add {name}"))
}

fn floor(scene: &Scene) -> Result<Edit, EditError> {
    // Squares of half the size of a new object, two in a repetition.
    let scale = round_significant(1.0 / usual_size(scene), 2);
    let numbers = [("scale", scale), ("height", plane_height(scene))];
    add_parts(scene, FLOOR, include_str!("ready_made/floor.toml"), &numbers)
}

/// Adds a mirror and its frame, which stand behind all solids and in front of a wall behind them.
fn framed_mirror(scene: &Scene) -> Result<Edit, EditError> {
    let (base, turn) = place_behind(scene);
    let eye = DVec3::from_array(scene.camera.eye);
    let [_, up, forward] = scene.camera.frame();
    let [half_width, half_height] = scene.camera.half_size(scene.film.size.map(f64::from));
    // The upper edge is seen, with some room above it.
    let ray = forward + up * (0.8 * half_height);
    let level = |v: DVec3| v.with_y(0.0).length().max(1e-9);
    let top = eye.y + ray.y * level(base - eye) / level(ray) - base.y;
    let width = round_significant(half_width * forward.dot(base - eye).abs(), 2);
    let bar = round_significant(0.04 * width, 1);
    let height = round_significant((top - 2.0 * bar).clamp(0.3 * width, 0.66 * width), 2);
    let [front_x, _, front_z] = rotated_y([0.0, 0.0, 1.0], turn);
    let middle = bar + height / 2.0;
    let numbers = [
        ("x", base.x),
        ("y", base.y),
        ("z", base.z),
        ("width", width),
        ("height", height),
        ("outer width", width + 2.0 * bar),
        ("outer height", height + 2.0 * bar),
        ("bar", bar),
        ("depth", 2.0 * bar),
        ("middle", middle),
        ("center y", base.y + middle),
    ];
    let lengths = numbers.map(|(word, x)| (word, round_nice(x, width)));
    let angles = [("turn", turn), ("front x", front_x), ("front z", front_z)];
    let numbers = [&lengths[..], &angles].concat();
    add_parts(scene, MIRROR, include_str!("ready_made/mirror.toml"), &numbers)
}

/// Returns a position on the ground behind all solids and before a wall behind them, and the rotation
/// \[degrees\] about the vertical that turns what stands there to the camera.
fn place_behind(scene: &Scene) -> (DVec3, f64) {
    let ([_, _, forward], eye) = (scene.camera.frame(), DVec3::from_array(scene.camera.eye));
    let turn = rounded_to((-forward.x).atan2(-forward.z).to_degrees() / 5.0, 0) * 5.0;
    let away = -DVec3::from(rotated_y([0.0, 0.0, 1.0], turn));
    let size = usual_size(scene);
    let aim = eye + forward * pivot_distance(scene);
    let forms: Vec<_> = scene.objects.iter().map(Object::form).collect();
    let (solids, walls): (Vec<_>, Vec<_>) = forms.iter().partition(|form| form.is_solid());
    let depths = solids.iter().filter_map(|form| form.bounds()).map(|(low, high)| {
        away.dot((low + high) / 2.0 - aim) + ((high - low) / 2.0).dot(away.abs())
    });
    let behind = depths.fold(0.0, f64::max) + 1.5 * size;
    let wall = walls.iter().filter_map(|wall| wall.cast(aim, away)).reduce(f64::min);
    let depth = wall.map_or(behind, |wall| behind.min(wall - 0.2 * size));
    let base = (aim + away * depth).with_y(ground_height(scene, aim, size));
    (base.map(|x| round_nice(x, 10.0 * size)), turn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::add::view_size;
    use crate::edit::bounds::Extent;
    use crate::shape::Shape;

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
        for name in ["gold ball", "checker floor", "glass ball", MIRROR, "red ball", "rubber cone"]
        {
            scene = add_ready_made(&scene, name).unwrap_or_else(|e| panic!("{name}: {e}")).scene;
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
        let again = add_ready_made(&scene, "gold cube").unwrap().scene;
        assert_eq!(again.materials.len(), scene.materials.len(), "gold is there");
        assert!(add_ready_made(&scene, "paper ball").is_err());
    }

    #[test]
    fn mirror_faces_the_camera_from_every_side() {
        for eye in [[4.0, 1.5, 3.0], [-300.0, 90.0, 10.0], [0.02, 0.01, -0.04]] {
            let mut scene = empty();
            scene.camera.eye = eye;
            let scene = add_ready_made(&scene, MIRROR).unwrap().scene;
            let Shape::Rectangle(mirror) = &scene.objects[1].shape else { panic!() };
            let to_eye = (DVec3::from(eye) - DVec3::from(mirror.center)).with_y(0.0);
            let along = DVec3::from(mirror.normal).dot(to_eye.normalize());
            assert!(along > 5f64.to_radians().cos(), "{eye:?}: {along}");
        }
    }

    #[test]
    fn presets_are_given_to_one_object_and_unused_materials_removed() {
        let scene = add_ready_made(&empty(), "red ball").unwrap().scene;
        let ball = Target::Object(0);
        let gold = give_preset(&scene, &ball, "gold").unwrap();
        assert_eq!(gold.scene.objects[0].material, "gold");
        let plastic = give_preset(&scene, &ball, "plastic").unwrap().scene;
        assert_eq!(plastic.materials["red plastic"].color, scene.materials["red"].color);
        assert!(give_preset(&scene, &Target::Camera, "gold").is_err());
        let purged = purge_materials(&gold.scene).unwrap().scene;
        assert_eq!(purged.materials.keys().collect::<Vec<_>>(), ["gold"]);
        assert!(purge_materials(&purged).is_err());
        let direct = give_preset(&scene, &Target::Material("red".into()), "copper").unwrap().scene;
        assert_eq!(direct.materials["red"], Preset::Copper.material());
    }
}
