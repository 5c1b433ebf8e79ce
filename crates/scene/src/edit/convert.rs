//! Conversion between kinds of shapes, lights, textures and cameras, which keeps position, size,
//! direction and brightness where possible.

use crate::Scene;
use crate::camera::{Camera, Focus, ViewAngle};
use crate::edit::bounds::scene_bounds;
use crate::edit::compound::{body, set_body};
use crate::edit::set::{label, replace};
use crate::edit::{Edit, EditError, Target, lens};
use crate::light::{EmissiveSurface, Falloff, Light, LightKind, LightUnit, Placement};
use crate::material::Material;
use crate::shape::Shape;
use crate::value::{
    Field, KeyNode, KeyValue, NumberRange, ValueType, number, round_fine, round_nice,
    round_significant, rounded_to, unit,
};
use glam::DVec3;
use std::f64::consts::PI;

const fn kind(name: &'static str, doc: &'static str) -> Field {
    Field::required(name, ValueType::Text, "", doc)
}

/// Field for the kind of a light. The inspector shows it as a row, but it is not a key of scene
/// files.
pub(super) const KIND: Field =
    Field::required("kind", ValueType::OneOf(LightKind::FIELDS), "", "Kind of light source.");

/// Choice between `target` and `direction` of a camera, a row of the inspector but no key of files.
pub(super) const AIM: Field = Field::required(
    "aim",
    ValueType::OneOf(&[
        kind("target", "Directed at a point."),
        kind("direction", "A fixed direction."),
    ]),
    "",
    "Target point or fixed direction of the camera.",
);

/// Converts the value of `key` to the kind `name`. Nothing changes if it has this kind already.
pub(super) fn switch(
    scene: &Scene,
    target: &Target,
    key: &str,
    name: &str,
) -> Result<Edit, EditError> {
    let mut next = scene.clone();
    let mut note = None;
    match target {
        Target::Light(i) => {
            let light = next.lights.get_mut(*i).ok_or_else(|| EditError::gone(target))?;
            note = switch_light(light, scene, name);
        }
        Target::Camera => switch_camera(&mut next.camera, scene, key, name),
        Target::View(view) => {
            let camera = next.cameras.get_mut(view).ok_or_else(|| EditError::gone(target))?;
            switch_camera(camera, scene, key, name);
        }
        Target::Object(_) | Target::Part(..) => {
            let mut body = body(scene, target)?;
            if body.shape.key() != name
                && let Some(shape) = convert_shape(&body.shape, name, scene)
            {
                body.shape = shape;
                set_body(&mut next, target, body);
            }
        }
        Target::Material(material) => {
            let material =
                next.materials.get_mut(material).ok_or_else(|| EditError::gone(target))?;
            switch_texture(material, key, name);
        }
        Target::Group(_) | Target::Settings(_) => {}
    }
    let label = label(&next, target, key);
    Ok(Edit::checked(next, target.clone(), label)?.with_note(note))
}

/// Returns a shape of the kind `name` with the place, size and rotation of `shape`.
fn convert_shape(shape: &Shape, name: &str, scene: &Scene) -> Option<Shape> {
    let form = shape.form();
    let (base, size) = match form.bounds() {
        Some((low, high)) => {
            // The bounding box of a rotated shape is larger than the shape.
            let mut straight = shape.clone();
            straight.rotate_y(-shape.rotation());
            let (l, h) = straight.form().bounds().unwrap_or((low, high));
            let size = h - l;
            let usual = size.max_element();
            let whole = size.map(|s| if s > 1e-9 * usual { s } else { usual });
            let middle = (low + high) / 2.0;
            let base = if form.is_solid() { low.y } else { middle.y - size.y / 2.0 };
            (DVec3::new(middle.x, base, middle.z), whole)
        }
        None => (shape.position(), DVec3::splat(scene_bounds(scene).radius / 2.0)),
    };
    let scale = size.min_element();
    let base = base.map(|x| round_nice(x, scale));
    let size = size.map(|x| round_significant(x, 6));
    let mut next = Shape::fitted_to(name, base, size)?;
    next.rotate_y(shape.rotation());
    Some(next)
}

/// Converts a light to the kind `name`. The light keeps its position, direction and size where the
/// new kind has them. A light that had no direction is aimed at the centre of the scene; one that
/// had no position is placed at a distance of three scene radii from the centre. The irradiance at
/// the centre is kept if the range of intensities allows it. Returns a note if this irradiance
/// requires another intensity, otherwise `None`.
fn switch_light(light: &mut Light, scene: &Scene, name: &str) -> Option<String> {
    if light.kind.key() == name {
        return None;
    }
    let ball = scene_bounds(scene);
    let center = ball.center;
    let along = match (light.direction(), light.position()) {
        (Some(direction), _) => unit(direction),
        (None, Some(from)) => unit(center - DVec3::from_array(from)),
        (None, None) => None,
    };
    let along = along.unwrap_or(DVec3::NEG_Y);
    let direction = light.direction().unwrap_or(along.map(|x| rounded_to(x, -3)).to_array());
    let far = || (center - along * (3.0 * ball.radius)).map(|x| round_nice(x, ball.radius));
    let position = light.position().unwrap_or_else(|| far().to_array());
    let radius = match light.surface() {
        Some(EmissiveSurface::Rectangle { size: [width, height], .. }) => {
            0.5 * (width * height).sqrt()
        }
        Some(surface) => surface.radius(),
        None => ball.radius / 5.0,
    };
    let kind = LightKind::placed(name, &Placement { position, direction, radius })?;
    let old = light.clone();
    light.kind = kind;
    if light.surface().is_none() {
        light.unit = LightUnit::Radiance;
    }
    if !light.has_radiance() {
        light.visible = true;
    }
    if light.apex().is_none() {
        light.falloff = Falloff::None;
    }
    let factor = irradiance_at(&old, center) / irradiance_at(light, center);
    ((factor - 1.0).abs() > 1e-3 && factor.is_finite()).then(|| refit(light, factor))
}

/// Returns the irradiance that `light` would cause with the intensity 1, at `point` on a surface
/// that faces the light. A spot light is taken to be aimed at the point, an environment to be
/// white. A light with a size counts as a light of the same area that is far away. The irradiance
/// is at most that of a hemisphere of the light's radiance.
pub(super) fn irradiance_at(light: &Light, point: DVec3) -> f64 {
    let Some(position) = light.position() else { return PI };
    let squared = (DVec3::from_array(position) - point).length_squared();
    match light.surface() {
        None if light.falloff == Falloff::None => PI,
        None => 1.0 / squared,
        Some(surface) => {
            let radiance = match light.unit {
                LightUnit::Radiance => 1.0,
                LightUnit::Power => 1.0 / (PI * surface.area()),
            };
            radiance * (surface.frontal_area() / squared).min(PI)
        }
    }
}

/// Changes the falloff of the light at `index`, a point or spot light. The intensity is changed so
/// that the irradiance at the centre of the scene is kept.
pub(super) fn switch_falloff(
    scene: &Scene,
    index: usize,
    falloff: KeyValue,
) -> Result<Edit, EditError> {
    let target = Target::Light(index);
    let mut edit = replace(scene, &target, "falloff", falloff)?;
    let old = &scene.lights[index];
    let light = &mut edit.scene.lights[index];
    if light.falloff != old.falloff {
        let center = scene_bounds(scene).center;
        let factor = irradiance_at(old, center) / irradiance_at(light, center);
        edit.note = Some(refit(light, factor));
    }
    Ok(edit)
}

/// Multiplies the intensity of `light` by `factor`. If the product is out of range, the intensity
/// is kept. Returns a note for the user on the old and the new intensity.
fn refit(light: &mut Light, factor: f64) -> String {
    let fitted = round_significant(light.intensity * factor, 3);
    let (old, new) = (number(light.intensity), number(fitted));
    if !NumberRange::LIGHT.holds(fitted) {
        return format!("Intensity {old} stays: {new}, as bright as before, is out of range.");
    }
    light.intensity = fitted;
    format!("Intensity {old} became {new}: as bright as before in the middle of the scene.")
}

/// Sets the kind of `texture` or `bump`. The placement of a texture is kept.
fn switch_texture(material: &mut Material, key: &str, name: &str) {
    let placement = material.texture.as_ref().map(|texture| *texture.placement());
    if let Some(node) = material.child_mut(key) {
        node.make_child(name);
    }
    if let (Some(texture), Some(placement)) = (&mut material.texture, placement) {
        *texture.placement_mut() = placement;
    }
}

/// Converts the value of `key`, such as `target` to `direction`. Only rounding changes the picture.
fn switch_camera(camera: &mut Camera, scene: &Scene, key: &str, name: &str) {
    if key == "view_angle" {
        let [width, height] = scene.film.size.map(f64::from);
        let across = |degrees: f64, ratio: f64| {
            let half = (degrees.to_radians() / 2.0).tan() * ratio;
            round_significant(2.0 * half.atan().to_degrees(), 6).min(179.999)
        };
        camera.view_angle = match (camera.view_angle, name) {
            (ViewAngle::Vertical(v), "horizontal") => {
                ViewAngle::Horizontal(across(v, width / height))
            }
            (ViewAngle::Horizontal(h), "vertical") => {
                ViewAngle::Vertical(across(h, height / width))
            }
            (same, _) => same,
        };
        return;
    }
    if matches!(key, "aperture" | "focus") {
        return lens::switch(camera, scene, key, name);
    }
    let eye = DVec3::from_array(camera.eye);
    match (name, camera.target, camera.direction) {
        ("direction", Some(_), _) => {
            let view = camera.view().unwrap_or(DVec3::NEG_Z);
            if camera.lens_radius() > 0.0 && camera.focus.is_none() {
                // The target was in focus; a focus distance keeps it so.
                let distance = round_significant(camera.focus_depth(), 5);
                camera.focus = Some(Focus::Distance(distance));
            }
            camera.direction = Some(view.map(|x| rounded_to(x, -6)).to_array());
            camera.target = None;
        }
        ("target", _, Some(_)) => {
            let seen = Scene { camera: camera.clone(), ..scene.clone() };
            let distance = crate::edit::pivot_distance(&seen);
            if let Some(view) = camera.view() {
                let target = eye + view * distance;
                camera.target = Some(target.map(|x| round_fine(x, distance)).to_array());
                camera.direction = None;
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::{rows, set};
    use crate::shape::KINDS;
    use crate::testing::mirror_room;

    #[test]
    fn converted_shapes_keep_place_and_size() {
        let scene = mirror_room();
        for object in 0..scene.objects.len() {
            let target = Target::Object(object);
            // The canonical cylinder and meshes are placed by a transform alone.
            let unplaced = ["unit_frustum", "mesh"];
            for kind in KINDS.iter().filter(|kind| !unplaced.contains(&kind.name)) {
                let edit = set(&scene, &target, "shape", kind.name);
                let edit = edit.unwrap_or_else(|e| panic!("{object} -> {}: {e}", kind.name));
                let (old, new) = (&scene.objects[object], &edit.scene.objects[object]);
                assert_eq!(new.shape.key(), kind.name);
                let (Some(a), Some(b)) = (old.form().bounds(), new.form().bounds()) else {
                    continue;
                };
                let (from, to) = ((a.0 + a.1) / 2.0, (b.0 + b.1) / 2.0);
                let size = (a.1 - a.0).length();
                assert!((from - to).length() <= 0.6 * size, "{object} {}: {from} {to}", kind.name);
                assert!((b.1 - b.0).length() <= 1.5 * size, "{object} {}", kind.name);
            }
            let same = set(&scene, &target, "shape", scene.objects[object].shape.key()).unwrap();
            assert_eq!(same.scene, scene);
        }
        let upright = set(&scene, &Target::Object(3), "shape", "prism").unwrap();
        let Shape::Prism(prism) = &upright.scene.objects[3].shape else { panic!() };
        assert_eq!((prism.rotation, prism.side, prism.corner[1]), (30.0, 0.8, 0.0));
    }

    #[test]
    fn lights_of_every_kind_become_each_other() {
        let scene = mirror_room();
        let lamp = Target::Light(0);
        let center = scene_bounds(&scene).center;
        let irradiance = |light: &Light| light.intensity * irradiance_at(light, center);
        for from in LightKind::FIELDS {
            let from = set(&scene, &lamp, "kind", from.name).unwrap().scene;
            for to in LightKind::FIELDS {
                let edit = set(&from, &lamp, "kind", to.name).unwrap();
                assert_eq!(edit.scene.faults(), []);
                let light = &edit.scene.lights[0];
                assert_eq!(light.kind.key(), to.name);
                let ratio = irradiance(light) / irradiance(&from.lights[0]);
                assert!((ratio - 1.0).abs() < 0.01, "{}: {ratio}", to.name);
            }
        }
    }

    #[test]
    fn converted_lights_keep_side_and_brightness() {
        let mut scene = mirror_room();
        scene.lights[0].falloff = Falloff::InverseSquare;
        scene.lights[0].intensity = 40.0;
        let lamp = Target::Light(0);
        let edit = set(&scene, &lamp, "kind", "directional").unwrap();
        let light = &edit.scene.lights[0];
        assert!(light.kind.key() == "directional" && light.falloff == Falloff::None);
        let center = scene_bounds(&scene).center;
        let from = scene.lights[0].apex().unwrap();
        let expected = 40.0 / (from - center).length_squared() / std::f64::consts::PI;
        assert!((light.intensity / expected - 1.0).abs() < 0.01, "{}", light.intensity);
        assert!(edit.note.unwrap().starts_with("Intensity 40 became "));
        let direction = DVec3::from_array(light.direction().unwrap());
        let back = set(&edit.scene, &lamp, "kind", "p").unwrap().scene;
        let at = back.lights[0].apex().unwrap();
        assert!((center - at).angle_between(direction) < 1e-3);
        let even = set(&scene, &lamp, "falloff", "none").unwrap();
        assert!((even.scene.lights[0].intensity / expected - 1.0).abs() < 0.01);
        let again = set(&even.scene, &lamp, "falloff", "inv").unwrap().scene;
        assert!((again.lights[0].intensity / 40.0 - 1.0).abs() < 0.01);
        let keys: Vec<_> = rows(&edit.scene, &lamp).unwrap().into_iter().map(|r| r.key).collect();
        assert!(keys.contains(&"directional.direction".to_string()), "{keys:?}");
        // A spot light keeps the position and the falloff of a point light, and gets its direction
        // to the centre.
        let spot = set(&scene, &lamp, "kind", "spot").unwrap().scene;
        assert_eq!(spot.lights[0].position(), scene.lights[0].position());
        assert_eq!(spot.lights[0].direction(), light.direction());
        assert_eq!(spot.lights[0].falloff, Falloff::InverseSquare);
        let keys: Vec<_> = rows(&spot, &lamp).unwrap().into_iter().map(|r| r.key).collect();
        let expected = ["position", "direction", "outer_angle", "inner_angle"];
        assert_eq!(keys[3..7], expected.map(|key| format!("spot.{key}")), "{keys:?}");
        let edit = set(&spot, &lamp, "spot.outer_angle", "40").unwrap();
        let LightKind::Spot(wide) = &edit.scene.lights[0].kind else { panic!() };
        assert_eq!(wide.outer_angle, 40.0);
        assert!(set(&spot, &lamp, "spot.outer_angle", "10").is_err(), "the inner cone has 15");
        let point = set(&spot, &lamp, "kind", "point").unwrap().scene;
        assert_eq!(point.lights, scene.lights);
        let sun = set(&spot, &lamp, "kind", "directional").unwrap().scene;
        assert_eq!(sun.lights, edit_of_kind(&scene, "directional"));
    }

    fn edit_of_kind(scene: &Scene, kind: &str) -> Vec<Light> {
        set(scene, &Target::Light(0), "kind", kind).unwrap().scene.lights
    }

    #[test]
    fn converted_cameras_keep_the_picture() {
        let scene = mirror_room();
        let camera = |scene: &Scene| scene.camera.clone();
        let free = set(&scene, &Target::Camera, "aim", "direction").unwrap().scene;
        let angle = camera(&free).view().unwrap().angle_between(scene.camera.view().unwrap());
        assert!(angle < 1e-5 && camera(&free).target.is_none(), "{angle}");
        let back = set(&free, &Target::Camera, "aim", "target").unwrap().scene;
        let angle = camera(&back).view().unwrap().angle_between(scene.camera.view().unwrap());
        assert!(angle < 1e-5 && camera(&back).direction.is_none(), "{angle}");
        let wide = set(&scene, &Target::Camera, "view_angle", "horizontal").unwrap().scene;
        let expected = 2.0 * (20f64.to_radians().tan() * 4.0 / 3.0).atan().to_degrees();
        let angle = wide.camera.view_angle;
        let degrees = angle.degrees();
        assert!(angle.key() == "horizontal" && (degrees - expected).abs() < 1e-3, "{degrees}");
        let back = set(&wide, &Target::Camera, "view_angle", "v").unwrap().scene;
        assert!((back.camera.view_angle.degrees() - 40.0).abs() < 1e-3);
    }
}
