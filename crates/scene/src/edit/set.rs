//! Edits that set one value by typed text.

use crate::edit::add::fit_mesh;
use crate::edit::compound::{body, set_body};
use crate::edit::convert::{AIM, KIND};
use crate::edit::parse_value::{parse, word};
use crate::edit::part::{exclusive_keys, field, fields, part, part_mut};
use crate::edit::properties::is_material;
use crate::edit::{Edit, EditError, Target, convert};
use crate::material::METAL_REMEDY;
use crate::value::{
    DefaultValue, Field, KeyNode, KeyValue, PRESET, ValueType, node_at, node_at_mut,
};
use crate::{Scene, TransformOp};

/// Sets `key` of `target` to the value in `text`. If the key is the transform of an object, `text`
/// is a kind of step, and an identity step of this kind is appended. An empty `text` sets an
/// optional key to its default, and removes a transform step. Returns the reason and the accepted
/// values if this is refused.
pub fn set(scene: &Scene, target: &Target, key: &str, text: &str) -> Result<Edit, EditError> {
    let text = text.trim();
    part(scene, target)?;
    let field = lookup(target, key)?;
    let optional = matches!(field.preset, DefaultValue::Without(_));
    if text.is_empty() && !matches!(field.takes, ValueType::OneOf(_) if !optional) {
        return clear(scene, target, key, field);
    }
    if let ValueType::OneOf(kinds) = field.takes {
        let name = word(field, text, kinds.iter().map(|k| k.name))?;
        return convert::switch(scene, target, key, name);
    }
    if let (Target::Object(_) | Target::Part(..), ValueType::ListOf(steps)) = (target, field.takes)
    {
        let name = word(field, text, steps.iter().map(|k| k.name))?;
        let is_named = |step: &TransformOp| step.value() == Some(KeyValue::Text(name.to_string()));
        let (mut next, mut body) = (scene.clone(), body(scene, target)?);
        body.transform.extend(TransformOp::IDENTITIES.into_iter().find(is_named));
        set_body(&mut next, target, body);
        return Edit::checked(next, target.clone(), label(scene, target, key));
    }
    let value = if is_material(target, field) {
        let names = scene.materials.keys().map(String::as_str);
        KeyValue::Text(word(field, text.trim_matches('"'), names)?.to_string())
    } else {
        parse(field, text)?
    };
    if let (Target::Light(i), "falloff") = (target, key) {
        return convert::switch_falloff(scene, *i, value);
    }
    let edit = replace(scene, target, key, value)?;
    if key == "shape.mesh.file" { fit_mesh(scene, edit) } else { Ok(edit) }
}

/// Sets the number at index `component` of the value of `key`.
pub fn set_component(
    scene: &Scene,
    target: &Target,
    key: &str,
    component: usize,
    text: &str,
) -> Result<Edit, EditError> {
    let list = match node_at(part(scene, target)?, key).and_then(KeyNode::value) {
        Some(KeyValue::Numbers(list)) => list,
        Some(KeyValue::Switch(_) | KeyValue::Text(_)) | None => Vec::new(),
    };
    if component >= list.len() {
        return Err(EditError::new(format!("{key} has no number {}", component + 1), ""));
    }
    let text = text.trim();
    // Parsing the whole list applies its rules and messages to the new number.
    let parts: Vec<_> = list
        .iter()
        .enumerate()
        .map(|(i, x)| if i == component { text.to_string() } else { x.to_string() })
        .collect();
    if text.is_empty() || text.contains([',', ' ', ';', '[', ']', '#']) {
        let found = format!("number {} of {key} cannot be \"{text}\"", component + 1);
        return Err(EditError::new(found, "Expected one number."));
    }
    set(scene, target, key, &parts.join(" "))
}

/// Returns the field of `key`, including [`KIND`] and [`AIM`].
pub(super) fn lookup(target: &Target, key: &str) -> Result<&'static Field, EditError> {
    match (target, key) {
        (Target::Light(_), "kind") => Ok(&KIND),
        (Target::Camera | Target::View(_), "aim") => Ok(&AIM),
        _ => field(fields(target), key)
            .ok_or_else(|| EditError::new(format!("there is no key {key} here"), "")),
    }
}

/// Sets `key` to `value` and removes the keys that cannot be given together with it.
pub(super) fn replace(
    scene: &Scene,
    target: &Target,
    key: &str,
    value: KeyValue,
) -> Result<Edit, EditError> {
    let mut next = scene.clone();
    let part = part_mut(&mut next, target)?;
    let mut gone = None;
    let first = key.split('.').next().unwrap_or(key);
    let exclusive = exclusive_keys(target);
    if exclusive.contains(&first) {
        for rival in exclusive.iter().filter(|rival| **rival != first) {
            if let Some(node) = part.child_mut(rival).filter(|node| !node.is_absent()) {
                node.make_absent();
                gone = Some(rival);
            }
        }
    }
    if !node_at_mut(part, key).is_some_and(|node| node.set_value(value)) {
        return Err(EditError::new(format!("{key} cannot be set here"), ""));
    }
    if key == PRESET {
        part.rebase();
    }
    let note = gone.map(|rival| format!("{first} replaces {rival}."));
    let is_unseen = key == "metal"
        && matches!(target, Target::Material(name) if !next.materials[name].shows_f0());
    let note =
        note.or_else(|| is_unseen.then(|| format!("metal has no effect here. {METAL_REMEDY}")));
    Ok(Edit::checked(next, target.clone(), label(scene, target, key))?.with_note(note))
}

/// Gives the optional `key` its default, or removes the transform step that it names.
fn clear(scene: &Scene, target: &Target, key: &str, field: &Field) -> Result<Edit, EditError> {
    let mut next = scene.clone();
    let base = part(scene, target)?.base();
    let of_base = base.and_then(|base| node_at(base.as_ref(), key)?.value());
    if let (Ok(mut body), Some(step)) = (body(scene, target), key.strip_prefix("transform.")) {
        let steps = &mut body.transform;
        match step.split('.').next().and_then(|index| index.parse::<usize>().ok()) {
            Some(i) if i < steps.len() => drop(steps.remove(i)),
            _ => return Err(EditError::new(format!("there is no step {key}"), "")),
        }
        set_body(&mut next, target, body);
    } else if let Some(node) = node_at_mut(part_mut(&mut next, target)?, key) {
        match (field.preset, of_base) {
            (DefaultValue::Required, _) => {
                let found = format!("{} must not be left out", field.name);
                return Err(EditError::new(found, format!("Expected {}.", field.takes)));
            }
            (DefaultValue::Is(_), Some(value)) => drop(node.set_value(value)),
            (DefaultValue::Is(text), None) => drop(node.set_value(parse(field, text)?)),
            (DefaultValue::Without(_), _) => node.make_absent(),
        }
    }
    Edit::checked(next, target.clone(), label(scene, target, key))
}

/// Returns the label of an edit of `key` in the undo history: `radius of ball`.
pub(super) fn label(scene: &Scene, target: &Target, key: &str) -> String {
    let last = key.rsplit('.').next().unwrap_or(key).replace('_', " ");
    format!("{last} of {}", target.label(scene))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::SceneSettings;
    use crate::shape::Shape;
    use crate::testing::mirror_room;

    fn ball() -> Target {
        Target::Object(2)
    }

    fn refused(target: &Target, key: &str, text: &str) -> String {
        set(&mirror_room(), target, key, text).unwrap_err().to_string()
    }

    #[test]
    fn typed_values_are_set() {
        let scene = mirror_room();
        let edit = set(&scene, &ball(), "shape.sphere.radius", " .75").unwrap();
        assert_eq!(edit.label, "radius of ball");
        let Shape::Sphere(sphere) = &edit.scene.objects[2].shape else { panic!() };
        assert_eq!(sphere.radius, 0.75);
        let edit = set_component(&scene, &ball(), "shape.sphere.center", 1, "2").unwrap();
        let Shape::Sphere(sphere) = &edit.scene.objects[2].shape else { panic!() };
        assert_eq!(sphere.center, [-0.9, 2.0, 0.0]);
        let edit = set(&scene, &Target::Settings(SceneSettings::Film), "size", "320x200").unwrap();
        assert_eq!(edit.scene.film.size, [320, 200]);
        let edit = set(&scene, &ball(), "material", "gr").unwrap();
        assert_eq!(edit.scene.objects[2].material, "green");
        let edit = set(&scene, &Target::Light(0), "on", "off").unwrap();
        assert!(!edit.scene.lights[0].on);
    }

    #[test]
    fn refused_values_name_finding_and_expectation() {
        for (target, key, text, words) in [
            (ball(), "shape.sphere.radius", "-1", "radius is -1. Expected a number greater than 0"),
            (ball(), "shape.sphere.radius", "big", "radius cannot be \"big\". Expected a number"),
            (ball(), "shape.sphere.radius", "", "radius must not be left out"),
            (ball(), "shape.sphere.center", "1 2", "center needs 3 numbers, not 2"),
            (ball(), "name", "cube", "has the same name"),
            (ball(), "material", "rde", "Did you mean \"red\"?"),
            (ball(), "shape", "ball", "Expected one of \"sphere\", \"cube\""),
            (ball(), "no.such", "1", "there is no key no.such here"),
            (Target::Camera, "target", "0.6 1.4 4.5", "target is the eye itself"),
            (Target::Camera, "view_angle.vertical", "180", "Expected a number between 0 and 180"),
            (Target::Settings(SceneSettings::Film), "size", "99999 1", "size cannot be"),
            (Target::Object(99), "name", "x", "there is no object 100"),
            (Target::Material("rot".into()), "color", "1 1 1", "there is no material \"rot\""),
        ] {
            let message = refused(&target, key, text);
            assert!(message.contains(words), "{message}");
        }
        let one =
            set_component(&mirror_room(), &ball(), "shape.sphere.center", 3, "1").unwrap_err();
        assert!(one.found.contains("has no number 4"), "{one}");
        let two =
            set_component(&mirror_room(), &ball(), "shape.sphere.center", 0, "1 2").unwrap_err();
        assert!(two.help.contains("one number"), "{two}");
    }

    #[test]
    fn empty_text_restores_the_default() {
        let scene = mirror_room();
        let red = Target::Material("red".into());
        let edit = set(&scene, &red, "exponent", "").unwrap();
        assert_eq!(edit.scene.materials["red"].exponent, 32.0);
        let edit = set(&scene, &ball(), "name", "").unwrap();
        assert_eq!(edit.scene.objects[2].name, "");
        let edit = set(&scene, &ball(), "material", "").unwrap();
        assert_eq!(edit.scene.objects[2].material, "");
    }

    #[test]
    fn setting_a_key_removes_exclusive_keys() {
        let scene = mirror_room();
        let red = Target::Material("red".into());
        let gold = set(&scene, &red, "metal", "gold").unwrap().scene;
        let edit = set(&gold, &red, "f0", "0.5 0.5 0.5").unwrap();
        assert!(edit.scene.materials["red"].metal.is_none());
        assert!(edit.note.unwrap().contains("f0 replaces metal"));
        let edit = set(&scene, &Target::Camera, "direction", "0 0 -1").unwrap();
        assert_eq!(edit.scene.camera.target, None);
    }

    #[test]
    fn transform_steps_are_appended_and_removed() {
        let scene = mirror_room();
        let rotated = set(&scene, &ball(), "transform", "rotate_y").unwrap().scene;
        let rotated = set(&rotated, &ball(), "transform.0.rotate_y", "30").unwrap().scene;
        let moved = set(&rotated, &ball(), "transform", "tr").unwrap().scene;
        let moved = set(&moved, &ball(), "transform", "rotate").unwrap().scene;
        assert_eq!(moved.objects[2].transform.len(), 3);
        let moved = set(&moved, &ball(), "transform.2.rotate.degrees", "5").unwrap().scene;
        let moved = set(&moved, &ball(), "transform.2.rotate.degrees", "").unwrap().scene;
        let back = set(&moved, &ball(), "transform.1.translate", "").unwrap().scene;
        assert_eq!(back, rotated);
        assert_eq!(set(&back, &ball(), "transform", "").unwrap().scene, scene);
        assert!(set(&back, &ball(), "transform.7.rotate_y", "").is_err());
        assert!(set(&back, &ball(), "transform.7.rotate_y", "1").is_err());
    }
}
