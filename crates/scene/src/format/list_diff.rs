//! Alignment of a list of a scene file before and after an edit.

use std::collections::{BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};
use toml::Value;

/// Returns for each entry of `new` the index of its origin in `old`, or `None` for an added entry.
/// No index occurs twice. The origin is the first of the following, in time n log n:
///
/// - an old entry of the same name,
/// - an old entry that is equal,
/// - the first old entry, between the origins of the neighbours, that differs only in the name, or
///   that has no name either.
pub(crate) fn align(old: &[Value], new: &[Value]) -> Vec<Option<usize>> {
    let mut free = Free::of(old);
    let mut from = vec![None; new.len()];
    for (origin, entry) in from.iter_mut().zip(new) {
        *origin = free.take_named(entry);
    }
    for (origin, entry) in from.iter_mut().zip(new).filter(|(origin, _)| origin.is_none()) {
        *origin = free.take_equal(entry);
    }
    // Origin of the first later entry that has one, or the length of `old`.
    let mut next = vec![old.len(); new.len()];
    for j in (1..new.len()).rev() {
        next[j - 1] = from[j].unwrap_or(next[j]);
    }
    let mut after = 0;
    for (j, entry) in new.iter().enumerate() {
        if from[j].is_none() && after < next[j] {
            from[j] = free.take_edited(entry, after, next[j]);
        }
        after = from[j].map_or(after, |i| i + 1);
    }
    from
}

/// Old entries that are not an origin yet.
struct Free<'a> {
    entries: &'a [Value],
    named: HashMap<&'a str, BTreeSet<usize>>,
    nameless: BTreeSet<usize>,
    /// Indices of the unmatched old entries, by the hash of the whole entry.
    equal: HashMap<u64, BTreeSet<usize>>,
    /// Indices of the unmatched old entries, by the hash of the entry without its name.
    equal_but_name: HashMap<u64, BTreeSet<usize>>,
}

impl<'a> Free<'a> {
    fn of(entries: &'a [Value]) -> Self {
        let mut free = Self {
            entries,
            named: HashMap::new(),
            nameless: BTreeSet::new(),
            equal: HashMap::new(),
            equal_but_name: HashMap::new(),
        };
        for (i, entry) in entries.iter().enumerate() {
            match name(entry) {
                Some(name) => free.named.entry(name).or_default().insert(i),
                None => free.nameless.insert(i),
            };
            free.equal.entry(hash(entry, true)).or_default().insert(i);
            free.equal_but_name.entry(hash(entry, false)).or_default().insert(i);
        }
        free
    }

    /// Takes the first old entry with the name of `entry`.
    fn take_named(&mut self, entry: &Value) -> Option<usize> {
        let first = *self.named.get(name(entry)?)?.first()?;
        Some(self.take(first))
    }

    /// Takes the first old entry that is equal to `entry`.
    fn take_equal(&mut self, entry: &Value) -> Option<usize> {
        let alike = self.equal.get(&hash(entry, true))?;
        let first = alike.iter().copied().find(|i| self.entries[*i] == *entry)?;
        Some(self.take(first))
    }

    /// Takes the first old entry in `after..before` that differs only in its name, or has none
    /// either.
    fn take_edited(&mut self, entry: &Value, after: usize, before: usize) -> Option<usize> {
        let renamed = self.equal_but_name.get(&hash(entry, false)).and_then(|alike| {
            let mut between = alike.range(after..before).copied();
            between.find(|i| is_equal_but_name(&self.entries[*i], entry))
        });
        let nameless = match name(entry) {
            None => self.nameless.range(after..before).next().copied(),
            Some(_) => None,
        };
        let first = renamed.into_iter().chain(nameless).min()?;
        Some(self.take(first))
    }

    fn take(&mut self, i: usize) -> usize {
        let entry = &self.entries[i];
        self.nameless.remove(&i);
        let named = name(entry).and_then(|name| self.named.get_mut(name));
        let equal = self.equal.get_mut(&hash(entry, true));
        let equal_but_name = self.equal_but_name.get_mut(&hash(entry, false));
        for set in [named, equal, equal_but_name].into_iter().flatten() {
            set.remove(&i);
        }
        i
    }
}

fn name(entry: &Value) -> Option<&str> {
    entry.get("name").and_then(Value::as_str)
}

fn is_equal_but_name(a: &Value, b: &Value) -> bool {
    let without_name = |entry: &Value| {
        let mut table = entry.as_table().cloned().unwrap_or_default();
        table.remove("name");
        table
    };
    without_name(a) == without_name(b)
}

/// Returns the hash of a list entry, with or without its name. Equal entries have the same hash.
fn hash(entry: &Value, with_name: bool) -> u64 {
    let mut hasher = DefaultHasher::new();
    let name = if with_name { name(entry) } else { None };
    name.hash(&mut hasher);
    for (key, value) in entry.as_table().into_iter().flatten().filter(|(key, _)| *key != "name") {
        key.hash(&mut hasher);
        hash_value(value, &mut hasher);
    }
    hasher.finish()
}

fn hash_value(value: &Value, hasher: &mut DefaultHasher) {
    match value {
        Value::String(text) => text.hash(hasher),
        Value::Integer(number) => number.hash(hasher),
        // Because -0 equals 0, both must have the same hash. Adding 0 converts -0 to 0.
        Value::Float(number) => (number + 0.0).to_bits().hash(hasher),
        Value::Boolean(is_set) => is_set.hash(hasher),
        Value::Datetime(time) => time.to_string().hash(hasher),
        Value::Array(values) => values.iter().for_each(|value| hash_value(value, hasher)),
        Value::Table(table) => {
            for (key, value) in table {
                key.hash(hasher);
                hash_value(value, hasher);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ops::Range;

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
                is_nameless || is_equal_but_name(&old[i], &new[j])
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
