//! Keys and values of a scene, enumerated by the tables of fields, for tests that change all of them.
#![allow(dead_code, reason = "each test file uses its part")]

use toml::{Table, Value};
use zerkalo::scene::{AssetResolver, FIELDS, Scene};
use zerkalo::value::{Field, ValueType};

/// Key of a scene: its path, with positions in lists as numbers, and its type.
#[derive(Clone, Debug)]
pub struct Key {
    pub path: Vec<String>,
    pub takes: ValueType,
}

/// Converts a scene to a table.
pub fn table(scene: &Scene) -> Table {
    Table::try_from(scene).expect("scenes are tables")
}

/// Scene of `table`, with the files of `library`; `None` if it has faults.
pub fn scene(table: &Table, library: &AssetResolver) -> Option<Scene> {
    let mut scene: Scene = table.clone().try_into().ok()?;
    scene.library = library.clone();
    scene.resolve();
    scene.faults().is_empty().then_some(scene)
}

/// All keys of the tables of fields for the contents of `scene`, given or omitted. Tables in lists or under names occur
/// once for each entry. Tables and lists occur as a whole as well.
pub fn keys(scene: &Table) -> Vec<Key> {
    let mut out = Vec::new();
    walk(FIELDS, scene, &[], &mut out);
    out
}

fn joined(path: &[String], key: &str) -> Vec<String> {
    path.iter().cloned().chain([key.to_string()]).collect()
}

fn walk(fields: &[Field], table: &Table, path: &[String], out: &mut Vec<Key>) {
    for field in fields {
        let path = joined(path, field.name);
        out.push(Key { path: path.clone(), takes: field.takes });
        let Some(value) = table.get(field.name) else { continue };
        let mut inner = |fields: &[Field], value: &Value, path: &[String]| {
            if let Some(table) = value.as_table() {
                walk(fields, table, path, out);
            }
        };
        match (field.takes, value) {
            (ValueType::Table(fields), value) => inner(fields, value, &path),
            (ValueType::OneOf(kinds), Value::Table(given)) => {
                let given = kinds.iter().filter(|kind| given.contains_key(kind.name)).copied();
                inner(&given.collect::<Vec<_>>(), value, &path);
            }
            (ValueType::ListOf(kinds), Value::Array(list)) => {
                for (i, step) in list.iter().enumerate() {
                    let given = step.as_table().into_iter().flat_map(|step| {
                        kinds.iter().filter(|kind| step.contains_key(kind.name)).copied()
                    });
                    inner(&given.collect::<Vec<_>>(), step, &joined(&path, &i.to_string()));
                }
            }
            (ValueType::Tables(fields), Value::Array(list)) => {
                for (i, value) in list.iter().enumerate() {
                    inner(fields, value, &joined(&path, &i.to_string()));
                }
            }
            (ValueType::Named(fields), Value::Table(named)) => {
                for (name, value) in named {
                    inner(fields, value, &joined(&path, name));
                }
            }
            _ => {}
        }
    }
}

/// Value at `path`.
pub fn at<'a>(table: &'a mut Table, path: &[String]) -> Option<&'a mut Value> {
    let (first, rest) = path.split_first()?;
    let mut value = table.get_mut(first)?;
    for key in rest {
        value = match value {
            Value::Table(table) => table.get_mut(key)?,
            Value::Array(list) => list.get_mut(key.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    Some(value)
}

/// Sets the value at `path`, or removes it. Its parent table exists.
pub fn put(table: &mut Table, path: &[String], value: Option<Value>) {
    let (last, above) = path.split_last().expect("a key");
    let around =
        if above.is_empty() { Some(table) } else { at(table, above).and_then(Value::as_table_mut) };
    let Some(around) = around else { return };
    match value {
        Some(value) => around.insert(last.clone(), value),
        None => around.remove(last),
    };
}
