//! Macros that declare the tables of scene files.
//!
//! [`description!`] generates a struct from one declaration, with its conversion from and to TOML,
//! its defaults, its table of fields and the checks of its value ranges. [`choices!`] generates an
//! enum for a key that accepts a fixed set of words.

use crate::value::{Color, Field, NumberRange, ValidationError, Validator, ValueType};

/// Table of a scene file: the keys that it has and the checks of their values.
pub trait Description {
    /// Help text of the table, for the dashboard and the documentation.
    const DOC: &'static str;
    /// Keys of this kind of table, in the order of their declaration.
    const FIELDS: &'static [Field];

    /// Returns a validator that has checked each value of the table against the range of its key.
    /// Callers can add checks that involve several keys.
    fn validator(&self) -> Validator;
}

/// Rust type to which the values of keys in scene files are converted.
pub trait FieldValue {
    /// Type of the values in scene files. The range of numbers is [`NumberRange::FINITE`] unless
    /// the declaration of a key gives another.
    const TYPE: ValueType;

    /// Returns the validation errors of `self`, the value of the key that `field` describes. The
    /// dotted key of each error begins with `field.name`.
    fn errors(&self, field: &Field) -> Vec<ValidationError>;

    /// Returns `true` if the value stands for an omitted key. Files are then written without the
    /// key.
    fn is_absent(&self) -> bool {
        false
    }
}

/// Conversion of a default value in a `description!` declaration, such as `[f64; 3]` for a colour,
/// to the Rust type of its key.
pub trait FromWritten<W> {
    /// Converts a default value of a declaration to this type.
    ///
    /// # Panics
    /// Panics if `written` is not valid for the type, which is an error in the declaration.
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

/// Returns the text of a doc comment without its leading space. `doc` is the text as the attribute
/// `#[doc]` holds it.
pub(crate) const fn doc_text(doc: &'static str) -> &'static str {
    doc.split_at(1).1
}

/// Implements [`FieldValue`] for number types. Declarations write the default values of number keys
/// as Rust literals.
macro_rules! numeric {
    ($([$($n:ident)?] $type:ty => $value_type:expr, $numbers:expr;)+) => {$(
        impl $(<const $n: usize>)? FieldValue for $type {
            const TYPE: ValueType = $value_type;

            fn errors(&self, field: &Field) -> Vec<ValidationError> {
                let numbers: fn(&Self) -> Vec<f64> = $numbers;
                field.check(&numbers(self)).into_iter().collect()
            }
        }
    )+};
}

numeric! {
    [] f64 => ValueType::Number(NumberRange::FINITE), |x| vec![*x];
    [N] [f64; N] => ValueType::Numbers(N, NumberRange::FINITE), |list| list.to_vec();
    [] u32 => ValueType::Whole(NumberRange::FINITE), |x| vec![f64::from(*x)];
    [N] [u32; N] => ValueType::Wholes(N, NumberRange::FINITE), |list| list.map(f64::from).to_vec();
}

impl FieldValue for Color {
    const TYPE: ValueType = ValueType::Color(NumberRange::FINITE);

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.0.errors(field)
    }
}

impl FieldValue for bool {
    const TYPE: ValueType = ValueType::Switch;

    fn errors(&self, _: &Field) -> Vec<ValidationError> {
        Vec::new()
    }
}

impl FieldValue for String {
    const TYPE: ValueType = ValueType::Text;

    fn errors(&self, _: &Field) -> Vec<ValidationError> {
        Vec::new()
    }

    fn is_absent(&self) -> bool {
        self.is_empty()
    }
}

impl<T: FieldValue> FieldValue for Option<T> {
    const TYPE: ValueType = T::TYPE;

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.as_ref().map(|value| value.errors(field)).unwrap_or_default()
    }

    fn is_absent(&self) -> bool {
        self.is_none()
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

        impl $crate::value::TomlValue for $name {
            fn from_toml(
                value: &::toml::Spanned<::toml::de::DeValue>,
            ) -> Result<Self, $crate::value::TomlError> {
                $crate::value::choice(value, Self::CHOICES).map(|index| Self::ALL[index])
            }

            fn to_toml(&self) -> ::toml::Value {
                ::toml::Value::String(Self::CHOICES[*self as usize].name.to_string())
            }
        }

        impl $crate::value::FromWritten<&'static str> for $name {
            fn from_written(written: &'static str) -> Self {
                match written {
                    $($word => Self::$variant,)+
                    _ => panic!("`{written}` is not a word of {}", stringify!($name)),
                }
            }
        }

        impl $crate::value::FieldValue for $name {
            const TYPE: $crate::value::ValueType =
                $crate::value::ValueType::Choice(Self::CHOICES);

            fn errors(&self, _: &$crate::value::Field) -> Vec<$crate::value::ValidationError> {
                Vec::new()
            }
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
/// `Example: Default`, and its `Default` consists of the declared defaults. If some key is
/// required, a default declared by `=` must equal the default of the key's Rust type. Any other
/// default is declared in the form `up: [f64; 3] => up "[0.0, 1.0, 0.0]"`: the function `up`
/// returns the default, and the string is the same default as TOML.
macro_rules! description {
    ($(#[doc = $doc:literal])+ pub struct $name:ident: Default { $($fields:tt)+ }) => {
        $crate::value::description!(@struct [all] [$($doc)+] [] $name $($fields)+);
        $crate::value::description!(@default $name $($fields)+);
    };
    ($(#[doc = $doc:literal])+ pub struct $name:ident $(: $derived:ident)? { $($fields:tt)+ }) => {
        $crate::value::description!(@struct [] [$($doc)+] [$($derived)?] $name $($fields)+);
    };

    // `$all` is given if the declaration has `: Default`. The values of missing keys are then taken
    // from the `Default` of the struct.
    (
        @struct [$($all:ident)?] [$($doc:literal)+] [$($derived:ident)?] $name:ident
        $(
            $(#[doc = $help:literal])+
            $key:ident: $type:ty $(= $default:expr)? $(=> $function:ident $toml:literal)?
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

        impl $crate::value::TomlValue for $name {
            fn from_toml(
                value: &::toml::Spanned<::toml::de::DeValue>,
            ) -> Result<Self, $crate::value::TomlError> {
                let fields = <Self as $crate::value::Description>::FIELDS;
                let table = $crate::value::TableReader::new(value, fields)?;
                $crate::value::description!(@read [$($all)?] [$($hidden)?] table $(
                    $key
                    $([Default::default; $default])?
                    $([$function; $toml])?
                    $([Default::default; $absent])?,
                )+)
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

    (@read [all] [$($hidden:ident)?] $table:ident $($key:ident $([$($default:tt)+])?,)+) => {{
        let mut new = Self::default();
        $($table.replace(stringify!($key), &mut new.$key)?;)+
        Ok(new)
    }};
    (
        @read [] [$($hidden:ident)?] $table:ident
        $($key:ident $([$($function:ident)::+; $unused:tt])?,)+
    ) => {
        Ok(Self {
            $($key: $crate::value::description!(@value_of $table $key $($($function)::+)?),)+
            $($hidden: Default::default(),)?
        })
    };
    (@value_of $table:ident $key:ident) => {
        $table.required(stringify!($key))?
    };
    (@value_of $table:ident $key:ident $($function:ident)::+) => {
        $table.optional(stringify!($key))?.unwrap_or_else($($function)::+)
    };

    // The first rule is for keys that are always written. The second is for keys declared with
    // `or`, which may be left out: their values are written only if they are present.
    (@write ($value:expr)) => {
        Some($value as &dyn $crate::value::TomlValue)
    };
    (@write ($value:expr) $absent:literal) => {
        (!$crate::value::FieldValue::is_absent($value))
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
