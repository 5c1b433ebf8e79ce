//! Macros that declare the tables of scene files: [`description!`] a struct for a table of keys,
//! [`choices!`] an enum for a key that accepts a set of words.

use crate::value::{
    Color, Field, KeyNode, KeyValue, NumberRange, ValidationError, Validator, ValueType,
};

/// Table of a scene file: the keys that it has and the checks of their values.
pub trait Description: KeyNode {
    /// Help text of the table, for the dashboard and the documentation.
    const DOC: &'static str;
    /// Keys of this kind of table, in the order of their declaration.
    const FIELDS: &'static [Field];

    /// Returns a validator that has checked each value against the range of its key.
    fn validator(&self) -> Validator;
}

/// Rust type to which the values of keys in scene files are converted.
pub trait FieldValue: KeyNode {
    /// Type of the values in scene files, without the range of a declaration.
    const TYPE: ValueType;

    /// Returns the validation errors of the value. Their keys begin with `field.name`.
    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        match self.value() {
            Some(KeyValue::Numbers(numbers)) => field.check(&numbers).into_iter().collect(),
            Some(KeyValue::Switch(_) | KeyValue::Text(_)) | None => Vec::new(),
        }
    }

    /// Converts `value`; `None` if it has another type, or if this is a table.
    fn from_value(_value: KeyValue) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }
}

/// Conversion of a default in a declaration, such as `[f64; 3]` for a colour.
pub trait FromWritten<W> {
    /// Converts a default. Panics if the declaration is wrong.
    fn from_written(written: W) -> Self;
}

impl<T> FromWritten<T> for T {
    fn from_written(written: T) -> Self {
        written
    }
}

impl FromWritten<[f64; 3]> for Color {
    fn from_written(written: [f64; 3]) -> Self {
        Self(written)
    }
}

impl FromWritten<&'static str> for String {
    fn from_written(written: &'static str) -> Self {
        written.to_string()
    }
}

/// Returns the text of a `#[doc]` attribute without its leading space.
pub(crate) const fn doc_text(doc: &'static str) -> &'static str {
    doc.split_at(1).1
}

/// Implements the traits of values for types by their conversions to and from [`KeyValue`].
macro_rules! single_value {
    ($(
        [$($n:ident)?] $type:ty: $value_type:expr, $to:expr, $from:expr
        $(, absent $is_absent:expr, $make_absent:expr)?;
    )+) => {$(
        impl $(<const $n: usize>)? $crate::value::FieldValue for $type {
            const TYPE: $crate::value::ValueType = $value_type;

            fn from_value(value: $crate::value::KeyValue) -> Option<Self> {
                let from: fn($crate::value::KeyValue) -> Option<Self> = $from;
                from(value)
            }
        }

        impl $(<const $n: usize>)? $crate::value::KeyNode for $type {
            fn value(&self) -> Option<$crate::value::KeyValue> {
                let to: fn(&Self) -> $crate::value::KeyValue = $to;
                Some(to(self))
            }

            fn set_value(&mut self, value: $crate::value::KeyValue) -> bool {
                let new = <Self as $crate::value::FieldValue>::from_value(value);
                new.map(|new| *self = new).is_some()
            }

            $(
                fn is_absent(&self) -> bool {
                    let is_absent: fn(&Self) -> bool = $is_absent;
                    is_absent(self)
                }

                fn make_absent(&mut self) {
                    let make_absent: fn(&mut Self) = $make_absent;
                    make_absent(self);
                }
            )?
        }

        impl $(<const $n: usize>)? $crate::value::TomlValue for $type {
            fn from_toml(
                value: &::toml::Spanned<::toml::de::DeValue>,
            ) -> Result<Self, $crate::value::TomlError> {
                $crate::value::read_single(value)
            }

            fn to_toml(&self) -> ::toml::Value {
                $crate::value::write_single(self)
            }
        }
    )+};
}
pub(crate) use single_value;

single_value! {
    [] f64: ValueType::Number(NumberRange::FINITE),
        |x| KeyValue::Numbers(vec![*x]), |value| value.numbers().map(|[x]| x);
    [N] [f64; N]: ValueType::Numbers(N, NumberRange::FINITE),
        |list| KeyValue::Numbers(list.to_vec()), |value| value.numbers();
    [] u32: ValueType::Whole(NumberRange::FINITE),
        |x| KeyValue::Numbers(vec![f64::from(*x)]), |value| value.wholes().map(|[x]| x);
    [N] [u32; N]: ValueType::Wholes(N, NumberRange::FINITE),
        |list| KeyValue::Numbers(list.map(f64::from).to_vec()), |value| value.wholes();
    [] Color: ValueType::Color(NumberRange::FINITE),
        |color| KeyValue::Numbers(color.0.to_vec()), |value| value.numbers().map(Color);
    [] bool: ValueType::Switch,
        |on| KeyValue::Switch(*on), |value| value.switch();
    [] String: ValueType::Text,
        |text| KeyValue::Text(text.clone()), |value| value.text(),
        absent String::is_empty, String::clear;
}

impl<T: FieldValue> FieldValue for Option<T> {
    const TYPE: ValueType = T::TYPE;

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.as_ref().map(|value| value.errors(field)).unwrap_or_default()
    }
}

impl<T: FieldValue> KeyNode for Option<T> {
    fn value(&self) -> Option<KeyValue> {
        self.as_ref()?.value()
    }

    fn set_value(&mut self, value: KeyValue) -> bool {
        T::from_value(value).map(|new| *self = Some(new)).is_some()
    }

    fn is_absent(&self) -> bool {
        self.is_none()
    }

    fn make_absent(&mut self) {
        *self = None;
    }

    fn child(&self, key: &str) -> Option<&dyn KeyNode> {
        self.as_ref()?.child(key)
    }

    fn child_mut(&mut self, key: &str) -> Option<&mut dyn KeyNode> {
        self.as_mut()?.child_mut(key)
    }
}

/// Implementation of [`FieldValue`] for a table inside a table.
impl<T: Description> FieldValue for T {
    const TYPE: ValueType = ValueType::Table(T::FIELDS);

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.validator().errors().into_iter().map(|error| error.prefixed(field.name)).collect()
    }
}

/// Declares an enum whose variants are words in scene files. The doc comment of a variant is the
/// help text of its word.
///
/// ```ignore
/// choices! {
///     /// Distribution of samples over a pixel.
///     pub enum Filter {
///         /// evenly over the pixel's square
///         Box = "box",
///         /// all in its centre: no anti-aliasing
///         Center = "center",
///     }
/// }
/// ```
macro_rules! choices {
    (
        $(#[$attribute:meta])*
        pub enum $name:ident {
            $($(#[doc = $doc:literal])+ $variant:ident = $word:literal,)+
        }
    ) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {
            $($(#[doc = $doc])+ $variant,)+
        }

        impl $name {
            /// Words in scene files with their help texts, in the order of the variants.
            pub const CHOICES: &'static [$crate::value::Choice] = &[$($crate::value::Choice {
                name: $word,
                doc: $crate::value::doc_text(concat!($($doc),+)),
            },)+];

            /// Every variant, in the order of [`Self::CHOICES`].
            pub const ALL: [Self; Self::CHOICES.len()] = [$(Self::$variant),+];
        }

        impl $crate::value::FromWritten<&'static str> for $name {
            fn from_written(written: &'static str) -> Self {
                match written {
                    $($word => Self::$variant,)+
                    _ => panic!("`{written}` is not a word of {}", stringify!($name)),
                }
            }
        }

        $crate::value::single_value! {
            [] $name: $crate::value::ValueType::Choice(Self::CHOICES),
                |choice| $crate::value::KeyValue::Text(Self::CHOICES[*choice as usize].name.into()),
                |value| match value.text()?.as_str() {
                    $($word => Some(Self::$variant),)+
                    _ => None,
                };
        }
    };
}

pub(crate) use choices;

/// Declares a table of a scene file: struct, conversion, defaults, table of fields, range checks.
///
/// ```ignore
/// description! {
///     /// Help text of the table.
///     pub struct Example {
///         /// A key that must be given, with its range and unit.
///         center: [f64; 3], in COORDINATE "scene units";
///         /// A key with a default, written as in a scene file.
///         rotation: f64 = 0.0, in closed(-180.0, 180.0) "degrees";
///         /// A key that may be left out, with a phrase for the result of leaving it out.
///         alpha: Option<f64>, or "roughness / (2 √2)", in SHARE;
///         /// A value type other than that of the Rust type.
///         normal: [f64; 3], as Direction;
///         // A private field that files do not have.
///         skip content: Option<Content>;
///     }
/// }
/// ```
///
/// Ranges are those of [`NumberRange`]. If every key may be left out, the struct is declared as
/// `Example: Default`, and its `Default` consists of the declared defaults. A default whose Rust
/// expression is not TOML is declared as `=> expression, written "TOML"`.
macro_rules! description {
    ($(#[doc = $doc:literal])+ pub struct $name:ident: Default { $($fields:tt)+ }) => {
        $crate::value::description!(@struct [$($doc)+] [] $name $($fields)+);
        $crate::value::description!(@default $name $($fields)+);
    };
    ($(#[doc = $doc:literal])+ pub struct $name:ident $(: $derived:ident)? { $($fields:tt)+ }) => {
        $crate::value::description!(@struct [$($doc)+] [$($derived)?] $name $($fields)+);
    };

    (
        @struct [$($doc:literal)+] [$($derived:ident)?] $name:ident
        $(
            $(#[doc = $help:literal])+
            $key:ident: $type:ty $(= $default:expr)? $(=> $value:expr, written $toml:literal)?
            $(, or $absent:literal)?
            $(, in $range:ident $(($($bound:expr),+))? $($unit:literal)?)?
            $(, as $value_type:ident)?;
        )+
        $(skip $hidden:ident: $hidden_type:ty;)?
    ) => {
        $(#[doc = $doc])+
        #[derive(Clone, Debug, PartialEq)]
        $(#[derive($derived)])?
        pub struct $name {
            $(
                $(#[doc = $help])+
                $(#[doc = concat!("\n\nDefault: `", stringify!($default), "`.")])?
                $(#[doc = concat!("\n\nDefault: `", $toml, "`.")])?
                $(#[doc = concat!("\n\nDefault: none (", $absent, ").")])?
                pub $key: $type,
            )+
            $($hidden: $hidden_type,)?
        }

        impl $crate::value::Description for $name {
            const DOC: &'static str = $crate::value::doc_text(concat!($($doc),+));
            const FIELDS: &'static [$crate::value::Field] = &[$(
                $crate::value::Field::required(
                    stringify!($key),
                    <$type as $crate::value::FieldValue>::TYPE
                        $(.within($crate::value::NumberRange::$range $(($($bound),+))?))?
                        $(.replaced($crate::value::ValueType::$value_type))?,
                    concat!("" $($(, $unit)?)?),
                    $crate::value::doc_text(concat!($($help),+)),
                )
                $(.with_default(stringify!($default)))?
                $(.with_default($toml))?
                $(.or($absent))?,
            )+];

            fn validator(&self) -> $crate::value::Validator {
                $crate::value::Validator::new(Self::FIELDS)
                    $(.field(stringify!($key), &self.$key))+
            }
        }

        impl $crate::value::KeyNode for $name {
            fn child(&self, key: &str) -> Option<&dyn $crate::value::KeyNode> {
                match key {
                    $(stringify!($key) => Some(&self.$key),)+
                    _ => None,
                }
            }

            fn child_mut(&mut self, key: &str) -> Option<&mut dyn $crate::value::KeyNode> {
                match key {
                    $(stringify!($key) => Some(&mut self.$key),)+
                    _ => None,
                }
            }
        }

        impl $crate::value::TomlValue for $name {
            fn from_toml(
                value: &::toml::Spanned<::toml::de::DeValue>,
            ) -> Result<Self, $crate::value::TomlError> {
                let fields = <Self as $crate::value::Description>::FIELDS;
                let table = $crate::value::TableReader::new(value, fields)?;
                Ok(Self {
                    $(
                        $key: $crate::value::description!(
                            @read table $key
                            $(, $crate::value::FromWritten::from_written($default))?
                            $(, $value)?
                            $(, { let _ = $absent; Default::default() })?
                        ),
                    )+
                    $($hidden: Default::default(),)?
                })
            }

            fn to_toml(&self) -> ::toml::Value {
                $crate::value::written(&[$(
                    (
                        stringify!($key),
                        $crate::value::description!(@write (&self.$key) $($absent)?),
                    ),
                )+])
            }
        }
    };

    (@read $table:ident $key:ident) => {
        $table.required(stringify!($key))?
    };
    (@read $table:ident $key:ident, $default:expr) => {
        $table.optional(stringify!($key))?.unwrap_or_else(|| $default)
    };

    // Keys with `or` are written only if they are present.
    (@write ($value:expr)) => {
        Some($value as &dyn $crate::value::TomlValue)
    };
    (@write ($value:expr) $absent:literal) => {
        (!$crate::value::KeyNode::is_absent($value))
            .then_some($value as &dyn $crate::value::TomlValue)
    };

    (
        @default $name:ident
        $(
            $(#[doc = $help:literal])+
            $key:ident: $type:ty $(= $default:expr)? $(, or $absent:literal)?
            $(, in $range:ident $(($($bound:expr),+))? $($unit:literal)?)?
            $(, as $value_type:ident)?;
        )+
        $(skip $hidden:ident: $hidden_type:ty;)?
    ) => {
        impl Default for $name {
            fn default() -> Self {
                Self {
                    $($key: $crate::value::description!(@value $type $(= $default)?),)+
                    $($hidden: Default::default(),)?
                }
            }
        }
    };
    (@value $type:ty = $default:expr) => {
        <$type as $crate::value::FromWritten<_>>::from_written($default)
    };
    (@value $type:ty) => {
        <$type as Default>::default()
    };
}
pub(crate) use description;
