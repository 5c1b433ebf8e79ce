//! Edits that set one value by typed text.

use crate::Scene;
use crate::edit::convert;
use crate::edit::convert::{AIM, KIND};
use crate::edit::parse_value::{floats, parse, word};
use crate::edit::properties::is_material;
use crate::edit::toml_view::{exclusive_keys, field, fields, get, insert_value, read, write};
use crate::edit::{Edit, EditError, Target};
use crate::value::{DefaultValue, Field, ValueType};
use toml::{Table, Value};

/// Sets `key` of `subject` to the value in `text`. `key` is the key of one of the
/// [`Property`](crate::edit::Property) rows of `subject`. For the list of transform steps,
/// `text` is the kind of a step, which is appended. An empty `text` sets an optional key to its
/// default, and removes a step of a transform, such as `transform.0.rotate_y`.
///
/// # Errors
/// Returns the reason and the accepted values, if `text` cannot be parsed or the edited scene would
/// be invalid.
pub fn set(scene: &Scene, subject: &Target, key: &str, text: &str) -> Result<Edit, EditError> {
    let text = text.trim();
    let values = read(scene, subject)?;
    let field = lookup(subject, key)?;
    let optional = matches!(field.preset, DefaultValue::Without(_));
    match field.takes {
        ValueType::OneOf(kinds) if !(text.is_empty() && optional) => {
            let name = word(field, text, kinds.iter().map(|k| k.name))?;
            return convert::switch(scene, subject, key, name);
        }
        ValueType::ListOf(steps) => {
            let mut object = values;
            match text {
                "" => drop(object.remove(key)),
                _ => {
                    let name = word(field, text, steps.iter().map(|k| k.name))?;
                    convert::append_step(&mut object, key, name);
                }
            }
            return finish(scene, subject, key, object);
        }
        _ => {}
    }
    if text.is_empty() {
        return clear(scene, subject, key, field, values);
    }
    let value = if is_material(subject, field) {
        let names = scene.materials.keys().map(String::as_str);
        Value::from(word(field, text.trim_matches('"'), names)?)
    } else {
        parse(field, text)?
    };
    if let (Target::Light(i), "falloff") = (subject, key) {
        return convert::switch_falloff(scene, *i, values, value);
    }
    replace(scene, subject, key, values, value)
}

/// Sets one number of the value of `key` to `text`; `component` is the number's index, counted from
/// 0.
///
/// # Errors
/// Returns the errors of [`set`].
pub fn set_component(
    scene: &Scene,
    subject: &Target,
    key: &str,
    component: usize,
    text: &str,
) -> Result<Edit, EditError> {
    let values = read(scene, subject)?;
    let list = get(&values, key).and_then(floats).unwrap_or_default();
    if component >= list.len() {
        return Err(EditError::new(&format!("{key} has no number {}", component + 1), ""));
    }
    let text = text.trim();
    // The whole list is parsed again, so that the rules and error messages for lists apply to the
    // new number, too.
    let parts: Vec<_> = list
        .iter()
        .enumerate()
        .map(|(i, x)| if i == component { text.to_string() } else { x.to_string() })
        .collect();
    if text.is_empty() || text.contains([',', ' ', ';', '[', ']', '#']) {
        let found = format!("number {} of {key} cannot be \"{text}\"", component + 1);
        return Err(EditError::new(&found, "Expected one number."));
    }
    set(scene, subject, key, &parts.join(" "))
}

/// Returns the field of `key`, including `kind` of a light and `aim` of a camera, which are no keys
/// of scene files. Fails if `subject` has no such key.
pub(super) fn lookup(subject: &Target, key: &str) -> Result<&'static Field, EditError> {
    match (subject, key) {
        (Target::Light(_), "kind") => Ok(&KIND),
        (Target::Camera | Target::View(_), "aim") => Ok(&AIM),
        _ => field(fields(subject), key)
            .ok_or_else(|| EditError::new(&format!("there is no key {key} here"), "")),
    }
}

/// Sets `key` to `value`, removes the keys that cannot be given together with `key`, and validates
/// the edited scene. `values` has the present values of the keys of `subject`.
pub(super) fn replace(
    scene: &Scene,
    subject: &Target,
    key: &str,
    mut values: Table,
    value: Value,
) -> Result<Edit, EditError> {
    let mut gone = None;
    let first = key.split('.').next().unwrap_or(key);
    if exclusive_keys(subject).contains(&first) {
        for rival in exclusive_keys(subject).iter().filter(|rival| **rival != first) {
            gone = values.remove(*rival).map(|_| *rival).or(gone);
        }
    }
    if !insert_value(&mut values, key, Some(value)) {
        return Err(EditError::new(&format!("{key} cannot be set here"), ""));
    }
    let note = gone.map(|rival| format!("{first} replaces {rival}."));
    Ok(finish(scene, subject, key, values)?.with_note(note))
}

/// Removes the optional `key` from `values`, the present values of the keys of `subject`; the key
/// then has its default. If `key` is a step of a transform, such as `transform.0.rotate_y`, removes
/// this step from the list instead. `field` describes the key.
///
/// # Errors
/// Fails if the key is required, if there is no such step, or if the edited scene would be invalid.
fn clear(
    scene: &Scene,
    subject: &Target,
    key: &str,
    field: &Field,
    mut values: Table,
) -> Result<Edit, EditError> {
    let parts: Vec<_> = key.split('.').collect();
    if let ["transform", index, ..] = parts[..] {
        let list = values.get_mut("transform").and_then(Value::as_array_mut);
        match (list, index.parse::<usize>()) {
            (Some(list), Ok(i)) if i < list.len() => drop(list.remove(i)),
            _ => return Err(EditError::new(&format!("there is no step {key}"), "")),
        }
    } else if field.preset == DefaultValue::Required {
        let found = format!("{} must not be left out", field.name);
        return Err(EditError::new(&found, &format!("Expected {}.", field.takes)));
    } else {
        insert_value(&mut values, key, None);
    }
    finish(scene, subject, key, values)
}

/// Creates the edit that replaces the values of the keys of `subject` by `values`, and validates
/// the edited scene. `key` is the key that changed; it names the edit in the undo history.
pub(super) fn finish(
    scene: &Scene,
    subject: &Target,
    key: &str,
    values: Table,
) -> Result<Edit, EditError> {
    let next = write(scene, subject, values)?;
    Edit::checked(next, subject.clone(), label(scene, subject, key))
}

/// Returns the label of an edit of `key` in the undo history: `radius of ball`.
pub(super) fn label(scene: &Scene, subject: &Target, key: &str) -> String {
    let last = key.rsplit('.').next().unwrap_or(key).replace('_', " ");
    format!("{last} of {}", subject.label(scene))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in;
    use crate::shape::Shape;

    fn ball() -> Target {
        Target::Object(2)
    }

    fn refused(subject: &Target, key: &str, text: &str) -> String {
        set(&built_in(), subject, key, text).unwrap_err().to_string()
    }

    #[test]
    fn typed_values_are_set() {
        let scene = built_in();
        let edit = set(&scene, &ball(), "shape.sphere.radius", " .75").unwrap();
        assert_eq!(edit.label, "radius of ball");
        let Shape::Sphere(sphere) = &edit.scene.objects[2].shape else { panic!() };
        assert_eq!(sphere.radius, 0.75);
        let edit = set_component(&scene, &ball(), "shape.sphere.center", 1, "2").unwrap();
        let Shape::Sphere(sphere) = &edit.scene.objects[2].shape else { panic!() };
        assert_eq!(sphere.center, [-0.9, 2.0, 0.0]);
        let edit = set(&scene, &Target::Film, "size", "320x200").unwrap();
        assert_eq!(edit.scene.film.size, [320, 200]);
        let edit = set(&scene, &ball(), "material", "gr").unwrap();
        assert_eq!(edit.scene.objects[2].material, "green");
        let edit = set(&scene, &Target::Light(0), "on", "off").unwrap();
        assert!(!edit.scene.lights[0].on);
    }

    #[test]
    fn refused_values_name_finding_and_expectation() {
        for (subject, key, text, words) in [
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
            (Target::Film, "size", "99999 1", "size cannot be"),
            (Target::Object(99), "name", "x", "there is no object 100"),
            (Target::Material("rot".into()), "color", "1 1 1", "there is no material \"rot\""),
        ] {
            let message = refused(&subject, key, text);
            assert!(message.contains(words), "{message}");
        }
        let one = set_component(&built_in(), &ball(), "shape.sphere.center", 3, "1").unwrap_err();
        assert!(one.found.contains("has no number 4"), "{one}");
        let two = set_component(&built_in(), &ball(), "shape.sphere.center", 0, "1 2").unwrap_err();
        assert!(two.help.contains("one number"), "{two}");
    }

    #[test]
    fn empty_text_restores_the_default() {
        let scene = built_in();
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
        let scene = built_in();
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
        let scene = built_in();
        let turned = set(&scene, &ball(), "transform", "rotate_y").unwrap().scene;
        let turned = set(&turned, &ball(), "transform.0.rotate_y", "30").unwrap().scene;
        let moved = set(&turned, &ball(), "transform", "tr").unwrap().scene;
        let moved = set(&moved, &ball(), "transform", "rotate").unwrap().scene;
        assert_eq!(moved.objects[2].transform.len(), 3);
        let moved = set(&moved, &ball(), "transform.2.rotate.degrees", "5").unwrap().scene;
        let moved = set(&moved, &ball(), "transform.2.rotate.degrees", "").unwrap().scene;
        let back = set(&moved, &ball(), "transform.1.translate", "").unwrap().scene;
        assert_eq!(back, turned);
        assert_eq!(set(&back, &ball(), "transform", "").unwrap().scene, scene);
        assert!(set(&back, &ball(), "transform.7.rotate_y", "").is_err());
        assert!(set(&back, &ball(), "transform.7.rotate_y", "1").is_err());
    }
}
