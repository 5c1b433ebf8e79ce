//! Alignment of a list of a scene file before and after an edit.

use crate::value::fnv1a64;
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;
use toml::Value;

/// Returns for each entry of `new` the index of its origin in `old`, or `None` for an added entry.
/// No index occurs twice. The origin is the first of the following, in time n log n:
///
/// - an old entry of the same name,
/// - an old entry that is equal,
/// - the first old entry, between the origins of the neighbours, that differs only in the name or,
///   like the new entry, has no name.
pub(crate) fn align(old: &[Value], new: &[Value]) -> Vec<Option<usize>> {
    let all = 0..old.len();
    let mut free = Free::of(old);
    let new: Vec<_> = new.iter().map(properties).collect();
    let by_name = |property: &Property| matches!(property, Property::Name(_));
    let by_equality = |property: &Property| matches!(property, Property::NamelessContent(_));
    let by_place =
        |property: &Property| matches!(property, Property::Content(_) | Property::Nameless);
    let mut from: Vec<_> = new.iter().map(|entry| free.take(entry, by_name, &all)).collect();
    for (origin, entry) in from.iter_mut().zip(&new).filter(|(origin, _)| origin.is_none()) {
        *origin = free.take(entry, by_equality, &all);
    }
    // For each entry, the origin of the first later entry that has one, or the length of `old`.
    let mut next = vec![old.len(); new.len()];
    for j in (1..new.len()).rev() {
        next[j - 1] = from[j].unwrap_or(next[j]);
    }
    let mut after = 0;
    for (j, entry) in new.iter().enumerate() {
        if from[j].is_none() && after < next[j] {
            from[j] = free.take(entry, by_place, &(after..next[j]));
        }
        after = from[j].map_or(after, |i| i + 1);
    }
    from
}

/// Property that an entry of a list and its origin have in common.
#[derive(Clone, PartialEq, Eq, Hash)]
enum Property {
    Name(String),
    Nameless,
    /// Hash of the text of all keys but the name.
    Content(u64),
    NamelessContent(u64),
}

fn properties(entry: &Value) -> Vec<Property> {
    let mut table = entry.as_table().cloned().unwrap_or_default();
    let name = table.remove("name").and_then(|name| name.as_str().map(str::to_string));
    let content = fnv1a64(table.to_string().as_bytes());
    let mut properties = vec![Property::Content(content)];
    match name {
        Some(name) => properties.push(Property::Name(name)),
        None => properties.extend([Property::Nameless, Property::NamelessContent(content)]),
    }
    properties
}

/// Old entries that are not an origin yet.
struct Free {
    entries: Vec<Vec<Property>>,
    /// Indices of the entries with each property.
    indices: HashMap<Property, BTreeSet<usize>>,
}

impl Free {
    fn of(entries: &[Value]) -> Self {
        let entries: Vec<_> = entries.iter().map(properties).collect();
        let mut indices: HashMap<_, BTreeSet<_>> = HashMap::new();
        for (i, entry) in entries.iter().enumerate() {
            for property in entry {
                indices.entry(property.clone()).or_default().insert(i);
            }
        }
        Self { entries, indices }
    }

    /// Takes the first old entry in `range` that has one of the `wanted` properties of `entry`, and
    /// returns its index; `None` if there is none.
    fn take(
        &mut self,
        entry: &[Property],
        wanted: impl Fn(&Property) -> bool,
        range: &Range<usize>,
    ) -> Option<usize> {
        let wanted = entry.iter().filter(|property| wanted(property));
        let sets = wanted.filter_map(|property| self.indices.get(property));
        let first = sets.filter_map(|set| set.range(range.clone()).next().copied()).min()?;
        for property in &self.entries[first] {
            self.indices.entry(property.clone()).or_default().remove(&first);
        }
        Some(first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a list of tables, one for each word of `text`. A word is `name/value`; the name may
    /// be empty.
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
            ("a/1 /2 b/3 /4", "a/1 c/3 /5 /4", vec![Some(0), Some(2), None, Some(3)]),
            ("a/1 /2 b/2", "a/1 /2 c/2", vec![Some(0), Some(1), Some(2)]),
            ("a/1 b/1 c/1", "x/1 y/1 z/1", vec![Some(0), Some(1), Some(2)]),
            ("", "a/1", vec![None]),
            ("a/1", "", vec![]),
        ] {
            assert_eq!(align(&list(old), &list(new)), expected, "{old} -> {new}");
        }
    }

    fn name(entry: &Value) -> Option<&str> {
        entry.get("name")?.as_str()
    }

    /// Returns, for each entry of `new`, the index of its origin in `old`, by the rule of
    /// [`align`]. Searches the list of old entries for each new one, in quadratic time.
    fn align_by_search(old: &[Value], new: &[Value]) -> Vec<Option<usize>> {
        let mut from = vec![None; new.len()];
        let find =
            |from: &[Option<usize>], range: Range<usize>, is_match: &dyn Fn(usize) -> bool| {
                range.into_iter().find(|i| !from.contains(&Some(*i)) && is_match(*i))
            };
        let all = 0..old.len();
        for j in 0..new.len() {
            let has_name = |i: usize| name(&old[i]).is_some() && name(&old[i]) == name(&new[j]);
            from[j] = find(&from, all.clone(), &has_name);
        }
        for j in 0..new.len() {
            from[j] = from[j].or_else(|| find(&from, all.clone(), &|i| old[i] == new[j]));
        }
        for j in (0..new.len()).filter(|j| from[*j].is_none()).collect::<Vec<_>>() {
            let after = from[..j].iter().rev().find_map(|i| *i).map_or(0, |i| i + 1);
            let before = from[j..].iter().find_map(|i| *i).unwrap_or(old.len());
            from[j] = find(&from, after..before.max(after), &|i| {
                let is_nameless = name(&old[i]).is_none() && name(&new[j]).is_none();
                is_nameless || properties(&old[i])[0] == properties(&new[j])[0]
            });
        }
        from
    }

    #[test]
    fn random_lists_align_as_by_search() {
        let mut numbers = 1_u32;
        let mut below = |n: u32| {
            numbers = numbers.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (numbers >> 16) % n
        };
        for round in 0..3000 {
            let names = if round % 2 == 0 { ["", "", "", ""] } else { ["", "a", "b", "c"] };
            let [old, new] = [0, 1].map(|_| {
                let entries: Vec<_> = (0..below(8))
                    .map(|_| format!("{}/{}", names[below(4) as usize], below(3)))
                    .collect();
                entries.join(" ")
            });
            let (a, b) = (list(&old), list(&new));
            assert_eq!(align(&a, &b), align_by_search(&a, &b), "{old} -> {new}");
        }
    }
}
