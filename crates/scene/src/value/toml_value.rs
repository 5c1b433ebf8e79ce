//! Conversion between the values of TOML and those of descriptions, by the types of keys.

use crate::value::{Color, DefaultValue, Field, KeyNode, KeyValue, NumberRange, ValueType};
use toml::de::{DeInteger, DeValue};
use toml::{Table, Value};

/// Converts `value` to a value of the type `takes`; `None` if it has another type. Whole numbers must
/// be in range, because the fields of scenes cannot store others.
pub(crate) fn read_value(takes: ValueType, value: &DeValue) -> Option<KeyValue> {
    let list = |n: usize, each: &dyn Fn(&DeValue) -> Option<f64>| {
        let list = value.as_array().filter(|list| list.len() == n)?;
        list.iter().map(|entry| each(entry.get_ref())).collect::<Option<Vec<_>>>()
    };
    let numbers = match takes {
        ValueType::Text => return value.as_str().map(|text| KeyValue::Text(text.to_string())),
        ValueType::Switch => return value.as_bool().map(KeyValue::Switch),
        ValueType::Choice(choices) => {
            let word = value.as_str().filter(|word| choices.iter().any(|c| c.name == *word));
            return word.map(|word| KeyValue::Text(word.to_string()));
        }
        ValueType::Whole(range) => whole(value, range).map(|x| vec![x]),
        ValueType::Wholes(n, range) => list(n, &|x| whole(x, range)),
        ValueType::Number(_) => number(value).map(|x| vec![x]),
        ValueType::Numbers(n, _) => list(n, &number),
        ValueType::Direction => list(3, &number),
        ValueType::Factor => number(value).map(|x| vec![x]).or_else(|| list(3, &number)),
        ValueType::Color(_) => match value {
            DeValue::String(text) => Color::from_hex(text).map(|color| color.0.to_vec()),
            _ => list(3, &number),
        },
        ValueType::Table(_)
        | ValueType::OneOf(_)
        | ValueType::ListOf(_)
        | ValueType::Tables(_)
        | ValueType::Named(_) => None,
    };
    numbers.map(KeyValue::Numbers)
}

/// Returns the number that `digits` stand for; `None` if it has more than 64 bits.
pub(crate) fn integer(digits: &DeInteger) -> Option<i64> {
    i64::from_str_radix(digits.as_str(), digits.radix()).ok()
}

fn whole(value: &DeValue, range: NumberRange) -> Option<f64> {
    let number = value.as_integer().and_then(integer)? as f64;
    range.holds(number).then_some(number)
}

fn number(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Integer(digits) => integer(digits).map(|number| number as f64),
        DeValue::Float(digits) => {
            let number: f64 = digits.as_str().parse().ok()?;
            // A number too large for the type is parsed as infinite.
            (!number.is_infinite() || digits.as_str().contains("inf")).then_some(number)
        }
        _ => None,
    }
}

/// Converts `node` of the type `takes` to a TOML table, list or value, without absent optional
/// keys and keys with the values of [`KeyNode::base`].
pub(crate) fn written(takes: ValueType, node: &dyn KeyNode) -> Value {
    let list = |entry: ValueType| {
        let entries = (0..).map_while(|i: usize| node.child(&i.to_string()));
        Value::Array(entries.map(|node| written(entry, node)).collect())
    };
    match takes {
        ValueType::Table(fields) | ValueType::OneOf(fields) => {
            let base = node.base();
            let entry = |field: &Field| {
                let child = node.child(field.name)?;
                let of_base = base.as_ref().and_then(|base| base.child(field.name));
                let is_of_base = || of_base.is_some_and(|of_base| of_base.value() == child.value());
                let is_optional = matches!(field.preset, DefaultValue::Without(_));
                let is_left_out = if is_optional { child.is_absent() } else { is_of_base() };
                (!is_left_out).then(|| (field.name.to_string(), written(field.takes, child)))
            };
            Value::Table(fields.iter().filter_map(entry).collect())
        }
        ValueType::ListOf(fields) => list(ValueType::OneOf(fields)),
        ValueType::Tables(fields) => list(ValueType::Table(fields())),
        ValueType::Named(fields) => {
            let entry = |name: &str| {
                Some((name.to_string(), written(ValueType::Table(fields), node.child(name)?)))
            };
            Value::Table(node.names().into_iter().filter_map(entry).collect())
        }
        _ => write_value(takes, node.value()),
    }
}

/// Converts a single value of the type `takes` to TOML; `None` becomes an empty table.
fn write_value(takes: ValueType, value: Option<KeyValue>) -> Value {
    let one = |x: f64| match takes {
        ValueType::Whole(_) | ValueType::Wholes(..) => Value::Integer(x as i64),
        // NaN is written without a sign.
        _ => Value::Float(if x.is_nan() { x.copysign(1.0) } else { x }),
    };
    match (takes, value) {
        (_, None) => Value::Table(Table::new()),
        (_, Some(KeyValue::Text(text))) => Value::String(text),
        (_, Some(KeyValue::Switch(on))) => Value::Boolean(on),
        (ValueType::Number(_) | ValueType::Whole(_), Some(KeyValue::Numbers(list))) => one(list[0]),
        (ValueType::Factor, Some(KeyValue::Numbers(list))) if list.len() == 1 => one(list[0]),
        (_, Some(KeyValue::Numbers(list))) => Value::Array(list.into_iter().map(one).collect()),
    }
}
