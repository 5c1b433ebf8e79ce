//! Alignment of the entries of an edited list with those before the edit.

use toml::{Table, Value};

/// Returns for each entry of `new` the index of its origin in `old`, or `None` if it has none; no
/// index occurs twice. Entries match if they have the same name. Otherwise they match if they are
/// equal, or if they are between the same neighbours and one may be an edit of the other (`alike`).
pub(crate) fn align(old: &[Value], new: &[Value]) -> Vec<Option<usize>> {
    let mut free = vec![true; old.len()];
    let mut from = vec![None; new.len()];
    let mut pass = |from: &mut Vec<Option<usize>>, same: &dyn Fn(&Value, &Value) -> bool| {
        for (j, entry) in
            new.iter().enumerate().filter(|(j, _)| from[*j].is_none()).collect::<Vec<_>>()
        {
            if let Some(i) = (0..old.len()).find(|i| free[*i] && same(&old[*i], entry)) {
                free[i] = false;
                from[j] = Some(i);
            }
        }
    };
    pass(&mut from, &|a, b| name(a).is_some() && name(a) == name(b));
    pass(&mut from, &|a, b| a == b);
    for j in 0..new.len() {
        if from[j].is_some() {
            continue;
        }
        let after = from[..j].iter().rev().find_map(|i| *i).map_or(0, |i| i + 1);
        let before = from[j..].iter().find_map(|i| *i).unwrap_or(old.len());
        let between = after..before.max(after);
        if let Some(i) = between.into_iter().find(|i| free[*i] && alike(&old[*i], &new[j])) {
            free[i] = false;
            from[j] = Some(i);
        }
    }
    from
}

fn name(entry: &Value) -> Option<&str> {
    entry.get("name").and_then(Value::as_str)
}

/// Returns `true` if one entry may be an edit of the other: neither has a name, or only the names
/// differ.
fn alike(a: &Value, b: &Value) -> bool {
    let without_name = |entry: &Value| {
        let mut table: Table = entry.as_table().cloned().unwrap_or_default();
        table.remove("name");
        table
    };
    name(a).is_none() && name(b).is_none() || without_name(a) == without_name(b)
}

#[cfg(test)]
mod tests {
    use super::align;
    use toml::Value;

    /// Parses entries `name/value`.
    fn list(text: &str) -> Vec<Value> {
        let entry = |word: &str| {
            let (name, value) = word.split_once('/').unwrap();
            let mut table = toml::Table::new();
            if !name.is_empty() {
                table.insert("name".into(), name.into());
            }
            table.insert("value".into(), value.into());
            Value::Table(table)
        };
        text.split_whitespace().map(entry).collect()
    }

    #[test]
    fn list_entries_align_with_their_origin() {
        for (old, new, expected) in [
            ("a/1 b/2 c/3", "a/1 b/9 c/3", vec![Some(0), Some(1), Some(2)]),
            ("a/1 b/2 c/3", "a/1 c/3", vec![Some(0), Some(2)]),
            ("a/1 b/2 c/3", "c/3 a/1 b/2", vec![Some(2), Some(0), Some(1)]),
            ("a/1 b/2 c/3", "a/1 x/2 c/3", vec![Some(0), Some(1), Some(2)]),
            ("a/1 b/2", "a/1 x/7", vec![Some(0), None]),
            ("a/1", "a/1 b/2 b/2", vec![Some(0), None, None]),
            ("/1 /2 /3", "/1 /3", vec![Some(0), Some(2)]),
            ("/1 /2 /3", "/1 /9 /3", vec![Some(0), Some(1), Some(2)]),
            ("/1 /2", "/9 /8 /7", vec![Some(0), Some(1), None]),
            ("", "a/1", vec![None]),
            ("a/1", "", vec![]),
        ] {
            assert_eq!(align(&list(old), &list(new)), expected, "{old} -> {new}");
        }
    }
}
