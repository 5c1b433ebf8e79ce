//! Tables of keys, for the parser, messages, range checks, the manual and the editing forms.

use crate::value::{NumberRange, ValidationError, number};
use std::fmt;

/// Properties of one key in scene files.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Name of the key as scene files write it.
    pub name: &'static str,
    /// Type and range of the key's value.
    pub takes: ValueType,
    /// Unit of the numbers in the value; empty if there is none.
    pub unit: &'static str,
    /// Default, or what omitting the key means.
    pub preset: DefaultValue,
    /// Step of the numbers by arrow keys; `None` if type, range and unit determine it.
    pub step: Option<Step>,
    /// Help text of the key, one sentence.
    pub doc: &'static str,
}

/// Default value of a key in scene files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DefaultValue {
    /// No default: the key is required.
    Required,
    /// Default value of the key, given as TOML text.
    Is(&'static str),
    /// The key may be omitted; a phrase describes the result.
    Without(&'static str),
}

/// Step by which an arrow key changes a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Step by this number; a fine step is a tenth of it.
    Units(f64),
    /// Geometric step along the rungs: 1, 1.25, 1.6 ... 8, times any power of ten. The sign stays.
    /// There are no rungs between 0 and this number.
    Rungs(f64),
    /// Step by doubling or halving, or by 1 in fine steps. The step up from 0 leads to 1.
    Doubles,
}

/// One of the words that a key accepts, such as `"ggx"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Word that the key accepts, as scene files write it.
    pub name: &'static str,
    /// Help text of the word, a phrase.
    pub doc: &'static str,
}

/// Type and range of the value of a key in scene files.
#[derive(Clone, Copy, Debug)]
pub enum ValueType {
    /// String, such as a name.
    Text,
    /// Switch: `true` or `false`.
    Switch,
    /// One of the listed words, as a string.
    Choice(&'static [Choice]),
    /// Whole number in the given range.
    Whole(NumberRange),
    /// List of whole numbers, given by the length of the list and the range of each number.
    Wholes(usize, NumberRange),
    /// Number in the given range.
    Number(NumberRange),
    /// List of numbers, given by the length of the list and the range of each number.
    Numbers(usize, NumberRange),
    /// Direction: three numbers that are not all zero. The vector may have any length.
    Direction,
    /// Scale factor other than zero: one number, or one for each of the three axes.
    Factor,
    /// Linear colour or `"#rrggbb"`, with the range of each channel.
    Color(NumberRange),
    /// Table with the listed keys.
    Table(&'static [Field]),
    /// Table with exactly one of the listed keys.
    OneOf(&'static [Field]),
    /// List of tables, each with exactly one of the listed keys.
    ListOf(&'static [Field]),
    /// List of `[[name]]` tables, each with the listed keys. A function, because the keys of a
    /// compound's parts contain themselves, and constants cannot refer to each other in a cycle.
    Tables(fn() -> &'static [Field]),
    /// Tables `[name.NAME]` with the listed keys.
    Named(&'static [Field]),
}

impl Field {
    /// Creates the description of a required key of scene files.
    pub const fn required(
        name: &'static str,
        takes: ValueType,
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        Self { name, takes, unit, preset: DefaultValue::Required, step: None, doc }
    }

    /// Returns the key with the default `value`, given as TOML text.
    pub const fn with_default(self, value: &'static str) -> Self {
        Self { preset: DefaultValue::Is(value), ..self }
    }

    /// Returns the key without a default. `instead` describes the result of omitting it.
    pub const fn or(self, instead: &'static str) -> Self {
        Self { preset: DefaultValue::Without(instead), ..self }
    }

    /// Returns the key with the given step of its numbers.
    pub const fn stepped(self, step: Step) -> Self {
        Self { step: Some(step), ..self }
    }

    /// Returns an error if one of `values` is out of range.
    pub fn check(&self, values: &[f64]) -> Option<ValidationError> {
        let range = self.takes.range();
        let mut zeros = values.iter().map(|x| *x == 0.0);
        let vanishes = matches!(self.takes, ValueType::Direction) && zeros.all(|zero| zero)
            || matches!(self.takes, ValueType::Factor) && zeros.any(|zero| zero);
        let valid = values.iter().all(|x| range.holds(*x)) && !vanishes;
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
    /// Returns the range of each number; all finite numbers for types without a range.
    pub const fn range(self) -> NumberRange {
        match self {
            Self::Whole(range)
            | Self::Wholes(_, range)
            | Self::Number(range)
            | Self::Numbers(_, range)
            | Self::Color(range) => range,
            Self::Direction | Self::Factor | Self::Text | Self::Switch | Self::Choice(_) => {
                NumberRange::FINITE
            }
            Self::Table(_)
            | Self::OneOf(_)
            | Self::ListOf(_)
            | Self::Tables(_)
            | Self::Named(_) => NumberRange::FINITE,
        }
    }

    /// Returns the value type with the number range `range`.
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

    /// Returns `other`, the value type that a declaration gives instead of that of its Rust type.
    pub(crate) const fn replaced(self, other: Self) -> Self {
        other
    }
}

/// Returns the fields `own`, with the fields `inner` inserted after the first `position` of `own`.
pub(crate) const fn inserted<const N: usize>(
    own: &[Field],
    inner: &[Field],
    position: usize,
) -> [Field; N] {
    let mut all = [own[0]; N];
    let mut i = 0;
    while i < N {
        all[i] = if i < position {
            own[i]
        } else if i < position + inner.len() {
            inner[i - position]
        } else {
            own[i - inner.len()]
        };
        i += 1;
    }
    all
}

const COUNTS: [&str; 5] = ["no", "one", "two", "three", "four"];

/// Formats the type as a phrase that continues "Expected", such as `a number from 0 to 1`.
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

/// Returns the names of `fields`, separated by commas.
pub(crate) fn names(fields: &[Field]) -> String {
    fields.iter().map(|f| f.name).collect::<Vec<_>>().join(", ")
}

fn alternatives(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [only] => only.clone(),
        [head @ .., last] => format!("{} or {last}", head.join(", ")),
    }
}
