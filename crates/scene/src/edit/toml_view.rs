//! Conversion of an edit target (a light, an object, the film and so on) to a TOML table of its
//! values, and back. Only the target is serialised, never the whole scene.

use crate::Scene;
use crate::camera;
use crate::edit::{EditError, Target};
use crate::light;
use crate::material;
use crate::value::{Description, Field, TomlError, TomlValue, ValueType};
use crate::{Ambient, Background, FilmSettings, IntegratorSettings, Object};
use toml::{Table, Value};

/// Returns the keys that scene files permit for `subject`, with their types and defaults.
pub(super) fn fields(subject: &Target) -> &'static [Field] {
    match subject {
        Target::Camera | Target::View(_) => camera::FIELDS,
        Target::Ambient => Ambient::FIELDS,
        Target::Background => Background::FIELDS,
        Target::Light(_) => light::FIELDS,
        Target::Object(_) => Object::FIELDS,
        Target::Material(_) => material::FIELDS,
        Target::Film => FilmSettings::FIELDS,
        Target::IntegratorSettings => IntegratorSettings::FIELDS,
    }
}

/// Returns the mutually exclusive keys of `subject`, of which at most one may be given; empty if it
/// has none.
pub(super) fn exclusive_keys(subject: &Target) -> &'static [&'static str] {
    match subject {
        Target::Camera | Target::View(_) => &["target", "direction"],
        Target::Light(_) => crate::light::KINDS,
        Target::Material(_) => &["f0", "metal"],
        _ => &[],
    }
}

/// Returns the keys of `subject` with their values in `scene`. Keys with default values are
/// included.
pub(super) fn read(scene: &Scene, subject: &Target) -> Result<Table, EditError> {
    let read = match subject {
        Target::Camera => Some(scene.camera.to_table()),
        Target::View(name) => scene.cameras.get(name).map(TomlValue::to_table),
        Target::Ambient => Some(scene.ambient.to_table()),
        Target::Background => Some(scene.background.to_table()),
        Target::Light(i) => scene.lights.get(*i).map(TomlValue::to_table),
        Target::Object(i) => scene.objects.get(*i).map(TomlValue::to_table),
        Target::Material(name) => scene.materials.get(name).map(TomlValue::to_table),
        Target::Film => Some(scene.film.to_table()),
        Target::IntegratorSettings => Some(scene.trace.to_table()),
    };
    read.ok_or_else(|| EditError::gone(subject))
}

/// Returns a copy of `scene` in which the values of the keys of `subject` are replaced by `values`.
pub(super) fn write(scene: &Scene, subject: &Target, values: Table) -> Result<Scene, EditError> {
    fn fill<T: TomlValue>(part: Option<&mut T>, values: Table) -> Result<(), EditError> {
        let wrong = |e: TomlError| EditError::new(e.message(), "The scene is unchanged.");
        if let Some(part) = part {
            // The table is converted to text, because the parts of a scene are read only from
            // parsed text.
            *part = T::from_text(&values.to_string()).map_err(wrong)?;
        }
        Ok(())
    }
    let mut next = scene.clone();
    match subject {
        Target::Camera => fill(Some(&mut next.camera), values)?,
        Target::View(name) => fill(next.cameras.get_mut(name), values)?,
        Target::Ambient => fill(Some(&mut next.ambient), values)?,
        Target::Background => fill(Some(&mut next.background), values)?,
        Target::Light(i) => {
            fill(next.lights.get_mut(*i), values)?;
            let environment = next.lights.get_mut(*i).and_then(|light| light.environment.as_mut());
            let old = scene.lights.get(*i).and_then(|light| light.environment.as_ref());
            if let (Some(new), Some(old)) = (environment, old) {
                new.resolve_as(old);
            }
        }
        Target::Object(i) => {
            fill(next.objects.get_mut(*i), values)?;
            if let (Some(new), Some(old)) = (next.objects.get_mut(*i), scene.objects.get(*i)) {
                new.shape.resolve_as(&old.shape);
            }
        }
        Target::Material(name) => {
            fill(next.materials.get_mut(name), values)?;
            let old = scene.materials.get(name);
            if let (Some(new), Some(old)) = (next.materials.get_mut(name), old) {
                new.resolve_as(old);
            }
        }
        Target::Film => fill(Some(&mut next.film), values)?,
        Target::IntegratorSettings => fill(Some(&mut next.trace), values)?,
    }
    Ok(next)
}

/// Returns the description (type, range, help) of the dotted key `key`, whose parts are keys and
/// list indices. Returns `None` if there is no such key.
pub(super) fn field(fields: &'static [Field], key: &str) -> Option<&'static Field> {
    let (first, rest) = match key.split_once('.') {
        Some((first, rest)) => (first, Some(rest)),
        None => (key, None),
    };
    let found = fields.iter().find(|f| f.name == first)?;
    match (rest, found.takes) {
        (None, _) => Some(found),
        (Some(rest), ValueType::Table(inner) | ValueType::OneOf(inner)) => field(inner, rest),
        (Some(rest), ValueType::ListOf(inner)) => {
            let (index, rest) = rest.split_once('.')?;
            index.parse::<usize>().ok()?;
            field(inner, rest)
        }
        _ => None,
    }
}

/// Returns the value of the dotted `key`, whose parts are keys and list indices, in `table`.
/// Returns `None` if `table` does not have the key.
pub(super) fn get<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let mut keys = key.split('.');
    let first = table.get(keys.next()?)?;
    keys.try_fold(first, |value, key| match value {
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        other => other.get(key),
    })
}

/// Sets the dotted `key` of `table` to `value`, or removes `key` if `value` is `None`. Returns
/// `false` if `table` has no inner table for the parts of `key` before its last dot.
pub(super) fn insert_value(table: &mut Table, key: &str, value: Option<Value>) -> bool {
    let Some((first, rest)) = key.split_once('.') else {
        match value {
            Some(value) => drop(table.insert(key.to_string(), value)),
            None => drop(table.remove(key)),
        }
        return true;
    };
    match (table.get_mut(first), rest.split_once('.')) {
        (Some(Value::Table(inner)), _) => insert_value(inner, rest, value),
        (Some(Value::Array(list)), Some((index, rest))) => {
            let entry = index.parse().ok().and_then(|i: usize| list.get_mut(i)?.as_table_mut());
            entry.is_some_and(|inner| insert_value(inner, rest, value))
        }
        _ => false,
    }
}
