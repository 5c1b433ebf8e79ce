//! Patches of the text of a scene file by the difference between two scenes, as trees of TOML
//! values. Undo, redo and recovery restore whole scenes, so that saving does not know which keys
//! have changed. A key that is not in the text is written only if it differs from its default.

use crate::format::comments::CommentKeeper;
use crate::format::emit::{color, fresh, fresh_entry, is_default, leaf};
use crate::format::list_diff::align;
use crate::format::schema;
use crate::value::{Color, Field, PRESET, ValueType};
use toml::Value;
use toml_edit::{ArrayOfTables, DocumentMut, Item, TableLike};

/// Changes `document`, which describes the scene `old`, to describe the scene `new`.
pub(crate) fn rewrite(document: &mut DocumentMut, old: &toml::Table, new: &toml::Table) {
    let mut keeper = CommentKeeper::default();
    let scene = ValueType::Table(schema::FIELDS);
    patch_table(&mut keeper, document.as_table_mut(), true, old, new, scene);
    keeper.put_back(document);
    if document.as_table().iter().all(|(_, item)| is_nothing(item)) {
        // A file without any key is not a valid scene.
        if let Some(size) = new.get("film").and_then(|film| film.get("size")) {
            let mut film = toml_edit::Table::new();
            film.insert("size", Item::Value(leaf(size)));
            document.as_table_mut().insert("film", Item::Table(film));
        }
    }
}

/// Returns `true` if `item` adds nothing to the text.
fn is_nothing(item: &Item) -> bool {
    match item {
        Item::None => true,
        Item::Value(_) => false,
        Item::Table(table) => table.is_implicit() && table.iter().all(|(_, item)| is_nothing(item)),
        Item::ArrayOfTables(list) => list.is_empty(),
    }
}

/// Returns the keys of a table of the type `takes`, each with the type of its value.
fn keys(takes: ValueType, old: &toml::Table, new: &toml::Table) -> Vec<(String, ValueType)> {
    match takes {
        ValueType::Table(fields) | ValueType::OneOf(fields) => {
            fields.iter().map(|f| (f.name.to_string(), f.takes)).collect()
        }
        ValueType::Named(fields) => {
            let removed = old.keys().filter(|k| !new.contains_key(*k));
            removed.chain(new.keys()).map(|k| (k.clone(), ValueType::Table(fields))).collect()
        }
        _ => Vec::new(),
    }
}

/// Changes `table`, which describes `old`, to describe `new`. Inner tables may have `[headers]` if
/// `headers` is `true`.
fn patch_table(
    keeper: &mut CommentKeeper,
    table: &mut dyn TableLike,
    headers: bool,
    old: &toml::Table,
    new: &toml::Table,
    takes: ValueType,
) {
    let old = if let ValueType::Named(_) = takes { &rename(table, old, new) } else { old };
    // A table that loses its preset gets all keys. In one that gets a preset, keys without text
    // override it.
    let overrides = new.contains_key(PRESET);
    let is_omitted = |key: &str, value: &Value| {
        let ValueType::Table(fields) = takes else { return false };
        let field = fields.iter().find(|field| field.name == key);
        !overrides && field.is_some_and(|field| is_default(field, value))
    };
    let mut removed = Vec::new();
    let mut added = Vec::new();
    for (key, takes) in keys(takes, old, new) {
        match (old.get(&key), new.get(&key)) {
            (Some(_), None) if table.contains_key(&key) => removed.push(key),
            (old, Some(value)) if overrides || old != Some(value) => match table.get_mut(&key) {
                Some(_) if old == Some(value) => {}
                Some(item) => patch_item(keeper, item, headers, old, value, takes),
                None if is_omitted(&key, value) => {}
                None => added.push((key, takes, value)),
            },
            _ => {}
        }
    }
    // The first new key takes over the comments of a single removed key, such as a shape's kind.
    let successor = added.first().filter(|_| removed.len() == 1);
    for key in removed {
        let decor = table.key(&key).map(|k| k.leaf_decor().clone());
        let Some(item) = table.remove(&key) else { continue };
        keeper.removed(&item);
        if let (Some((key, takes, new)), Some(decor), Item::Value(value)) =
            (successor, decor, &item)
        {
            let mut item = fresh(*takes, new, false);
            if let Some(new_value) = item.as_value_mut() {
                *new_value.decor_mut() = value.decor().clone();
            }
            table.insert(key, item);
            if let Some(mut key) = table.key_mut(key) {
                *key.leaf_decor_mut() = decor;
            }
        }
    }
    for (key, takes, value) in added {
        if !table.contains_key(&key) {
            table.insert(&key, fresh(takes, value, headers));
        }
    }
}

/// Changes `item`, which describes a value `old` of the type `takes`, to describe `new`.
fn patch_item(
    keeper: &mut CommentKeeper,
    item: &mut Item,
    headers: bool,
    old: Option<&Value>,
    new: &Value,
    takes: ValueType,
) {
    let headers = headers && !item.as_table().is_some_and(|t| t.is_dotted());
    let headers_inside = headers && (item.is_table() || item.is_array_of_tables());
    match (takes, old, new) {
        (
            ValueType::Table(_) | ValueType::OneOf(_) | ValueType::Named(_),
            Some(Value::Table(a)),
            Value::Table(b),
        ) => {
            if let Some(table) = item.as_table_like_mut() {
                patch_table(keeper, table, headers_inside, a, b, takes);
            }
        }
        (ValueType::Tables(fields), Some(Value::Array(a)), Value::Array(b)) => {
            patch_list(keeper, item, a, b, fields());
        }
        (ValueType::ListOf(fields), Some(Value::Array(a)), Value::Array(b)) => {
            patch_list(keeper, item, a, b, fields);
        }
        _ => edit_leaf(item, old, new),
    }
}

/// Changes the list of tables `item`, which describes `old`, to describe `new`. The entries that
/// remain keep their text and comments.
fn patch_list(
    keeper: &mut CommentKeeper,
    item: &mut Item,
    old: &[Value],
    new: &[Value],
    fields: &'static [Field],
) {
    let from = align(old, new);
    let mut edit = |table: &mut dyn TableLike, i: usize, j: usize, headers| {
        if let (Value::Table(a), Value::Table(b)) = (&old[i], &new[j]) {
            patch_table(keeper, table, headers, a, b, ValueType::Table(fields));
        }
    };
    match item {
        Item::ArrayOfTables(list) => {
            let mut tables: Vec<_> = list.iter().cloned().map(Some).collect();
            list.clear();
            let mut next = Vec::new();
            for (j, origin) in from.iter().enumerate() {
                match origin.and_then(|i| Some((i, tables.get_mut(i)?.take()?))) {
                    Some((i, mut table)) => {
                        edit(&mut table, i, j, true);
                        next.push(table);
                    }
                    None => next.push(fresh_entry(fields, &new[j])),
                }
            }
            let removed: ArrayOfTables = tables.into_iter().flatten().collect();
            keeper.removed(&Item::ArrayOfTables(removed));
            crate::format::comments::in_order(&mut next, &from);
            list.extend(next);
        }
        Item::Value(toml_edit::Value::Array(list)) => {
            let mut values: Vec<_> = list.iter().cloned().map(Some).collect();
            let before = values.iter().flatten().map(spaces_before).next_back();
            let indent = before.filter(|spaces| !spaces.is_empty()).unwrap_or(" ".into());
            list.clear();
            for (j, origin) in from.iter().enumerate() {
                match origin.and_then(|i| Some((i, values.get_mut(i)?.take()?))) {
                    Some((i, mut value)) => {
                        if let Some(table) = value.as_inline_table_mut() {
                            edit(table, i, j, false);
                        }
                        list.push_formatted(value);
                    }
                    None => {
                        let mut value = fresh_entry(fields, &new[j]).into_inline_table();
                        if j > 0 {
                            let above = comment_of_the_last(list, j + 1 == new.len());
                            value.decor_mut().set_prefix(above + &indent);
                        }
                        list.push_formatted(toml_edit::Value::InlineTable(value));
                    }
                }
            }
        }
        _ => {}
    }
}

/// Renames the inner tables of `table` that an edit has renamed: `new` has an equal value under a
/// new name. Their text is kept. Returns `old` with the new names.
fn rename(table: &mut dyn TableLike, old: &toml::Table, new: &toml::Table) -> toml::Table {
    let mut renamed = old.clone();
    for (was, value) in old.iter().filter(|(key, _)| !new.contains_key(*key)) {
        let mut added = new.iter().filter(|(key, _)| !renamed.contains_key(*key));
        let Some((is, _)) = added.find(|(_, other)| *other == value) else { continue };
        let decor =
            table.key(was).map(|key| (key.leaf_decor().clone(), key.dotted_decor().clone()));
        let Some(item) = table.remove(was) else { continue };
        table.insert(is, item);
        if let (Some((leaf, dotted)), Some(mut key)) = (decor, table.key_mut(is)) {
            *key.leaf_decor_mut() = leaf;
            *key.dotted_decor_mut() = dotted;
        }
        if let Some(value) = renamed.remove(was) {
            renamed.insert(is.clone(), value);
        }
    }
    renamed
}

/// Removes the comment after the last comma of `list` and returns it; an empty string if there is
/// none. If `followed` is `false`, the comment stays at the end of the list.
fn comment_of_the_last(list: &mut toml_edit::Array, followed: bool) -> String {
    let trailing = list.trailing().as_str().unwrap_or_default();
    match trailing.rfind('\n') {
        Some(end) if followed && list.trailing_comma() && trailing.contains('#') => {
            let (comment, rest) = (trailing[..end].to_string(), trailing[end..].to_string());
            list.set_trailing(rest);
            comment
        }
        _ => String::new(),
    }
}

/// Returns the white space before a value in a list, without comments.
fn spaces_before(value: &toml_edit::Value) -> String {
    let prefix = value.decor().prefix().and_then(|p| p.as_str()).unwrap_or_default();
    match prefix.rfind('\n') {
        Some(end) => prefix[end..].to_string(),
        None => prefix.to_string(),
    }
}

/// Replaces the value of `item`, which is not a table. In a list of the same length, only numbers
/// that differ are replaced.
fn edit_leaf(item: &mut Item, old: Option<&Value>, new: &Value) {
    let Some(value) = item.as_value_mut() else {
        *item = Item::Value(leaf(new));
        return;
    };
    if let (toml_edit::Value::Array(list), Value::Array(new)) = (&mut *value, new)
        && list.len() == new.len()
    {
        let old = old.and_then(Value::as_array).filter(|old| old.len() == new.len());
        for (i, number) in new.iter().enumerate() {
            if old.is_none_or(|old| old[i] != *number)
                && let Some(place) = list.get_mut(i)
            {
                replace(place, leaf(number));
            }
        }
        return;
    }
    // A colour written as `#rrggbb` is written in this form again if the form is exact for `new`.
    let code = if value.is_str() { color(new).and_then(Color::to_hex) } else { None };
    replace(value, code.map_or_else(|| leaf(new), toml_edit::Value::from));
}

/// Replaces the value `place` by `new`. The comments and spaces around it are kept.
fn replace(place: &mut toml_edit::Value, mut new: toml_edit::Value) {
    *new.decor_mut() = place.decor().clone();
    *place = new;
}
