//! Random values of scene keys. They are drawn from the tables that define the format, so that new
//! keys are included.

use crate::harness::*;
use zerkalo_scene::value::{DefaultValue, NumberRange};

/// Function that returns the value of a key. If it returns `None`, the key gets a random value that
/// the format table allows.
pub type KeyValue<'a> = &'a dyn Fn(&mut Numbers, &Field) -> Option<Value>;

/// Returns a random element of `from`.
pub fn pick<T: Copy>(numbers: &mut Numbers, from: &[T]) -> T {
    from[numbers.below(from.len())]
}

pub fn chance(numbers: &mut Numbers, times: usize, of: usize) -> bool {
    numbers.below(of) < times
}

pub fn log(numbers: &mut Numbers, low: f64, high: f64) -> f64 {
    10f64.powf(numbers.between(low.log10(), high.log10()))
}

/// Returns a random direction, along an axis in one of three cases.
pub fn direction(numbers: &mut Numbers) -> DVec3 {
    match numbers.below(3) {
        0 => pick(numbers, &[DVec3::X, DVec3::Y, DVec3::Z]) * pick(numbers, &[1.0, -1.0]),
        _ => numbers.direction(),
    }
}

pub fn list(numbers: impl IntoIterator<Item = f64>) -> Value {
    Value::Array(numbers.into_iter().map(Value::Float).collect())
}

/// Returns a random number in `range`. Magnitudes near 1 are the most frequent.
fn number(numbers: &mut Numbers, range: NumberRange) -> f64 {
    let ends: Vec<f64> =
        [range.low, range.high].into_iter().filter(|x| x.abs() <= 1.0 && range.holds(*x)).collect();
    let x = match numbers.below(4) {
        0 if !ends.is_empty() => return pick(numbers, &ends),
        1 => numbers.unit(),
        _ => log(numbers, 1e-3, 1e3),
    };
    let x = if chance(numbers, 1, 2) && range.holds(-x) { -x } else { x };
    if range.holds(x) { x } else { x.clamp(range.low.max(-1e3), range.high.min(1e3)) }
}

fn value(numbers: &mut Numbers, takes: ValueType, odds: f64, key_value: KeyValue) -> Value {
    match takes {
        ValueType::Text => Value::String(String::new()),
        ValueType::Switch => Value::Boolean(chance(numbers, 1, 2)),
        ValueType::Choice(words) => {
            Value::String(words[numbers.below(words.len())].name.to_string())
        }
        ValueType::Whole(range) => Value::Integer(number(numbers, range).round() as i64),
        ValueType::Wholes(n, range) => {
            Value::Array((0..n).map(|_| Value::Integer(number(numbers, range) as i64)).collect())
        }
        ValueType::Number(range) => Value::Float(number(numbers, range)),
        ValueType::Numbers(n, range) => list((0..n).map(|_| number(numbers, range))),
        ValueType::Direction => list(direction(numbers).to_array()),
        ValueType::Factor => {
            list((0..3).map(|_| log(numbers, 0.3, 3.0) * pick(numbers, &[1.0, -1.0])))
        }
        ValueType::Color(_) => list((0..3).map(|_| numbers.unit())),
        ValueType::Table(fields) => Value::Table(table(numbers, fields, odds, key_value)),
        ValueType::OneOf(fields) => Value::Table(one_of(numbers, fields, odds, key_value)),
        ValueType::ListOf(fields) => {
            let steps = (0..numbers.below(3)).map(|_| one_of(numbers, fields, odds, key_value));
            Value::Array(steps.map(Value::Table).collect())
        }
        ValueType::Tables(fields) => {
            let tables =
                (0..2 + numbers.below(2)).map(|_| table(numbers, fields(), odds, key_value));
            Value::Array(tables.map(Value::Table).collect())
        }
        ValueType::Named(_) => Value::Table(Table::new()),
    }
}

fn one_of(numbers: &mut Numbers, fields: &[Field], odds: f64, key_value: KeyValue) -> Table {
    let field = &fields[numbers.below(fields.len())];
    let value =
        key_value(numbers, field).unwrap_or_else(|| value(numbers, field.takes, odds, key_value));
    [(field.name.to_string(), value)].into_iter().collect()
}

/// Returns a random table with all required keys, and each of the others with the probability
/// `odds`.
pub fn table(numbers: &mut Numbers, fields: &[Field], odds: f64, key_value: KeyValue) -> Table {
    let mut out = Table::new();
    for field in fields {
        if field.preset == DefaultValue::Required || numbers.unit() < odds {
            let value = key_value(numbers, field)
                .unwrap_or_else(|| value(numbers, field.takes, odds, key_value));
            out.insert(field.name.to_string(), value);
        }
    }
    out
}
