//! Adding objects, lights and materials, with defaults that fit the scene.

use crate::edit::bounds::pivot_distance;
use crate::edit::convert::irradiance_at;
use crate::edit::placement::{ground_height, place_for};
use crate::edit::properties::{Word, words};
use crate::edit::unique_name::{free_light, free_material, free_object};
use crate::edit::{Edit, EditError, Target};
use crate::light::{Falloff, Light, LightKind, Placement};
use crate::material::Material;
use crate::shape::{KINDS, Shape, compose};
use crate::value::{
    Color, floor_log10, names, number, round_nice, round_significant, rounded_to, unit,
};
use crate::{Object, Scale, Scene, TransformOp};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_kernel::primitive::{Form, ParallelogramForm};

/// Returns the name and a description of each kind of object that can be added.
pub fn object_kinds() -> Vec<Word> {
    words(KINDS)
}

/// Returns the name and a description of each kind of light that can be added.
pub fn light_kinds() -> Vec<Word> {
    words(LightKind::FIELDS)
}

/// Names and linear colours of new materials. A new material gets the first colour that no other one
/// has.
pub(super) const PALETTE: [(&str, [f64; 3]); 6] = [
    ("red", [0.85, 0.16, 0.11]),
    ("blue", [0.13, 0.28, 0.8]),
    ("green", [0.15, 0.62, 0.28]),
    ("yellow", [0.9, 0.68, 0.12]),
    ("purple", [0.55, 0.2, 0.65]),
    ("teal", [0.1, 0.6, 0.65]),
];

/// Returns the first free colour of the palette. If no colour is free, the colours are taken in turn.
pub(super) fn free_color(scene: &Scene) -> (&'static str, Color) {
    let used = |color: &[f64; 3]| scene.materials.values().any(|m| m.color.0 == *color);
    let free = PALETTE.iter().find(|(_, color)| !used(color));
    let (name, color) = free.unwrap_or(&PALETTE[scene.materials.len() % PALETTE.len()]);
    (name, Color(*color))
}

fn fresh_material(scene: &Scene) -> Material {
    let (diffuse, specular, exponent) = (0.8, 0.2, 40.0);
    Material { color: free_color(scene).1, diffuse, specular, exponent, ..Material::default() }
}

/// Adds an object. It rests on a surface, as near as possible to the middle of the view, and has an
/// eighth of the view's width. A plane is put at height 0. Without `material` the object gets a new
/// material. Fails if there is no such kind or material.
pub fn add_object(scene: &Scene, kind: &str, material: Option<&str>) -> Result<Edit, EditError> {
    let size = usual_size(scene);
    let room = DVec3::splat(size);
    let base = place_for(scene, room);
    let Some(mut shape) = Shape::fitted_to(kind, base, room) else {
        let found = format!("there is no kind of object called \"{kind}\"");
        return Err(EditError::new(found, format!("Expected one of {}.", names(KINDS))));
    };
    face_camera(&mut shape, scene);
    if let Form::Plane(_) = shape.form() {
        let height = plane_height(scene);
        shape.anchor_points_mut().into_iter().for_each(|anchor| *anchor = [0.0, height, 0.0]);
    }
    let mut next = scene.clone();
    let name = free_object(scene, kind);
    let material = match material {
        Some(shared) => shared.to_string(),
        None => {
            let unique_name = free_material(scene, &name);
            next.materials.insert(unique_name.clone(), fresh_material(scene));
            unique_name
        }
    };
    let transform = if shape.anchor_points_mut().is_empty() {
        upright_steps(&shape, base, size)
    } else {
        Vec::new()
    };
    next.objects.push(Object { name, material, shape, transform });
    let target = Target::Object(next.objects.len() - 1);
    Edit::checked(next, target, format!("add {kind}"))
}

/// Returns steps that scale the longest side of `shape`, which has no key for its position, to
/// `size` and place it upright on `base`. Empty if the shape has no bounds.
fn upright_steps(shape: &Shape, base: DVec3, size: f64) -> Vec<TransformOp> {
    let mut steps: Vec<_> = shape.upright().into_iter().collect();
    let Some((low, high)) = shape.form().transformed(&compose(&steps)).bounds() else {
        return Vec::new();
    };
    let factor = size / (high - low).max_element();
    let foot = DVec3::new(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z));
    let by = (base - factor * foot).map(|x| crate::value::round_fine(x, size));
    steps.extend([TransformOp::Scale(Scale([factor; 3])), TransformOp::Translate(by.to_array())]);
    steps
}

/// Returns the height of a new plane: 0, or a little below all objects if the ground is there.
pub(super) fn plane_height(scene: &Scene) -> f64 {
    let size = usual_size(scene);
    let is_level =
        |object: &Object| object.form().plane().is_some_and(|plane| plane.normal.y.abs() > 0.5);
    let is_taken = scene.objects.iter().any(is_level)
        && ground_height(scene, DVec3::from_array(scene.camera.eye), size) == 0.0;
    let lows = scene.objects.iter().filter_map(|object| Some(object.form().bounds()?.0.y));
    let under = lows.reduce(f64::min).unwrap_or(0.0) - 0.1 * size;
    if is_taken { round_nice(under, size) } else { 0.0 }
}

/// Fits the mesh that `edit` reads for an object of `old` without a file into the placeholder's box.
pub(super) fn fit_mesh(old: &Scene, edit: Edit) -> Result<Edit, EditError> {
    let Target::Object(i) = edit.target else { return Ok(edit) };
    let (before, mut next) = (&old.objects[i], edit.scene.clone());
    let object = &mut next.objects[i];
    let triangles = object.shape.mesh().map(|mesh| mesh.mesh.triangles.len());
    let (None, Some(triangles), Some((low, high)), Some((from, to))) =
        (before.shape.file(), triangles, before.form().bounds(), object.shape.form().bounds())
    else {
        return Ok(edit);
    };
    let size = round_significant((high - low).max_element(), 2);
    let middle = (low + high) / 2.0;
    object.transform = upright_steps(&object.shape, middle.with_y(low.y), size);
    let [x, y, z] = (to - from).to_array().map(|x| number(round_significant(x, 3)));
    let size = number(size);
    let note = format!("{triangles} triangles, {x} x {y} x {z} units, scaled to {size}.");
    Ok(Edit::checked(next, edit.target, edit.label)?.with_note(Some(note)))
}

/// Returns width and height of what the camera sees at the distance of its target.
pub(super) fn view_size(scene: &Scene) -> [f64; 2] {
    let half_size = scene.camera.half_size(scene.film.size.map(f64::from));
    half_size.map(|half| 2.0 * half * pivot_distance(scene))
}

/// Returns the length of a new object: an eighth of the view's width, rounded to one digit.
pub(super) fn usual_size(scene: &Scene) -> f64 {
    round_significant(view_size(scene)[0] / 8.0, 1)
}

/// Rotates `shape` about the vertical by a multiple of 5 degrees, so that its front faces the
/// camera. Shapes that are not flat or are nearly level stay as they are.
fn face_camera(shape: &mut Shape, scene: &Scene) {
    let Form::Parallelogram(ParallelogramForm { u, v, .. }) = shape.form() else { return };
    let front = u.cross(v).normalize();
    if front.y.abs() > 0.5 {
        return;
    }
    let heading = |d: DVec3| d.x.atan2(d.z).to_degrees();
    let toward = -scene.camera.view().unwrap_or(DVec3::NEG_Z);
    shape.rotate_y(rounded_to((heading(toward) - heading(front)) / 5.0, 0) * 5.0);
}

/// Adds a white light of the kind `kind`.
///
/// # Errors
/// Fails if there is no such kind.
pub fn add_light(scene: &Scene, kind: &str) -> Result<Edit, EditError> {
    add_light_as(scene, &ReadyLight { name: "", kind, color: Color::WHITE, size: 1.0 })
}

/// Light with a look of its own.
pub(super) struct ReadyLight<'a> {
    /// Name; empty for that of the kind.
    pub name: &'a str,
    pub kind: &'a str,
    pub color: Color,
    /// Size in units of that of a new light.
    pub size: f64,
}

/// Adds a light above what the camera looks at, to the left or right of the camera:
/// on the side with fewer lights. It exposes the picture by its distance and colour; half as much if
/// another light is on.
pub(super) fn add_light_as(scene: &Scene, ready: &ReadyLight) -> Result<Edit, EditError> {
    let ReadyLight { name, kind, color, size } = *ready;
    let [right, _, forward] = scene.camera.frame();
    let center = DVec3::from_array(scene.camera.eye) + forward * pivot_distance(scene);
    let radius = view_size(scene)[0] / 4.0;
    let level = |v: DVec3| DVec3::new(v.x, 0.0, v.z).try_normalize().unwrap_or(DVec3::X);
    let (right, forward) = (level(right), level(forward));
    let side = |light: &Light| match (light.position(), light.direction()) {
        (Some(position), _) => (DVec3::from_array(position) - center).dot(right),
        (None, Some(direction)) => unit(direction).map_or(0.0, |along| -along.dot(right)),
        (None, None) => 0.0,
    };
    let lit: f64 = scene.lights.iter().map(|l| side(l).signum()).sum();
    let toward = if lit < 0.0 { right } else { -right };
    let from = toward * 0.8 - forward * 0.8 + DVec3::Y * 1.4;
    let tenth = floor_log10(radius) - 1;
    let position = (center + from * (1.5 * radius)).map(|x| rounded_to(x, tenth)).to_array();
    let direction = (-from).normalize().map(|x| rounded_to(x, -2)).to_array();
    // A small light is bright, and its image in glossy surfaces is noisy for long.
    let placement = Placement { position, direction, radius: 0.4 * size * radius };
    let Some(placed) = LightKind::placed(kind, &placement) else {
        let found = format!("there is no kind of light called \"{kind}\"");
        let kinds = names(LightKind::FIELDS);
        return Err(EditError::new(found, format!("Expected one of {kinds}.")));
    };
    let mut light = Light { color, ..Light::new(placed) };
    let name = if name.is_empty() { light.kind.usual_name() } else { name };
    light.name = free_light(scene, name);
    let is_lit = scene.lights.iter().any(|l| l.on);
    light.intensity = EXPOSURE * if is_lit { 0.5 } else { 1.0 } / luminance(color);
    let physical = scene.lights.iter().all(|l| l.falloff == Falloff::InverseSquare);
    if physical && !scene.lights.is_empty() && light.apex().is_some() {
        // All other lights have the inverse square falloff: the new one gets it, too.
        light.falloff = Falloff::InverseSquare;
    }
    light.intensity *= PI / irradiance_at(&light, center);
    light.intensity = round_significant(light.intensity, 2);
    let note = (light.falloff == Falloff::InverseSquare).then(|| {
        let text = number(light.intensity);
        format!("It falls off with the square of the distance; intensity {text}.")
    });
    let mut next = scene.clone();
    let label = format!("add {}", light.name);
    next.lights.push(light);
    let target = Target::Light(next.lights.len() - 1);
    Ok(Edit::checked(next, target, label)?.with_note(note))
}

/// Returns the luminance of a linear colour (Rec. 709).
fn luminance(Color([red, green, blue]): Color) -> f64 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

/// Brightness of a white diffuse surface that faces the first light. Surfaces of usual albedos at
/// usual angles then have about the level 90 of 255.
const EXPOSURE: f64 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mirror_room;

    #[test]
    fn added_objects_are_visible_and_intersect_nothing() {
        let scene = mirror_room();
        for word in object_kinds() {
            let edit = add_object(&scene, &word.name, None).unwrap();
            let Target::Object(i) = edit.target else { panic!() };
            let object = &edit.scene.objects[i];
            assert_eq!(object.shape.key(), word.name);
            assert_eq!(
                object.name,
                if word.name == "cube" {
                    "cube 2"
                } else if ["prism", "pyramid"].contains(&word.name.as_str()) {
                    object.name.as_str()
                } else {
                    word.name.as_str()
                }
            );
            assert!(edit.scene.materials.contains_key(&object.material));
            let Some((low, high)) = object.form().bounds() else { continue };
            assert!(low.y.abs() < 1e-12 || word.name == "platform", "{}: {low}", word.name);
            let middle = (low + high) / 2.0;
            let [right, up, forward] = scene.camera.frame();
            let to = middle - DVec3::from_array(scene.camera.eye);
            let depth = to.dot(forward);
            let [w, h] = scene.camera.half_size([4.0, 3.0]);
            let inside = to.dot(right).abs() < w * depth && to.dot(up).abs() < h * depth;
            assert!(depth > 0.0 && inside, "{}: {middle}", word.name);
            for other in &scene.objects[2..] {
                let (a, b) = other.form().bounds().unwrap();
                assert!(!(low.cmplt(b).all() && a.cmplt(high).all()), "{}", word.name);
            }
        }
    }

    #[test]
    fn ten_added_cubes_do_not_intersect() {
        let mut scene = mirror_room();
        for _ in 0..10 {
            scene = add_object(&scene, "cube", Some("red")).unwrap().scene;
        }
        let boxes: Vec<_> = scene.objects[2..].iter().map(|o| o.form().bounds().unwrap()).collect();
        for (i, a) in boxes.iter().enumerate().skip(4) {
            for b in &boxes[..i] {
                assert!(
                    !(a.0.cmplt(b.1).all() && b.0.cmplt(a.1).all()),
                    "cube {i} stands in another"
                );
            }
        }
        assert_eq!(scene.materials.len(), 6);
    }

    #[test]
    fn objects_added_to_an_empty_scene_are_in_view() {
        for word in object_kinds() {
            let edit = add_object(&Scene::default(), &word.name, None).unwrap();
            assert_eq!(edit.scene.faults(), []);
        }
        assert!(add_object(&Scene::default(), "sphere", Some("none")).is_err());
        assert!(add_object(&Scene::default(), "blob", None).is_err());
    }

    #[test]
    fn mesh_of_a_file_gets_the_size_of_a_new_object() {
        let folder = tempfile::tempdir().unwrap();
        let obj = "v 0 0 0\nv 180 0 0\nv 0 90 0\nv 0 0 60\nf 1 2 3\nf 1 2 4\n";
        std::fs::write(folder.path().join("large.obj"), obj).unwrap();
        let path = folder.path().join("a.toml");
        std::fs::write(&path, "film.size = [64, 48]\n").unwrap();
        let added = add_object(&Scene::read(&path).unwrap(), "mesh", None).unwrap();
        let key = "shape.mesh.file";
        let edit = crate::edit::set(&added.scene, &added.target, key, "large.obj").unwrap();
        let note = "2 triangles, 180 x 90 x 60 units, scaled to 0.6.";
        assert_eq!(edit.note.as_deref(), Some(note));
        let (low, high) = edit.scene.objects[0].form().bounds().unwrap();
        assert!(low.y.abs() < 1e-9 && ((high - low).x - 0.6).abs() < 1e-6, "{low} {high}");
    }

    #[test]
    fn added_lights_alternate_sides() {
        let scene = mirror_room();
        for word in light_kinds() {
            let edit = add_light(&scene, &word.name).unwrap();
            let light = &edit.scene.lights[1];
            let x = match (light.position(), light.direction()) {
                (Some(position), _) => position[0],
                (None, Some(direction)) => -direction[0],
                (None, None) => {
                    assert!(light.environment().is_some() && light.name == "sky");
                    continue;
                }
            };
            assert!(x < 0.0, "the lamp that is there stands to the right");
            let name = match word.name.as_str() {
                "directional" => "sun",
                "spot" => "spot",
                _ => "lamp 2",
            };
            assert_eq!(light.name, name, "{}", word.name);
        }
        assert!(add_light(&scene, "area").is_err());
        let physical = "light = [{ point.position = [3, 3, 3], intensity = 40, \
                        falloff = \"inverse-square\" }]\n";
        let edit = add_light(&Scene::parse(physical, "").unwrap(), "point").unwrap();
        assert!(edit.scene.lights[1].falloff == Falloff::InverseSquare && edit.note.is_some());
    }
}
