//! Conversion of descriptions from and to the values of scene files. Unlike with `serde`, code that
//! does not depend on the type is compiled once.

use crate::value::{Color, Field, FieldValue, KeyValue, ValueType};
use std::collections::BTreeMap;
use std::ops::Range;
use toml::de::{DeTable, DeValue};
use toml::{Spanned, Table, Value};

/// Type with a conversion from and to the values of scene files.
pub trait TomlValue {
    /// Converts a value of a scene file, without a check of ranges.
    fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError>
    where
        Self: Sized;

    /// Converts `self` to a value of a scene file.
    fn to_toml(&self) -> Value;

    /// Parses the keys and values of one table.
    fn from_text(text: &str) -> Result<Self, TomlError>
    where
        Self: Sized,
    {
        Self::from_toml(&table_of(text)?)
    }

    /// Converts `self` to a table of a scene file. It is empty if `self` is not a table.
    fn to_table(&self) -> Table {
        match self.to_toml() {
            Value::Table(table) => table,
            _ => Table::new(),
        }
    }
}

/// Error in the conversion of a value of a scene file to a description.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TomlError(Box<(Range<usize>, String)>);

impl TomlError {
    /// Creates an error about the bytes `span` of the file.
    pub fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self(Box::new((span, message.into())))
    }

    /// Returns the bytes of the file that the error is about.
    pub fn span(&self) -> Range<usize> {
        self.0.0.clone()
    }

    /// Returns the error as a clause: ``missing field `radius` ``.
    pub fn message(&self) -> &str {
        &self.0.1
    }
}

fn table_of(text: &str) -> Result<Spanned<DeValue<'_>>, TomlError> {
    let error = |e: toml::de::Error| TomlError::new(e.span().unwrap_or(0..0), e.message());
    let table = DeTable::parse(text).map_err(error)?;
    Ok(Spanned::new(table.span(), DeValue::Table(table.into_inner())))
}

/// Returns the error that `value` is not `expected`.
fn wrong(value: &Spanned<DeValue>, expected: &str) -> TomlError {
    let found = value.get_ref().type_str();
    TomlError::new(value.span(), format!("invalid type: {found}, expected {expected}"))
}

/// Returns the error that the name `found` of a `what` (field or variant) is not among `known`.
fn unknown(span: Range<usize>, what: &str, found: &str, known: &[&str]) -> TomlError {
    let names: Vec<_> = known.iter().map(|name| format!("`{name}`")).collect();
    let expected = match names.as_slice() {
        [] => format!("there are no {what}s"),
        [only] => format!("expected {only}"),
        [first, second] => format!("expected {first} or {second}"),
        names => format!("expected one of {}", names.join(", ")),
    };
    TomlError::new(span, format!("unknown {what} `{found}`, {expected}"))
}

/// Reader of a table whose keys are all known.
pub(crate) struct TableReader<'a> {
    table: &'a DeTable<'a>,
    span: Range<usize>,
}

impl<'a> TableReader<'a> {
    /// Creates a reader of the table `value`, whose keys must be among `fields`.
    pub fn new(value: &'a Spanned<DeValue<'a>>, fields: &[Field]) -> Result<Self, TomlError> {
        let table = value.get_ref().as_table().ok_or_else(|| wrong(value, "a table"))?;
        for key in table.keys() {
            if !fields.iter().any(|field| field.name == key.get_ref().as_ref()) {
                let names: Vec<_> = fields.iter().map(|field| field.name).collect();
                return Err(unknown(key.span(), "field", key.get_ref(), &names));
            }
        }
        Ok(Self { table, span: value.span() })
    }

    /// Returns the value of the key `name`; `None` if the table does not have this key.
    pub fn optional<T: TomlValue>(&self, name: &str) -> Result<Option<T>, TomlError> {
        self.table.get(name).map(T::from_toml).transpose()
    }

    /// Returns the value of the key `name`.
    pub fn required<T: TomlValue>(&self, name: &str) -> Result<T, TomlError> {
        match self.table.get(name) {
            Some(value) => T::from_toml(value),
            None => Err(self.missing(name)),
        }
    }

    fn missing(&self, name: &str) -> TomlError {
        TomlError::new(self.span.clone(), format!("missing field `{name}`"))
    }

    /// Replaces `value` by the value of the key `name`, if the table has this key.
    pub fn replace<T: TomlValue>(&self, name: &str, value: &mut T) -> Result<(), TomlError> {
        if let Some(given) = self.table.get(name) {
            *value = T::from_toml(given)?;
        }
        Ok(())
    }
}

/// Returns the table of `entries`, each a key with its value. Entries without a value are left out.
pub(crate) fn written(entries: &[(&str, Option<&dyn TomlValue>)]) -> Value {
    table(&mut entries.iter().filter_map(|(name, value)| Some((*name, (*value)?))))
}

fn table(entries: &mut dyn Iterator<Item = (&str, &dyn TomlValue)>) -> Value {
    let mut table = Table::new();
    for (name, value) in entries {
        table.insert(name.to_string(), value.to_toml());
    }
    Value::Table(table)
}

/// Returns the only entry of the table `value`: the index of its key in `names`, and its value.
pub(crate) fn only_entry<'a>(
    value: &'a Spanned<DeValue<'a>>,
    names: &[&str],
) -> Result<(usize, &'a Spanned<DeValue<'a>>), TomlError> {
    let table = value.get_ref().as_table().ok_or_else(|| wrong(value, "a table"))?;
    let mut entries = table.iter();
    let error = |number| format!("wanted exactly 1 element, {number}");
    let Some((key, inner)) = entries.next() else {
        return Err(TomlError::new(value.span(), error("found 0 elements")));
    };
    if entries.next().is_some() {
        return Err(TomlError::new(value.span(), error("more than 1 element")));
    }
    match names.iter().position(|name| name == key.get_ref()) {
        Some(index) => Ok((index, inner)),
        None => Err(unknown(key.span(), "variant", key.get_ref(), names)),
    }
}

/// Implements [`TomlValue`] for an enum whose variants have one value each. In scene files such an
/// enum is a table with one key, the name of the variant.
///
/// A declaration of the whole enum also implements [`FieldValue`](crate::value::FieldValue). Each
/// variant has its help text, key, range and unit, written as in `description!`:
///
/// ```ignore
/// one_of! {
///     /// Opening angle of the camera.
///     pub enum ViewAngle {
///         /// Across the picture's height.
///         Vertical(f64) = "vertical", in between(0.0, 180.0) "degrees";
///     }
/// }
/// ```
macro_rules! one_of {
    (
        $(#[$attribute:meta])+
        pub enum $name:ident {
            $(
                $(#[doc = $help:literal])+
                $variant:ident($type:ty) = $key:literal
                $(, in $range:ident $(($($bound:expr),+))? $($unit:literal)?)?;
            )+
        }
    ) => {
        $(#[$attribute])+
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub enum $name {
            $($(#[doc = $help])+ $variant($type),)+
        }

        $crate::value::one_of! {
            $name { $($key => $variant),+ }
        }

        impl $name {
            /// Keys in scene files, one for each variant; exactly one of them is given.
            pub const FIELDS: &'static [$crate::value::Field] = &[$(
                $crate::value::Field::required(
                    $key,
                    <$type as $crate::value::FieldValue>::TYPE
                        $(.within($crate::value::NumberRange::$range $(($($bound),+))?))?,
                    concat!("" $($(, $unit)?)?),
                    $crate::value::doc_text(concat!($($help),+)),
                ),
            )+];

            /// Returns the validation errors of the value, with the key of the variant.
            pub fn faults(&self) -> Vec<$crate::value::ValidationError> {
                let checks = $crate::value::Validator::new(Self::FIELDS);
                match self {
                    $(Self::$variant(value) => checks.field($key, value),)+
                }
                .errors()
            }
        }

        impl $crate::value::FieldValue for $name {
            const TYPE: $crate::value::ValueType = $crate::value::ValueType::OneOf(Self::FIELDS);

            fn errors(&self, field: &$crate::value::Field) -> Vec<$crate::value::ValidationError> {
                let inside = |error: $crate::value::ValidationError| error.inside(field.name);
                self.faults().into_iter().map(inside).collect()
            }
        }
    };
    ($name:ident { $($key:literal => $variant:ident),+ $(,)? }) => {
        impl $crate::value::TomlValue for $name {
            fn from_toml(
                value: &::toml::Spanned<::toml::de::DeValue>,
            ) -> Result<Self, $crate::value::TomlError> {
                type Read<T> = fn(
                    &::toml::Spanned<::toml::de::DeValue>,
                ) -> Result<T, $crate::value::TomlError>;
                const READ: &[Read<$name>] = &[
                    $(|value| $crate::value::TomlValue::from_toml(value).map($name::$variant),)+
                ];
                let (index, value) = $crate::value::only_entry(value, &[$($key),+])?;
                READ[index](value)
            }

            fn to_toml(&self) -> ::toml::Value {
                let (key, value): (&str, &dyn $crate::value::TomlValue) = match self {
                    $(Self::$variant(value) => ($key, value),)+
                };
                $crate::value::written(&[(key, Some(value))])
            }
        }

        impl $crate::value::KeyNode for $name {
            fn value(&self) -> Option<$crate::value::KeyValue> {
                let kind = match self {
                    $(Self::$variant(_) => $key,)+
                };
                Some($crate::value::KeyValue::Text(kind.to_string()))
            }

            fn child(&self, key: &str) -> Option<&dyn $crate::value::KeyNode> {
                let (kind, value): (&str, &dyn $crate::value::KeyNode) = match self {
                    $(Self::$variant(value) => ($key, value),)+
                };
                (kind == key).then_some(value)
            }

            fn child_mut(&mut self, key: &str) -> Option<&mut dyn $crate::value::KeyNode> {
                let (kind, value): (&str, &mut dyn $crate::value::KeyNode) = match self {
                    $(Self::$variant(value) => ($key, value),)+
                };
                (kind == key).then_some(value)
            }
        }
    };
}
pub(crate) use one_of;

/// Returns the entries of the list `value`.
fn entries<'a>(value: &'a Spanned<DeValue<'a>>) -> Result<&'a [Spanned<DeValue<'a>>], TomlError> {
    value.get_ref().as_array().map(|list| &list[..]).ok_or_else(|| wrong(value, "a list"))
}

/// Reads a value that is not a table.
pub(crate) fn read_single<T: FieldValue>(value: &Spanned<DeValue>) -> Result<T, TomlError> {
    let list = || entries(value)?.iter().map(number).collect::<Result<_, _>>();
    let read = match (T::TYPE, value.get_ref()) {
        (ValueType::Color(_), DeValue::String(text)) => {
            Color::from_hex(text).map(|color| KeyValue::Numbers(color.0.to_vec()))
        }
        (_, DeValue::String(text)) => Some(KeyValue::Text(text.to_string())),
        (_, DeValue::Boolean(on)) => Some(KeyValue::Switch(*on)),
        (_, DeValue::Array(_)) => Some(KeyValue::Numbers(list()?)),
        (_, DeValue::Integer(_) | DeValue::Float(_)) => {
            Some(KeyValue::Numbers(vec![number(value)?]))
        }
        (_, DeValue::Datetime(_) | DeValue::Table(_)) => None,
    };
    read.and_then(T::from_value).ok_or_else(|| match (T::TYPE, value.get_ref()) {
        (ValueType::Choice(choices), DeValue::String(word)) => {
            let names: Vec<_> = choices.iter().map(|choice| choice.name).collect();
            unknown(value.span(), "variant", word, &names)
        }
        _ => wrong(value, &T::TYPE.to_string()),
    })
}

/// Writes a value that is not a table.
pub(crate) fn write_single<T: FieldValue>(value: &T) -> Value {
    let one = |x: f64| match T::TYPE {
        ValueType::Whole(_) | ValueType::Wholes(..) => Value::Integer(x as i64),
        // NaN is written without a sign.
        _ => Value::Float(if x.is_nan() { x.copysign(1.0) } else { x }),
    };
    match (T::TYPE, value.value()) {
        (_, None) => Value::Table(Table::new()),
        (_, Some(KeyValue::Text(text))) => Value::String(text),
        (_, Some(KeyValue::Switch(on))) => Value::Boolean(on),
        (ValueType::Number(_) | ValueType::Whole(_), Some(KeyValue::Numbers(list))) => one(list[0]),
        (ValueType::Factor, Some(KeyValue::Numbers(list))) if list.len() == 1 => one(list[0]),
        (_, Some(KeyValue::Numbers(list))) => Value::Array(list.into_iter().map(one).collect()),
    }
}

fn number(value: &Spanned<DeValue>) -> Result<f64, TomlError> {
    match value.get_ref() {
        DeValue::Float(digits) => {
            let digits = digits.as_str();
            let number = digits.parse().ok();
            // A number too large for the type is parsed as infinite.
            number
                .filter(|x: &f64| !x.is_infinite() || digits.contains("inf"))
                .ok_or_else(|| TomlError::new(value.span(), "floating-point number overflowed"))
        }
        DeValue::Integer(digits) => {
            let number = i64::from_str_radix(digits.as_str(), digits.radix());
            let number = number.map(|number| number as f64);
            number.map_err(|_| TomlError::new(value.span(), "integer number overflowed"))
        }
        _ => Err(wrong(value, "a number")),
    }
}

impl<T: TomlValue> TomlValue for Vec<T> {
    fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError> {
        entries(value)?.iter().map(T::from_toml).collect()
    }

    fn to_toml(&self) -> Value {
        Value::Array(self.iter().map(T::to_toml).collect())
    }
}

impl<T: TomlValue> TomlValue for BTreeMap<String, T> {
    fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError> {
        let table = value.get_ref().as_table().ok_or_else(|| wrong(value, "a table"))?;
        let mut map = Self::new();
        for (name, value) in table {
            map.insert(name.get_ref().to_string(), T::from_toml(value)?);
        }
        Ok(map)
    }

    fn to_toml(&self) -> Value {
        table(&mut self.iter().map(|(name, value)| (name.as_str(), value as &dyn TomlValue)))
    }
}

/// Value of an optional key; that of `None` is never written.
impl<T: TomlValue> TomlValue for Option<T> {
    fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError> {
        T::from_toml(value).map(Some)
    }

    fn to_toml(&self) -> Value {
        self.as_ref().map_or(Value::Table(Table::new()), T::to_toml)
    }
}
