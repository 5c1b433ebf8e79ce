//! Steps of a value by arrow keys: a number changes to the next round number up or down, any other
//! value to the next choice.

use crate::Scene;
use crate::edit::bounds::step_length;
use crate::edit::convert::chosen;
use crate::edit::parse_value::floats;
use crate::edit::properties::is_material;
use crate::edit::set::{label, lookup, replace};
use crate::edit::toml_view::{get, read};
use crate::edit::{Edit, EditError, Target};
use crate::value::{DefaultValue, Field, NumberRange, ValueType, floor_log10, rounded_to};
use toml::Value;

/// Changes the numbers of `key` by `steps` arrow steps. If `steps` is a whole number, the steps are
/// coarse. Otherwise `steps` counts fine steps in tenths: 0.1 is one fine step forward, -0.3 is
/// three fine steps back. `component` is the index of the number to change. If it is `None`, all
/// numbers change together; in a colour, the brightness changes.
///
/// A coarse step changes sizes, intensities and roughness by about a tenth, coordinates by
/// [`step_length`], angles by 5 degrees, and fractions between 0 and 1 by 0.05. A fine step changes
/// them by about a tenth of that. A key without numbers changes to the next or previous choice
/// ([`toggle`]).
///
/// The scene stays unchanged at the end of a range. It also stays unchanged if other keys forbid
/// the new value; the edit's note then states the reason.
///
/// # Errors
/// Fails if there is no such key or number, or no value to start from.
pub fn step(
    scene: &Scene,
    subject: &Target,
    key: &str,
    component: Option<usize>,
    steps: f64,
) -> Result<Edit, EditError> {
    let values = read(scene, subject)?;
    let field = lookup(subject, key)?;
    let Some(rule) = StepRule::of(field, scene) else {
        return toggle(scene, subject, key, steps > 0.0);
    };
    let given = get(&values, key).cloned().or_else(|| start(field, scene, subject));
    let Some(numbers) = given.as_ref().and_then(floats) else {
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
    // A step that would make all numbers of a direction 0 is dropped, because such a direction is
    // invalid.
    let is_zero = matches!(field.takes, ValueType::Direction) && next.iter().all(|x| *x == 0.0);
    let next = if is_zero { numbers.clone() } else { next };
    let whole = matches!(field.takes, ValueType::Whole(_) | ValueType::Wholes(..));
    let one = |x: f64| if whole { Value::Integer(x as i64) } else { Value::Float(x) };
    let value = match given {
        Some(Value::Array(_)) => Value::Array(next.into_iter().map(one).collect()),
        _ => one(next[0]),
    };
    replace(scene, subject, key, values, value).or_else(|refusal| {
        let (scene, subject) = (scene.clone(), subject.clone());
        let label = label(&scene, &subject, key);
        Ok(Edit { scene, subject, label, note: Some(refusal.to_string()) })
    })
}

/// Changes `key` to the next choice, or to the previous one if `forward` is `false`, cyclically.
/// The value of `key` may be a word of a list, a switch (`true` or `false`), a kind such as that of
/// a light, or the material of an object. For an optional key, "no value" is one of the choices.
///
/// # Errors
/// Fails if there is no such key, or it has no choices.
pub fn toggle(
    scene: &Scene,
    subject: &Target,
    key: &str,
    forward: bool,
) -> Result<Edit, EditError> {
    let values = read(scene, subject)?;
    let field = lookup(subject, key)?;
    let value = get(&values, key);
    let optional = matches!(field.preset, DefaultValue::Without(_));
    let (words, present): (Vec<&str>, Option<&str>) = match field.takes {
        ValueType::Switch => {
            let on = value.and_then(Value::as_bool).unwrap_or(false);
            return crate::edit::set(scene, subject, key, if on { "false" } else { "true" });
        }
        ValueType::OneOf(kinds) => {
            let present = match value.and_then(Value::as_table) {
                Some(inner) => kinds.iter().find(|k| inner.contains_key(k.name)).map(|k| k.name),
                None => chosen(subject, &values),
            };
            (kinds.iter().map(|k| k.name).collect(), present)
        }
        ValueType::Choice(choices) => {
            (choices.iter().map(|c| c.name).collect(), value.and_then(Value::as_str))
        }
        _ if is_material(subject, field) => {
            let names = scene.materials.keys().map(String::as_str);
            (names.collect(), value.and_then(Value::as_str))
        }
        _ => {
            let found = format!("{} has no words to choose from", field.name);
            return Err(EditError::new(&found, &format!("Type {}.", field.takes)));
        }
    };
    let index = words.iter().position(|word| Some(*word) == present);
    let text = next(index, words.len(), forward, optional).map_or("", |index| words[index]);
    crate::edit::set(scene, subject, key, text)
}

/// Returns the index of the choice after the choice `index`, or before it if `forward` is `false`.
/// The `n` choices form a cycle. `None` stands for "no choice", which is part of the cycle if
/// `optional` is `true`. Returns `None` if `n` is 0.
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

/// Returns the value from which the first arrow step of a key without a value starts. For `alpha`
/// or `f0` of a material it is the value that follows from other keys of the material. Returns
/// `None` for any other key.
fn start(field: &Field, scene: &Scene, subject: &Target) -> Option<Value> {
    let material = match subject {
        Target::Material(name) => scene.materials.get(name),
        _ => None,
    };
    match (field.name, material) {
        ("alpha", Some(material)) => {
            Some(Value::Float(rounded_to(material.microfacet_alpha(), -4)))
        }
        ("f0", Some(material)) => Some(Value::Array(material.f0().0.map(Value::Float).to_vec())),
        _ => None,
    }
}

/// Number and kind of arrow steps. The number is negative for steps down. `fine` is `true` for fine
/// steps, about a tenth as large as coarse ones.
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
    /// Step to the next rung (1, 1.1, 1.2 ... 9, times a power of ten), about a tenth larger or
    /// smaller. Between 0 and `floor` there are no rungs: the step up from 0 leads to `floor`.
    Rungs { floor: f64, range: NumberRange },
    /// Step by `unit`; a fine step is a tenth of it.
    Units { unit: f64, range: NumberRange },
    /// Step by 5 degrees, or by 0.5 in fine steps.
    Degrees { range: NumberRange },
    /// Step of one component of a direction by 0.05 p, where p is the largest power of ten up to
    /// the magnitude of the largest component. A fine step is a tenth of it.
    Direction,
    /// Step to the next rung (1, 1.1, 1.2 ... 9, times a power of ten) of the magnitude; the sign
    /// is kept.
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
                if field.unit == "degrees" {
                    Self::Degrees { range }
                } else if range == NumberRange::SIZE || field.name == "scale" {
                    // A size, or the scale of a texture.
                    Self::Rungs { floor: 0.0, range }
                } else if range == NumberRange::COORDINATE {
                    Self::Units { unit: step_length(scene), range }
                } else if field.name == "height" {
                    // Height of a bump map. The step is small, because useful heights are at most a
                    // hundredth of the size of the surface.
                    Self::Units { unit: 0.005, range }
                } else if matches!(field.name, "roughness" | "alpha") {
                    // The step up from 0 leads to 0.001, the smallest value whose blur is visible
                    // at the far end of a room.
                    Self::Rungs { floor: 0.001, range }
                } else if field.name == "offset"
                    || [NumberRange::SHARE, NumberRange::COEFFICIENT].contains(&range)
                {
                    Self::Units { unit: 0.05, range }
                } else if field.unit == "scene units" {
                    Self::Rungs { floor: step_length(scene) / 10.0, range }
                } else if range == NumberRange::LIGHT {
                    Self::Rungs { floor: 0.01, range }
                } else {
                    // Phong exponent, or another number without a unit.
                    Self::Rungs { floor: 1.0, range }
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

    /// Returns the number `x` after `count` arrow steps. `all` has all numbers of the value to
    /// which `x` belongs, such as the three coordinates of a direction.
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
                // The range of an opening angle excludes its ends. Steps stop a fine step of 0.5
                // degrees before them.
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

/// Returns `x` plus `steps` times `unit` (a tenth of `unit` for fine steps), rounded to a hundredth
/// of a fine step.
fn added(x: f64, unit: f64, StepCount { steps, fine }: StepCount) -> f64 {
    let width = if fine { unit / 10.0 } else { unit };
    rounded_to(x + width * steps as f64, floor_log10(unit) - 3)
}

/// Returns `x` if it is in `range`, otherwise the nearest end of `range`. If `range` excludes this
/// end, returns `old`.
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

/// Returns `x` after doubling or halving it per coarse step, or adding or subtracting 1 per fine
/// step. The result is in `range`.
fn doubled(x: f64, range: NumberRange, StepCount { steps, fine }: StepCount) -> f64 {
    let moved = match steps {
        _ if fine => x + steps as f64,
        0.. if x == 0.0 && steps > 0 => 2f64.powi((steps.min(40) - 1) as i32),
        _ => (x * 2f64.powi(steps.clamp(-40, 40) as i32)).floor(),
    };
    within(moved, range, x)
}

/// Rungs: round numbers between 1 and 10 to which coarse steps lead, in hundredths. Successive
/// rungs differ by about a tenth. The whole numbers from 1 to 9 are among them.
const RUNGS: [i64; 23] = [
    100, 110, 120, 130, 140, 160, 180, 200, 220, 250, 280, 300, 330, 360, 400, 450, 500, 550, 600,
    650, 700, 800, 900,
];

/// Returns the width of a fine step at the mantissa `hundredths`. Both are in hundredths. Fine
/// steps lead to 1.00, 1.01 ... 2.00, 2.02 ... 5.00, 5.05 ... 9.95.
fn fine_width(hundredths: i64) -> i64 {
    match hundredths {
        ..200 => 1,
        200..500 => 2,
        _ => 5,
    }
}

/// Returns the number that is `steps` rungs (round numbers such as 1, 1.1, 1.2) above `x`, or below
/// it for negative `steps`. `x` must be at least 0. Between 0 and `floor` there are no rungs. The
/// result is always a rung or an end of `range`; steps up and down therefore undo each other.
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

/// Returns the next round number above `x` if `up` is `true`, otherwise the next one below. `x` is
/// greater than 0. `fine` selects the round numbers of fine steps.
fn nice_step(x: f64, up: bool, fine: bool) -> f64 {
    let e = floor_log10(x);
    let scale = format!("1e{}", 2 - e).parse().unwrap_or(1.0);
    let mantissa = x * scale;
    // Rounding errors of the scaling may move a number slightly off its rung.
    let nearest = mantissa.round();
    let on_rung = (mantissa - nearest).abs() < 1e-6;
    let below = if on_rung { nearest as i64 } else { mantissa.floor() as i64 };
    let hundredths = match (up, fine) {
        (true, true) => {
            let width = fine_width(below);
            (below / width + 1) * width
        }
        (false, true) => {
            let reach = if on_rung { below - 1 } else { below };
            let width = fine_width(reach.max(100));
            // Below 1.00, the next rung of fine steps is 9.95 times the next lower power of ten.
            if reach < 100 {
                return rounded_to(9.95 * 10f64.powi(e - 1), e - 3);
            } else {
                reach / width * width
            }
        }
        (true, false) => RUNGS.iter().copied().find(|r| *r > below).unwrap_or(1000),
        (false, false) => {
            let under = |r: &i64| if on_rung { *r < below } else { *r <= below };
            RUNGS.iter().rev().copied().find(under).unwrap_or(90)
        }
    };
    format!("{hundredths}e{}", e - 2).parse().unwrap_or(x)
}

/// Returns a colour with its brightness changed by `count` arrow steps. Black becomes a dark grey.
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
    // Black has no hue. The brightness of the darkest step is therefore above 0.
    let next = if next <= 0.0 { largest.min(0.005) } else { next };
    channels.iter().map(|x| rounded_to(x * next / largest, floor_log10(next) - 3)).collect()
}

/// Returns a picture size with width and height changed together by `count` arrow steps. A coarse
/// step doubles or halves them, a fine step changes the width by 16 pixels. The aspect ratio is
/// kept as far as whole numbers allow.
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
