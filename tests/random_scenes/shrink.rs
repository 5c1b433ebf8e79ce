//! Reduction of scenes that fail: keys and list entries are removed and numbers are rounded in the
//! text, as long as it remains a valid scene that fails.

use crate::harness::*;

/// Step of a path in a TOML document: a key, or an index in a list.
#[derive(Clone)]
enum Step {
    Key(String),
    Index(usize),
}

type Path = Vec<Step>;

/// Change of the value at a path in a TOML document.
enum Change {
    Remove,
    /// Replaces a compound by the shape of the part with this index.
    Part(usize),
    Set(Value),
}

/// Returns the smallest failing text found within `seconds`; `None` if no smaller one was found.
pub fn shrunk(text: &str, seconds: u64, fails: &dyn Fn(&str) -> bool) -> Option<String> {
    let end = Instant::now() + Duration::from_secs(seconds);
    let whole: Table = text.parse().expect("a scene");
    let mut best = whole.clone();
    let found = |best: &Table| (*best != whole).then(|| written(best));
    let size = Scene::parse(text, NAME).map_or([u32::MAX, 1], |scene| scene.film.size);
    let pixels = size.iter().product::<u32>();
    let mut changed = true;
    while changed {
        changed = false;
        // Values near the root come first: objects before their keys. Of the entries of a list, the
        // last comes first, so that the indices of the others stay valid.
        let mut places = Vec::new();
        walk(&Value::Table(best.clone()), &mut Vec::new(), &mut places);
        places.reverse();
        places.sort_by_key(|(path, _)| path.len());
        for (path, change) in places {
            if Instant::now() > end {
                return found(&best);
            }
            let mut candidate = Value::Table(best.clone());
            if apply(&mut candidate, &path, &change).is_none() {
                continue;
            }
            let Value::Table(candidate) = candidate else { continue };
            let text = written(&candidate);
            // If the size is removed, the film gets the default size, which is larger. Such a
            // change is refused.
            let small = |scene: Scene| scene.film.size.iter().product::<u32>() <= pixels;
            let sound = candidate != best && Scene::parse(&text, NAME).is_ok_and(small);
            if sound && fails(&text) {
                best = candidate;
                changed = true;
            }
        }
    }
    found(&best)
}

fn written(table: &Table) -> String {
    toml::to_string(table).expect("a table")
}

fn walk(value: &Value, path: &mut Path, out: &mut Vec<(Path, Change)>) {
    match value {
        Value::Table(table) => {
            for (key, inner) in table {
                path.push(Step::Key(key.clone()));
                walk(inner, path, out);
                out.push((path.clone(), Change::Remove));
                if let Some(parts) = inner.get("of").and_then(Value::as_array) {
                    out.extend((0..parts.len()).map(|i| (path.clone(), Change::Part(i))));
                }
                path.pop();
            }
        }
        Value::Array(list) => {
            for (i, inner) in list.iter().enumerate() {
                path.push(Step::Index(i));
                walk(inner, path, out);
                out.push((path.clone(), Change::Remove));
                path.pop();
            }
        }
        Value::Float(x) => {
            let rounded = |digits: usize| format!("{x:.digits$e}").parse::<f64>().unwrap();
            for round in [0.0, 1.0, x.round(), rounded(0), rounded(1), rounded(2)] {
                if round != *x && round.is_finite() {
                    out.push((path.clone(), Change::Set(Value::Float(round))));
                }
            }
        }
        Value::Integer(x) if *x > 1 => {
            for less in [1, x / 2, x - 1] {
                out.push((path.clone(), Change::Set(Value::Integer(less))));
            }
        }
        _ => {}
    }
}

fn inner<'a>(value: &'a mut Value, step: &Step) -> Option<&'a mut Value> {
    match step {
        Step::Key(key) => value.get_mut(key.as_str()),
        Step::Index(i) => value.get_mut(*i),
    }
}

/// Applies a change to the value at a path. Returns `None` if the path no longer exists.
fn apply(value: &mut Value, path: &[Step], change: &Change) -> Option<()> {
    let (last, above) = path.split_last()?;
    let holder = above.iter().try_fold(value, inner)?;
    match (change, holder, last) {
        (Change::Remove, Value::Table(table), Step::Key(key)) => drop(table.remove(key)?),
        (Change::Remove, Value::Array(list), Step::Index(i)) if *i < list.len() => {
            list.remove(*i);
        }
        (Change::Set(new), holder, last) => {
            let target = inner(holder, last)?;
            if target.as_float().is_some() != new.as_float().is_some() {
                return None;
            }
            *target = new.clone();
        }
        (Change::Part(i), Value::Table(table), Step::Key(key)) => {
            let part = table.get(key)?.get("of")?.get(*i)?.get("shape")?.as_table()?.clone();
            *table = part;
        }
        _ => return None,
    }
    Some(())
}
