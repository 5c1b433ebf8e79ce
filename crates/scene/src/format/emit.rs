//! Writing of new parts of a scene file, without default values, in the layout of the manual.

use crate::value::{Color, DefaultValue, Field, PRESET, ValueType};
use toml::Value;
use toml_edit::{Array, InlineTable, Item, Table};

/// Returns the TOML item for a new `value` of the type `takes`. Tables may have `[headers]` if
/// `headers` is `true`; if it is `false`, they are inline.
pub(crate) fn fresh(takes: ValueType, value: &Value, headers: bool) -> Item {
    let item = |table: Table| match headers {
        true => Item::Table(table),
        false => Item::Value(table.into_inline_table().into()),
    };
    match (takes, value) {
        (ValueType::Table(fields), Value::Table(table)) => item(fresh_table(fields, table)),
        (ValueType::OneOf(fields), Value::Table(table)) => {
            let mut dotted = fresh_table(fields, table);
            dotted.set_dotted(true);
            item(dotted)
        }
        (ValueType::Named(fields), Value::Table(named)) => {
            let mut outer = Table::new();
            outer.set_implicit(true);
            for (name, value) in named {
                outer.insert(name, fresh(ValueType::Table(fields), value, headers));
            }
            item(outer)
        }
        (ValueType::Tables(fields), Value::Array(list)) if headers => {
            Item::ArrayOfTables(list.iter().map(|v| fresh_entry(fields(), v)).collect())
        }
        (ValueType::Tables(fields), Value::Array(list)) => inline_list(fields(), list),
        (ValueType::ListOf(fields), Value::Array(list)) => inline_list(fields, list),
        (ValueType::Color(_), value) => Item::Value(color_leaf(value)),
        _ => Item::Value(leaf(value)),
    }
}

fn inline_list(fields: &'static [Field], list: &[Value]) -> Item {
    let entries = list.iter().map(|v| fresh_entry(fields, v).into_inline_table());
    Item::Value(toml_edit::Value::Array(entries.collect::<Array>()))
}

/// Returns a colour as a list, or as `#rrggbb` if that is exact and not all numbers are whole.
fn color_leaf(value: &Value) -> toml_edit::Value {
    let code = color(value).filter(|c| c.0.iter().any(|x| x.fract() != 0.0));
    code.and_then(Color::to_hex).map_or_else(|| leaf(value), toml_edit::Value::from)
}

/// Converts a list of three numbers to a colour; `None` for other values.
pub(crate) fn color(value: &Value) -> Option<Color> {
    let channels: Vec<f64> = value.as_array()?.iter().filter_map(Value::as_float).collect();
    channels.try_into().ok().map(Color)
}

/// Returns the table for `value`, an entry of a list.
pub(crate) fn fresh_entry(fields: &'static [Field], value: &Value) -> Table {
    value.as_table().map_or_else(Table::new, |table| fresh_table(fields, table))
}

/// Returns a table with the `values` that differ from their defaults. Inner tables are inline,
/// except for kinds (`shape`, `view_angle`), which have dotted keys.
pub(crate) fn fresh_table(fields: &'static [Field], values: &toml::Table) -> Table {
    let mut table = Table::new();
    // A preset replaces the defaults, and `values` has only the keys that override it.
    let overrides = values.contains_key(PRESET);
    for field in fields {
        let is_written = |value: &&Value| overrides || !is_default(field, value);
        let Some(value) = values.get(field.name).filter(is_written) else {
            continue;
        };
        let dotted = matches!(field.takes, ValueType::OneOf(_));
        table.insert(field.name, fresh(field.takes, value, dotted));
    }
    table
}

/// Parses the TOML notation of a default value.
pub(crate) fn preset(text: &str) -> Option<Value> {
    format!("value = {text}").parse::<toml::Table>().ok()?.remove("value")
}

/// Returns `true` if `value` is the default of the key `field`.
pub(crate) fn is_default(field: &Field, value: &Value) -> bool {
    match field.preset {
        DefaultValue::Is(text) => preset(text).as_ref() == Some(value),
        DefaultValue::Required | DefaultValue::Without(_) => false,
    }
}

/// Converts `value` to an inline value, in the layout `[1.0, 2.0]`.
pub(crate) fn leaf(value: &Value) -> toml_edit::Value {
    match value {
        Value::String(text) => text.as_str().into(),
        Value::Integer(whole) => (*whole).into(),
        Value::Float(number) => float(*number),
        Value::Boolean(yes) => (*yes).into(),
        Value::Datetime(time) => time.to_string().into(),
        Value::Array(list) => list.iter().map(leaf).collect::<Array>().into(),
        Value::Table(table) => {
            let mut inline = InlineTable::new();
            for (key, value) in table {
                inline.insert(key, leaf(value));
            }
            inline.into()
        }
    }
}

/// Converts a number to the shortest digits that are read back exactly, with an exponent if
/// shorter.
fn float(number: f64) -> toml_edit::Value {
    let size = number.abs();
    let zeros = number.is_finite() && size != 0.0 && !(1e-5..1e16).contains(&size);
    if zeros && let Ok(value) = format!("{number:e}").parse() {
        return value;
    }
    number.into()
}
