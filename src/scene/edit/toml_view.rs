//! One subject as a tree of values behind the keys of its table of fields. Only that subject is
//! taken apart, never the whole scene.

use crate::scene::Scene;
use crate::scene::edit::{Refusal, Subject};
use crate::scene::{AMBIENT_FIELDS, BACKGROUND_FIELDS, FILM_FIELDS, OBJECT_FIELDS, TRACE_FIELDS};
use crate::value::{Field, ValueType};
use crate::{camera, light, material};
use serde::Serialize;
use serde::de::DeserializeOwned;
use toml::{Table, Value};

/// The keys that `subject` may have.
pub(super) fn fields(subject: &Subject) -> &'static [Field] {
    match subject {
        Subject::Camera | Subject::View(_) => camera::FIELDS,
        Subject::Ambient => AMBIENT_FIELDS,
        Subject::Background => BACKGROUND_FIELDS,
        Subject::Light(_) => light::FIELDS,
        Subject::Object(_) => OBJECT_FIELDS,
        Subject::Material(_) => material::FIELDS,
        Subject::Film => FILM_FIELDS,
        Subject::Trace => TRACE_FIELDS,
    }
}

/// Keys of which at most one is given.
pub(super) fn rivals(subject: &Subject) -> &'static [&'static str] {
    match subject {
        Subject::Camera | Subject::View(_) => &["target", "direction"],
        Subject::Light(_) => &["point", "directional"],
        Subject::Material(_) => &["reflectance", "metal"],
        _ => &[],
    }
}

/// The values of `subject`, those that hold because nothing else is said among them.
pub(super) fn read(scene: &Scene, subject: &Subject) -> Result<Table, Refusal> {
    fn table<T: Serialize>(part: Option<&T>) -> Option<Table> {
        part.and_then(|part| Table::try_from(part).ok())
    }
    let read = match subject {
        Subject::Camera => table(Some(&scene.camera)),
        Subject::View(name) => table(scene.views.get(name)),
        Subject::Ambient => table(Some(&scene.ambient)),
        Subject::Background => table(Some(&scene.background)),
        Subject::Light(i) => table(scene.lights.get(*i)),
        Subject::Object(i) => table(scene.objects.get(*i)),
        Subject::Material(name) => table(scene.materials.get(name)),
        Subject::Film => table(Some(&scene.film)),
        Subject::Trace => table(Some(&scene.trace)),
    };
    read.ok_or_else(|| Refusal::gone(subject))
}

/// A copy of `scene` with the values of `subject` replaced.
pub(super) fn write(scene: &Scene, subject: &Subject, values: Table) -> Result<Scene, Refusal> {
    fn fill<T: DeserializeOwned>(part: Option<&mut T>, values: Table) -> Result<(), Refusal> {
        let wrong = |e: toml::de::Error| Refusal::new(e.message(), "The scene stays as it was.");
        if let Some(part) = part {
            // As text: the readers of files serve, and no second set of them is compiled.
            *part = toml::from_str(&values.to_string()).map_err(wrong)?;
        }
        Ok(())
    }
    let mut next = scene.clone();
    match subject {
        Subject::Camera => fill(Some(&mut next.camera), values)?,
        Subject::View(name) => fill(next.views.get_mut(name), values)?,
        Subject::Ambient => fill(Some(&mut next.ambient), values)?,
        Subject::Background => fill(Some(&mut next.background), values)?,
        Subject::Light(i) => fill(next.lights.get_mut(*i), values)?,
        Subject::Object(i) => {
            fill(next.objects.get_mut(*i), values)?;
            if let (Some(new), Some(old)) = (next.objects.get_mut(*i), scene.objects.get(*i)) {
                new.shape.resolve_as(&old.shape);
            }
        }
        Subject::Material(name) => {
            fill(next.materials.get_mut(name), values)?;
            let old = scene.materials.get(name);
            if let (Some(new), Some(old)) = (next.materials.get_mut(name), old) {
                new.resolve_as(old);
            }
        }
        Subject::Film => fill(Some(&mut next.film), values)?,
        Subject::Trace => fill(Some(&mut next.trace), values)?,
    }
    Ok(next)
}

/// The field that the dotted `key` leads to.
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

/// What stands behind the dotted `key`.
pub(super) fn get<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let mut keys = key.split('.');
    let first = table.get(keys.next()?)?;
    keys.try_fold(first, |value, key| match value {
        Value::Table(table) => table.get(key),
        Value::Array(list) => list.get(key.parse::<usize>().ok()?),
        _ => None,
    })
}

/// Puts `value` behind the dotted `key`, whose tables are there; nothing (`None`) removes the key.
/// Whether there was a place for it.
pub(super) fn put(table: &mut Table, key: &str, value: Option<Value>) -> bool {
    let (outer, last) = match key.rsplit_once('.') {
        Some((outer, last)) => (Some(outer), last),
        None => (None, key),
    };
    let place = match outer {
        None => Some(table),
        Some(outer) => {
            let mut keys = outer.split('.');
            let first = keys.next().and_then(|key| table.get_mut(key));
            let place = first.and_then(|first| {
                keys.try_fold(first, |value, key| match value {
                    Value::Table(table) => table.get_mut(key),
                    Value::Array(list) => list.get_mut(key.parse::<usize>().ok()?),
                    _ => None,
                })
            });
            place.and_then(Value::as_table_mut)
        }
    };
    let Some(place) = place else { return false };
    match value {
        Some(value) => drop(place.insert(last.to_string(), value)),
        None => drop(place.remove(last)),
    }
    true
}
