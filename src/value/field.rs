//! Tables of what may be written: one [`Field`] a key. Reading, messages, range checks, the
//! generated reference and every form that edits a description use the same tables.

use crate::value::{NumberRange, ValidationError, number};
use std::fmt;

/// One key of a description.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// The key.
    pub name: &'static str,
    /// What may stand behind it.
    pub takes: ValueType,
    /// Unit of its numbers; empty: none.
    pub unit: &'static str,
    /// What holds if it is left out.
    pub preset: DefaultValue,
    /// What it is, in a sentence.
    pub doc: &'static str,
}

/// What holds if a key is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefaultValue {
    /// It must not be left out.
    Required,
    /// This value, as TOML text.
    Is(&'static str),
    /// No value; the phrase says what happens then.
    Without(&'static str),
}

/// A word out of a fixed set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The word.
    pub name: &'static str,
    /// What it means.
    pub doc: &'static str,
}

/// What may stand behind a key.
#[derive(Clone, Copy, Debug)]
pub enum ValueType {
    /// A string.
    Text,
    /// `true` or `false`.
    Switch,
    /// One of these words.
    Choice(&'static [Choice]),
    /// A whole number.
    Whole(NumberRange),
    /// That many whole numbers.
    Wholes(usize, NumberRange),
    /// A number.
    Number(NumberRange),
    /// That many numbers, each in the range.
    Numbers(usize, NumberRange),
    /// Three numbers that are not all zero; the length does not matter.
    Direction,
    /// A factor other than zero, or three.
    Factor,
    /// A linear colour or `"#rrggbb"`; each channel in the range.
    Color(NumberRange),
    /// A table with these keys.
    Table(&'static [Field]),
    /// A table with exactly one of these keys.
    OneOf(&'static [Field]),
    /// A list of tables, each with exactly one of these keys.
    ListOf(&'static [Field]),
    /// `[[name]]` tables with these keys.
    Tables(&'static [Field]),
    /// `[name.ANY]` tables with these keys.
    Named(&'static [Field]),
}

impl Field {
    /// A key that must be given.
    pub const fn required(
        name: &'static str,
        takes: ValueType,
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        Self { name, takes, unit, preset: DefaultValue::Required, doc }
    }

    /// A key that may be left out and has no value then.
    pub const fn optional(
        name: &'static str,
        takes: ValueType,
        unit: &'static str,
        instead: &'static str,
        doc: &'static str,
    ) -> Self {
        Self { name, takes, unit, preset: DefaultValue::Without(instead), doc }
    }

    /// The key with the default `value`, given as TOML text.
    pub const fn with_default(self, value: &'static str) -> Self {
        Self { preset: DefaultValue::Is(value), ..self }
    }

    /// The key without a value by default; `instead` says what holds then.
    pub const fn or(self, instead: &'static str) -> Self {
        Self { preset: DefaultValue::Without(instead), ..self }
    }

    /// Checks numbers against the value type.
    pub fn check(&self, values: &[f64]) -> Option<ValidationError> {
        let each = |range: NumberRange| values.iter().all(|x| range.holds(*x));
        let valid = match self.takes {
            ValueType::Number(range)
            | ValueType::Numbers(_, range)
            | ValueType::Whole(range)
            | ValueType::Wholes(_, range)
            | ValueType::Color(range) => each(range),
            ValueType::Direction => each(NumberRange::FINITE) && values.iter().any(|x| *x != 0.0),
            ValueType::Factor => each(NumberRange::FINITE) && values.iter().all(|x| *x != 0.0),
            _ => true,
        };
        let name = self.name;
        let found = || match values {
            [x] => format!("{name} is {}", number(*x)),
            list => {
                let list: Vec<_> = list.iter().map(|x| number(*x)).collect();
                format!("{name} is [{}]", list.join(", "))
            }
        };
        (!valid).then(|| ValidationError::new(name, found(), self.takes.to_string()))
    }
}

impl ValueType {
    /// The value type with numbers in `range`.
    pub const fn within(self, range: NumberRange) -> Self {
        match self {
            Self::Whole(_) => Self::Whole(range),
            Self::Wholes(n, _) => Self::Wholes(n, range),
            Self::Number(_) => Self::Number(range),
            Self::Numbers(n, _) => Self::Numbers(n, range),
            Self::Color(_) => Self::Color(range),
            other => other,
        }
    }

    /// `other`: a declaration overrides the value type of a Rust type.
    pub(crate) const fn replaced(self, other: Self) -> Self {
        other
    }
}

const COUNTS: [&str; 5] = ["no", "one", "two", "three", "four"];

/// As the object of "Expected": `a number from 0 to 1`.
impl fmt::Display for ValueType {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Text => f.write_str("a string in quotes"),
            Self::Switch => f.write_str("true or false"),
            Self::Choice(choices) => {
                let words: Vec<_> = choices.iter().map(|c| format!("\"{}\"", c.name)).collect();
                write!(f, "{}", alternatives(&words))
            }
            Self::Whole(range) => write!(f, "a whole number {range}"),
            Self::Wholes(n, range) => {
                write!(f, "a list of {} whole numbers, each {range}", COUNTS[*n])
            }
            Self::Number(range) => write!(f, "a number {range}"),
            Self::Numbers(n, range) => {
                write!(f, "a list of {} numbers, each {range}", COUNTS[*n])
            }
            Self::Direction => f.write_str("a list of three numbers that are not all zero"),
            Self::Factor => f.write_str("a number other than 0, or a list of three such numbers"),
            Self::Color(range) => write!(
                f,
                "a linear colour [red, green, blue], each {range}, or an sRGB colour \"#rrggbb\""
            ),
            Self::Table(fields) => write!(f, "a table with the keys {}", names(fields)),
            Self::OneOf(fields) => write!(f, "a table with exactly one of: {}", names(fields)),
            Self::ListOf(fields) => {
                write!(f, "a list of tables, each with exactly one of: {}", names(fields))
            }
            Self::Tables(_) => f.write_str("a list of tables"),
            Self::Named(_) => f.write_str("named tables"),
        }
    }
}

fn names(fields: &[Field]) -> String {
    fields.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

fn alternatives(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [only] => only.clone(),
        [head @ .., last] => format!("{} or {last}", head.join(", ")),
    }
}
