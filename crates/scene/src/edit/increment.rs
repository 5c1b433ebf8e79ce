//! Steps by arrow keys: numbers change to the next round number, other values to the next choice.

use crate::Scene;
use crate::edit::bounds::step_length;
use crate::edit::part::{given_key, part};
use crate::edit::properties::is_material;
use crate::edit::set::{label, lookup, replace};
use crate::edit::{Edit, EditError, Target};
use crate::value::{
    DefaultValue, Field, KeyNode, KeyValue, NumberRange, ValueType, floor_log10, node_at,
    rounded_to,
};

/// Changes the numbers of `key` by `steps` arrow steps. If `steps` is whole, it counts coarse
/// steps; if not, its tenths count fine steps. `component` is the index of the number to change;
/// without it, all numbers change together (of a colour, the brightness). A key without numbers
/// changes to the next or previous choice ([`toggle`]).
///
/// The scene stays unchanged at the end of a range, or if other keys forbid the new value; a note
/// then states the reason. Fails if there is no such key or number, or no value to start from.
pub fn step(
    scene: &Scene,
    target: &Target,
    key: &str,
    component: Option<usize>,
    steps: f64,
) -> Result<Edit, EditError> {
    let part = part(scene, target)?;
    let field = lookup(target, key)?;
    let Some(rule) = StepRule::of(field, scene) else {
        return toggle(scene, target, key, steps > 0.0);
    };
    let given = node_at(part, key).and_then(KeyNode::value);
    let given = given.or_else(|| start(field, scene, target));
    let Some(KeyValue::Numbers(numbers)) = given else {
        return Err(EditError::new(&format!("{} has no value yet", field.name), "Type one."));
    };
    if component.is_some_and(|c| c >= numbers.len()) {
        return Err(EditError::new(&format!("{key} has no such number"), ""));
    }
    let count = StepCount::of(steps);
    let next = match (component, field.takes) {
        (None, ValueType::Color(range)) => brightened(&numbers, range, count),
        (None, ValueType::Wholes(_, range)) => resized(&numbers, range, count),
        _ => {
            let moved = |(i, x): (usize, &f64)| match component {
                Some(c) if c != i => *x,
                _ => rule.stepped(*x, &numbers, count),
            };
            numbers.iter().enumerate().map(moved).collect()
        }
    };
    // A direction of zeros is invalid.
    let is_zero = matches!(field.takes, ValueType::Direction) && next.iter().all(|x| *x == 0.0);
    let next = if is_zero { numbers } else { next };
    replace(scene, target, key, KeyValue::Numbers(next)).or_else(|refusal| {
        let (scene, target) = (scene.clone(), target.clone());
        let label = label(&scene, &target, key);
        Ok(Edit { scene, target, label, note: Some(refusal.to_string()) })
    })
}

/// Changes `key` cyclically to the next or previous choice: a word, a switch, a kind, or the
/// material of an object. For an optional key, "no value" is one of the choices. Fails if there is
/// no such key, or it has no choices.
pub fn toggle(
    scene: &Scene,
    target: &Target,
    key: &str,
    forward: bool,
) -> Result<Edit, EditError> {
    let part = part(scene, target)?;
    let field = lookup(target, key)?;
    let value = node_at(part, key).and_then(KeyNode::value);
    let word = match &value {
        Some(KeyValue::Text(word)) => Some(word.as_str()),
        Some(KeyValue::Numbers(_) | KeyValue::Switch(_)) | None => None,
    };
    let optional = matches!(field.preset, DefaultValue::Without(_));
    let (words, present): (Vec<&str>, Option<&str>) = match field.takes {
        ValueType::Switch => {
            let on = value == Some(KeyValue::Switch(true));
            return crate::edit::set(scene, target, key, if on { "false" } else { "true" });
        }
        ValueType::OneOf(kinds) => {
            (kinds.iter().map(|k| k.name).collect(), word.or_else(|| given_key(part, target)))
        }
        ValueType::Choice(choices) => (choices.iter().map(|c| c.name).collect(), word),
        _ if is_material(target, field) => {
            let names = scene.materials.keys().map(String::as_str);
            (names.collect(), word)
        }
        _ => {
            let found = format!("{} has no words to choose from", field.name);
            return Err(EditError::new(&found, &format!("Type {}.", field.takes)));
        }
    };
    let index = words.iter().position(|word| Some(*word) == present);
    let text = next(index, words.len(), forward, optional).map_or("", |index| words[index]);
    crate::edit::set(scene, target, key, text)
}

/// Returns the index of the next or previous of `n` choices in a cycle. `None` stands for "no
/// choice", which is part of the cycle if `optional` is `true`.
fn next(index: Option<usize>, n: usize, forward: bool, optional: bool) -> Option<usize> {
    match (index, forward) {
        _ if n == 0 => None,
        (None, true) => Some(0),
        (None, false) => Some(n - 1),
        (Some(index), true) if index + 1 < n => Some(index + 1),
        (Some(index), false) if index > 0 => Some(index - 1),
        (Some(_), _) if optional => None,
        (Some(_), true) => Some(0),
        (Some(_), false) => Some(n - 1),
    }
}

/// Returns the value, given by other keys, from which steps of an absent `alpha` or `f0` start.
fn start(field: &Field, scene: &Scene, target: &Target) -> Option<KeyValue> {
    let material = match target {
        Target::Material(name) => scene.materials.get(name),
        _ => None,
    };
    match (field.name, material) {
        ("alpha", Some(material)) => {
            Some(KeyValue::Numbers(vec![rounded_to(material.microfacet_alpha(), -4)]))
        }
        ("f0", Some(material)) => material.f0().value(),
        _ => None,
    }
}

/// Number of arrow steps, negative for steps down. Fine steps are about a tenth of coarse steps.
#[derive(Clone, Copy)]
struct StepCount {
    steps: i64,
    fine: bool,
}

impl StepCount {
    fn of(steps: f64) -> Self {
        let limited = steps.clamp(-1e3, 1e3);
        if limited.fract() == 0.0 {
            Self { steps: limited as i64, fine: false }
        } else {
            Self { steps: (limited * 10.0).round() as i64, fine: true }
        }
    }
}

/// Rule by which an arrow step changes a number.
#[derive(Clone, Copy)]
enum StepRule {
    /// Geometric step along the rungs: 1, 1.1, 1.2 ... 9, times any power of ten. There are no
    /// rungs between 0 and `floor`.
    Rungs { floor: f64, range: NumberRange },
    /// Step by `unit`; a fine step is a tenth of it.
    Units { unit: f64, range: NumberRange },
    /// Step by 5 degrees, or by 0.5 in fine steps.
    Degrees { range: NumberRange },
    /// Step of a component by 0.05 P; P is the largest power of ten up to the largest component.
    Direction,
    /// Geometric step: the magnitude moves along the rungs; the sign stays.
    Factor,
    /// Step by 10, or by 1 in fine steps.
    Tens { range: NumberRange },
    /// Step by doubling or halving, or by 1 in fine steps. The step up from 0 leads to 1.
    Doubles { range: NumberRange },
}

impl StepRule {
    /// Returns the rule of arrow steps for the key `field`; `None` if it has no numbers.
    fn of(field: &Field, scene: &Scene) -> Option<Self> {
        Some(match field.takes {
            ValueType::Number(range) | ValueType::Numbers(_, range) => {
                let rungs = |floor| Self::Rungs { floor, range };
                let units = |unit| Self::Units { unit, range };
                match (field.name, field.unit) {
                    (_, "degrees") => Self::Degrees { range },
                    // Repetitions of a texture.
                    ("scale", _) => rungs(0.0),
                    _ if range == NumberRange::SIZE => rungs(0.0),
                    _ if range == NumberRange::COORDINATE => units(step_length(scene)),
                    // The height of useful bumps is at most a hundredth of the size of the surface.
                    ("height", _) => units(0.005),
                    // The blur of roughness 0.001 is just visible at the far end of a room.
                    ("roughness" | "alpha", _) => rungs(0.001),
                    ("offset", _) => units(0.05),
                    _ if [NumberRange::SHARE, NumberRange::COEFFICIENT].contains(&range) => {
                        units(0.05)
                    }
                    (_, "scene units") => rungs(step_length(scene) / 10.0),
                    _ if range == NumberRange::LIGHT => rungs(0.01),
                    // Phong exponent, or another number without a unit.
                    _ => rungs(1.0),
                }
            }
            ValueType::Direction => Self::Direction,
            ValueType::Factor => Self::Factor,
            ValueType::Color(range) => Self::Units { unit: 0.05, range },
            ValueType::Whole(range)
                if matches!(field.name, "rays_per_pixel" | "max_diffuse_depth") =>
            {
                Self::Doubles { range }
            }
            ValueType::Wholes(_, range) => Self::Doubles { range },
            ValueType::Whole(range) => Self::Tens { range },
            _ => return None,
        })
    }

    /// Returns `x`, one of the numbers `all` of the value, after `count` steps.
    fn stepped(self, x: f64, all: &[f64], count: StepCount) -> f64 {
        let StepCount { steps, fine } = count;
        match self {
            Self::Rungs { floor, range } => next_nice(x, floor, range, count),
            Self::Units { unit, range } if range == NumberRange::COEFFICIENT && x > 2.0 => {
                next_nice(x, unit, range, count)
            }
            Self::Units { unit, range } => within(added(x, unit, count), range, x),
            Self::Degrees { range } => {
                let moved = added(x, 5.0, count);
                // The range of an opening angle excludes its ends.
                let ends = NumberRange::closed(range.low + 0.5, range.high - 0.5);
                if range.low.is_finite() { within(moved, ends, x) } else { moved }
            }
            Self::Direction => {
                let largest = all.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                let unit = rounded_to(0.05, -2) * 10f64.powi(floor_log10(largest));
                let moved = added(x, unit, count);
                if moved.is_finite() { moved } else { x }
            }
            Self::Factor => {
                let range = NumberRange::closed(1e-6, 1e6);
                next_nice(x.abs(), 0.0, range, count) * x.signum()
            }
            Self::Tens { range } => {
                within(x + (if fine { 1 } else { 10 } * steps) as f64, range, x)
            }
            Self::Doubles { range } => doubled(x, range, count),
        }
    }
}

/// Returns `x + steps * unit`, rounded to a hundredth of a fine step or finer.
fn added(x: f64, unit: f64, StepCount { steps, fine }: StepCount) -> f64 {
    let width = if fine { unit / 10.0 } else { unit };
    rounded_to(x + width * steps as f64, floor_log10(unit) - 3)
}

/// Returns `x` limited to `range`; `old` if `range` excludes the nearest end.
fn within(x: f64, range: NumberRange, old: f64) -> f64 {
    if range.holds(x) {
        x
    } else if x >= range.high && range.high_in {
        range.high
    } else if x <= range.low && range.low_in {
        range.low
    } else {
        old
    }
}

/// Returns `x`, doubled or halved for each coarse step, or changed by 1 for each fine step.
fn doubled(x: f64, range: NumberRange, StepCount { steps, fine }: StepCount) -> f64 {
    let moved = match steps {
        _ if fine => x + steps as f64,
        0.. if x == 0.0 && steps > 0 => 2f64.powi((steps.min(40) - 1) as i32),
        _ => (x * 2f64.powi(steps.clamp(-40, 40) as i32)).floor(),
    };
    within(moved, range, x)
}

/// Mantissas of coarse steps, in thousandths. Successive ones differ by about a tenth.
const RUNGS: [i64; 23] = [
    1000, 1100, 1200, 1300, 1400, 1600, 1800, 2000, 2200, 2500, 2800, 3000, 3300, 3600, 4000, 4500,
    5000, 5500, 6000, 6500, 7000, 8000, 9000,
];

/// Returns the mantissas of fine steps: 1.00, 1.01 ... 2.00, 2.02 ... 5.00, 5.05 ... 9.95.
fn fine_rungs() -> Vec<i64> {
    let parts = [(1000..2000).step_by(10), (2000..5000).step_by(20), (5000..10_000).step_by(50)];
    parts.into_iter().flatten().collect()
}

/// Returns the number that is `steps` rungs above `x`, which is at least 0. The result is a rung or
/// an end of `range`, so that steps up and down undo each other.
fn next_nice(x: f64, floor: f64, range: NumberRange, StepCount { steps, fine }: StepCount) -> f64 {
    let up = steps > 0;
    let mut x = x;
    for _ in 0..steps.unsigned_abs() {
        let next = if x == 0.0 { if up { floor } else { 0.0 } } else { nice_step(x, up, fine) };
        let next = if next < floor && !up { 0.0 } else { next };
        let limited = within(next, range, x);
        if limited == x {
            break;
        }
        x = limited;
    }
    x
}

/// Returns the next rung above or below `x`, which is greater than 0.
fn nice_step(x: f64, up: bool, fine: bool) -> f64 {
    let e = floor_log10(x);
    let mantissa = x * format!("1e{}", 3 - e).parse().unwrap_or(1.0);
    let rungs = if fine { fine_rungs() } else { RUNGS.to_vec() };
    // Rounding errors may move a number slightly off its rung.
    let next = match up {
        true => rungs.into_iter().find(|r| *r as f64 > mantissa + 1e-5).unwrap_or(10_000),
        false => {
            let below = if fine { 995 } else { 900 };
            rungs.into_iter().rfind(|r| (*r as f64) < mantissa - 1e-5).unwrap_or(below)
        }
    };
    format!("{next}e{}", e - 3).parse().unwrap_or(x)
}

/// Returns a colour with its brightness changed by `count` steps. Upwards, black becomes dark grey.
fn brightened(channels: &[f64], range: NumberRange, count: StepCount) -> Vec<f64> {
    let largest = channels.iter().fold(0.0f64, |m, x| m.max(*x));
    let rule = StepRule::Units { unit: 0.05, range };
    let next = match largest > 2.0 {
        true => next_nice(largest, 0.0, range, count),
        false => rule.stepped(largest, channels, count),
    };
    if largest == 0.0 {
        return vec![next; channels.len()];
    }
    // Black has no hue: the darkest step stays above 0.
    let next = if next <= 0.0 { largest.min(0.005) } else { next };
    channels.iter().map(|x| rounded_to(x * next / largest, floor_log10(next) - 3)).collect()
}

/// Returns the picture size after `count` steps, with about the same aspect ratio. A coarse step
/// doubles or halves it; a fine step changes the width by 16 pixels.
fn resized(sides: &[f64], range: NumberRange, count: StepCount) -> Vec<f64> {
    let width = sides[0];
    let next = match count.fine {
        true => ((width / 16.0).round() + count.steps as f64) * 16.0,
        false => doubled(width, range, count),
    };
    let factor = next / width;
    let scaled: Vec<_> = sides.iter().map(|s| (s * factor).round()).collect();
    if scaled.iter().all(|s| range.holds(*s)) { scaled } else { sides.to_vec() }
}
