//! The keys and values of a scene, enumerated from the field tables, so that tests need no lists of
//! their own.

use super::*;

/// Key that a scene file may have.
#[derive(Clone, Debug)]
pub struct Key {
    /// Path from the root to the key: names of tables and lists. An index in a list is written as a
    /// number.
    pub path: Vec<String>,
    pub takes: ValueType,
}

/// Returns the scene in `table`, whose asset files `resolver` finds. Returns `None` if it has
/// errors.
pub fn scene_of_table(table: &Table, resolver: &AssetResolver) -> Option<Scene> {
    let mut scene = Scene::from_text(&table.to_string()).ok()?;
    scene.resolver = resolver.clone();
    scene.resolve();
    scene.faults().is_empty().then_some(scene)
}

pub fn keys(scene: &Table) -> Vec<Key> {
    let mut out = Vec::new();
    walk(FIELDS, scene, &[], &mut out);
    out
}

fn child_path(path: &[String], key: &str) -> Vec<String> {
    path.iter().cloned().chain([key.to_string()]).collect()
}

fn walk(fields: &[Field], table: &Table, path: &[String], out: &mut Vec<Key>) {
    for field in fields {
        let path = child_path(path, field.name);
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
                    inner(&given.collect::<Vec<_>>(), step, &child_path(&path, &i.to_string()));
                }
            }
            (ValueType::Tables(fields), Value::Array(list)) => {
                for (i, value) in list.iter().enumerate() {
                    inner(fields(), value, &child_path(&path, &i.to_string()));
                }
            }
            (ValueType::Named(fields), Value::Table(named)) => {
                for (name, value) in named {
                    inner(fields, value, &child_path(&path, name));
                }
            }
            _ => {}
        }
    }
}

pub fn value_at<'a>(table: &'a mut Table, path: &[String]) -> Option<&'a mut Value> {
    let (first, deeper_keys) = path.split_first()?;
    let mut value = table.get_mut(first)?;
    for key in deeper_keys {
        value = match value {
            Value::Table(table) => table.get_mut(key)?,
            Value::Array(list) => list.get_mut(key.parse::<usize>().ok()?)?,
            _ => return None,
        };
    }
    Some(value)
}

/// Sets the value at `path` in `table`; `None` removes it. Does nothing if the parent table is
/// missing.
pub fn put(table: &mut Table, path: &[String], value: Option<Value>) {
    let (last, parent_path) = path.split_last().expect("a key");
    let parent = if parent_path.is_empty() {
        Some(table)
    } else {
        value_at(table, parent_path).and_then(Value::as_table_mut)
    };
    let Some(parent) = parent else { return };
    match value {
        Some(value) => parent.insert(last.clone(), value),
        None => parent.remove(last),
    };
}
