//! A scene that fails made smaller, by its text alone: keys and list entries removed, numbers made round, as long
//! as it is a scene and still fails.

use std::time::{Duration, Instant};
use toml::{Table, Value};
use zerkalo::scene::Scene;

/// A key or a place in a list.
#[derive(Clone)]
enum Place {
    Key(String),
    At(usize),
}

type Path = Vec<Place>;

/// What is done at a place.
enum Change {
    Remove,
    /// Instead of a compound the shape of its part with this number.
    Part(usize),
    Set(Value),
}

/// The smallest text that was found in so many seconds and of which `fails` is true, as it is of `text`.
pub fn shrunk(text: &str, seconds: u64, fails: &dyn Fn(&str) -> bool) -> String {
    let end = Instant::now() + Duration::from_secs(seconds);
    let mut best: Table = text.parse().expect("a scene");
    let size = Scene::parse(text, "test").map_or([u32::MAX, 1], |scene| scene.film.size);
    let pixels = size.iter().product::<u32>();
    let mut changed = true;
    while changed {
        changed = false;
        // The largest first: whole objects, then what they are made of; of a list the last entry first, so that the
        // places before it stay what they are.
        let mut places = Vec::new();
        walk(&Value::Table(best.clone()), &mut Vec::new(), &mut places);
        places.reverse();
        places.sort_by_key(|(path, _)| path.len());
        for (path, change) in places {
            if Instant::now() > end {
                return written(&best);
            }
            let mut candidate = Value::Table(best.clone());
            if apply(&mut candidate, &path, &change).is_none() {
                continue;
            }
            let Value::Table(candidate) = candidate else { continue };
            let text = written(&candidate);
            // Without its size a picture has the preset one, which is larger.
            let small = |scene: Scene| scene.film.size.iter().product::<u32>() <= pixels;
            let sound = candidate != best && Scene::parse(&text, "test").is_ok_and(small);
            if sound && fails(&text) {
                best = candidate;
                changed = true;
            }
        }
    }
    written(&best)
}

fn written(table: &Table) -> String {
    toml::to_string(table).expect("a table")
}

fn walk(value: &Value, path: &mut Path, out: &mut Vec<(Path, Change)>) {
    match value {
        Value::Table(table) => {
            for (key, inner) in table {
                path.push(Place::Key(key.clone()));
                walk(inner, path, out);
                out.push((path.clone(), Change::Remove));
                if let Some(of) = inner.get("of").and_then(Value::as_array) {
                    out.extend((0..of.len()).map(|i| (path.clone(), Change::Part(i))));
                }
                path.pop();
            }
        }
        Value::Array(list) => {
            for (i, inner) in list.iter().enumerate() {
                path.push(Place::At(i));
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

fn inner<'a>(value: &'a mut Value, place: &Place) -> Option<&'a mut Value> {
    match place {
        Place::Key(key) => value.get_mut(key.as_str()),
        Place::At(i) => value.get_mut(*i),
    }
}

/// `None`: there is no such place any more.
fn apply(value: &mut Value, path: &[Place], change: &Change) -> Option<()> {
    let (last, above) = path.split_last()?;
    let holder = above.iter().try_fold(value, inner)?;
    match (change, holder, last) {
        (Change::Remove, Value::Table(table), Place::Key(key)) => drop(table.remove(key)?),
        (Change::Remove, Value::Array(list), Place::At(i)) if *i < list.len() => {
            list.remove(*i);
        }
        (Change::Set(new), holder, last) => {
            let at = inner(holder, last)?;
            if at.as_float().is_some() != new.as_float().is_some() {
                return None;
            }
            *at = new.clone();
        }
        (Change::Part(i), Value::Table(table), Place::Key(key)) => {
            let part = table.get(key)?.get("of")?.get(*i)?.get("shape")?.as_table()?.clone();
            *table = part;
        }
        _ => return None,
    }
    Some(())
}
