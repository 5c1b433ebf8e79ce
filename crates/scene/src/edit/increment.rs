//! Steps by arrow keys: numbers change to the next round number, other values to the next choice.

#![allow(clippy::wildcard_enum_match_arm)]

use crate::Scene;
use crate::edit::bounds::step_length;
use crate::edit::part::{given_key, part};
use crate::edit::properties::is_material;
use crate::edit::set::{label, lookup, replace};
use crate::edit::{Edit, EditError, Target};
use crate::value::{
    DefaultValue, Field, KeyNode, KeyValue, NumberRange, Step, ValueType, floor_log10, node_at,
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
    let given = node_at(part, key).and_then(KeyNode::value);
    let Some(KeyValue::Numbers(numbers)) = given.or_else(|| start(field, scene, target)) else {
        return toggle(scene, target, key, steps > 0.0);
    };
    if component.is_some_and(|c| c >= numbers.len()) {
        return Err(EditError::new(format!("{key} has no such number"), ""));
    }
    let rule = StepRule::of(field, scene, &numbers);
    let count = StepCount::of(steps);
    let next = match (component, field.takes) {
        (None, ValueType::Color(_)) => brightened(&numbers, rule, count),
        (None, ValueType::Wholes(_, range)) => resized(&numbers, range, count),
        _ => {
            let moved = |(i, x): (usize, &f64)| match component {
                Some(c) if c != i => *x,
                _ => rule.stepped(*x, count),
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
pub fn toggle(scene: &Scene, target: &Target, key: &str, forward: bool) -> Result<Edit, EditError> {
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
            let found = format!("arrow keys do not change {}", field.name);
            return Err(EditError::new(found, format!("Type {}.", field.takes)));
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
    let Target::Material(name) = target else { return None };
    let material = scene.materials.get(name)?;
    match field.name {
        "alpha" => rounded_to(material.microfacet_alpha(), -4).value(),
        "f0" => material.f0().value(),
        _ => None,
    }
}

/// Number of arrow steps, negative for steps down. Fine steps are a tenth of the unit, or a fifth of the way between rungs.
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

/// Rule by which an arrow step changes the numbers of a key.
#[derive(Clone, Copy)]
struct StepRule {
    step: Step,
    range: NumberRange,
}

impl StepRule {
    /// Returns the rule of arrow steps for the key `field`, whose value is `numbers`.
    fn of(field: &Field, scene: &Scene, numbers: &[f64]) -> Self {
        let range = match field.takes {
            ValueType::Factor => NumberRange::closed(1e-6, 1e6),
            takes => takes.range(),
        };
        let usual = || match field.takes {
            ValueType::Direction => {
                let largest = numbers.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                Step::Units(0.05 * 10f64.powi(floor_log10(largest)))
            }
            ValueType::Factor => Step::Rungs(0.0),
            ValueType::Color(_) => Step::Units(0.05),
            ValueType::Whole(_) | ValueType::Wholes(..) => Step::Doubles,
            _ if field.unit == "degrees" => Step::Units(5.0),
            _ if range.low == 0.0 && !range.low_in => Step::Rungs(0.0),
            _ if range == NumberRange::COORDINATE => Step::Units(step_length(scene)),
            _ if [NumberRange::SHARE, NumberRange::COEFFICIENT].contains(&range) => {
                Step::Units(0.05)
            }
            _ if field.unit == "scene units" => Step::Rungs(step_length(scene) / 10.0),
            _ if range == NumberRange::LIGHT => Step::Rungs(0.01),
            // Phong exponent, or another number without a unit.
            _ => Step::Rungs(1.0),
        };
        Self { step: field.step.unwrap_or_else(usual), range }
    }

    /// Returns `x` after `count` steps.
    fn stepped(self, x: f64, count: StepCount) -> f64 {
        let Self { step, range } = self;
        match step {
            Step::Rungs(floor) if x < 0.0 => -next_nice(-x, floor, range, count),
            Step::Rungs(floor) => next_nice(x, floor, range, count),
            Step::Units(unit) if range == NumberRange::COEFFICIENT && x > 2.0 => {
                next_nice(x, unit, range, count)
            }
            Step::Units(unit) => {
                let moved = added(x, unit, count);
                // Numbers stay a fine step away from an end that the range excludes, such as 180
                // degrees.
                let margin = |is_in: bool| if is_in { 0.0 } else { 0.1 * unit };
                let low = range.low + margin(range.low_in);
                let high = range.high - margin(range.high_in);
                if moved.is_finite() { within(moved, NumberRange::closed(low, high), x) } else { x }
            }
            Step::Doubles => doubled(x, range, count),
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

/// Returns `x` after some steps: a coarse step doubles or halves it, rounded down, and leads from 0
/// to 1; a fine step adds 1. The result is in `range`.
fn doubled(x: f64, range: NumberRange, StepCount { steps, fine }: StepCount) -> f64 {
    let moved = match steps {
        _ if fine => x + steps as f64,
        0.. if x == 0.0 && steps > 0 => 2f64.powi((steps.min(40) - 1) as i32),
        _ => (x * 2f64.powi(steps.clamp(-40, 40) as i32)).floor(),
    };
    within(moved, range, x)
}

/// Rungs of coarse steps: their mantissas, in hundredths. Successive ones differ by about a quarter.
const RUNGS: [i64; 10] = [100, 125, 160, 200, 250, 320, 400, 500, 640, 800];

/// Rungs of fine steps, which differ by about a twentieth and include the coarse ones.
const FINE_RUNGS: [i64; 42] = [
    100, 105, 110, 115, 120, 125, 130, 140, 150, 160, 170, 180, 190, 200, 210, 220, 230, 240, 250,
    260, 280, 300, 320, 340, 360, 380, 400, 420, 450, 480, 500, 530, 560, 600, 640, 680, 720, 760,
    800, 850, 900, 950,
];

/// Returns the number that is `steps` rungs above `x`, which is at least 0. The result is 0, a rung
/// of at least `floor`, or an end of `range`, so that steps up and down undo each other.
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
    let mantissa = x * format!("1e{}", 2 - e).parse().unwrap_or(1.0);
    let rungs: &[i64] = if fine { &FINE_RUNGS } else { &RUNGS };
    let below = rungs.last().map_or(0, |last| last / 10);
    // Rounding errors may move a number slightly off its rung.
    let next = match up {
        true => rungs.iter().copied().find(|r| *r as f64 > mantissa + 1e-6).unwrap_or(1000),
        false => rungs.iter().copied().rfind(|r| (*r as f64) < mantissa - 1e-6).unwrap_or(below),
    };
    format!("{next}e{}", e - 2).parse().unwrap_or(x)
}

/// Returns a colour with its brightness changed by `count` steps. Upwards, black becomes dark grey.
fn brightened(channels: &[f64], rule: StepRule, count: StepCount) -> Vec<f64> {
    let largest = channels.iter().fold(0.0f64, |m, x| m.max(*x));
    let next = match largest > 2.0 {
        true => next_nice(largest, 0.0, rule.range, count),
        false => rule.stepped(largest, count),
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
