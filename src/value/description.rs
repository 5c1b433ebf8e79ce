//! Macros that declare the tables of scene files.
//!
//! [`description!`] generates a struct from one declaration, with its serde implementation, its
//! defaults, its table of fields and the checks of its value ranges. [`choices!`] generates an enum
//! for a key that accepts a fixed set of words.

use crate::value::{Color, Field, NumberRange, ValidationError, Validator, ValueType};

/// Table of a scene file: the keys that it has and the checks of their values.
pub trait Description {
    /// Help text of the table, for the dashboard and the documentation.
    const DOC: &'static str;
    /// Keys of this kind of table, in the order of their declaration.
    const FIELDS: &'static [Field];

    /// Checks each value of the table against the range of its key. Callers can add checks that
    /// involve several keys to the returned validator.
    fn validator(&self) -> Validator;
}

/// Rust type to which the values of keys in scene files are converted.
pub trait FieldValue {
    /// Type in which declarations write the default values of keys, such as `[f64; 3]` for a
    /// colour.
    type Written;

    /// Type of the values in scene files. The range of numbers is [`NumberRange::FINITE`] unless
    /// the declaration of a key gives another.
    const TYPE: ValueType;

    /// Converts a default value of a declaration to this type.
    ///
    /// # Panics
    /// Panics if `written` is not valid for the type, which is an error in the declaration.
    fn from_written(written: Self::Written) -> Self;

    /// Returns the validation errors of `self`, the value of the key that `field` describes. The
    /// key of each error begins with the name of that key.
    fn errors(&self, field: &Field) -> Vec<ValidationError>;

    /// Returns `true` if the value stands for an omitted key. Files are then written without the
    /// key.
    fn is_absent(&self) -> bool {
        false
    }
}

/// Calls [`FieldValue::is_absent`]. This function exists for serde attributes, which need a path.
pub(crate) fn is_absent(value: &impl FieldValue) -> bool {
    value.is_absent()
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
            type Written = Self;
            const TYPE: ValueType = $value_type;

            fn from_written(written: Self) -> Self {
                written
            }

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
    type Written = [f64; 3];
    const TYPE: ValueType = ValueType::Color(NumberRange::FINITE);

    fn from_written(written: [f64; 3]) -> Self {
        Self(written)
    }

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.0.errors(field)
    }
}

impl FieldValue for bool {
    type Written = Self;
    const TYPE: ValueType = ValueType::Switch;

    fn from_written(written: Self) -> Self {
        written
    }

    fn errors(&self, _: &Field) -> Vec<ValidationError> {
        Vec::new()
    }
}

impl FieldValue for String {
    type Written = &'static str;
    const TYPE: ValueType = ValueType::Text;

    fn from_written(written: &'static str) -> Self {
        written.to_string()
    }

    fn errors(&self, _: &Field) -> Vec<ValidationError> {
        Vec::new()
    }

    fn is_absent(&self) -> bool {
        self.is_empty()
    }
}

impl<T: FieldValue> FieldValue for Option<T> {
    type Written = T::Written;
    const TYPE: ValueType = T::TYPE;

    fn from_written(written: T::Written) -> Self {
        Some(T::from_written(written))
    }

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.as_ref().map(|value| value.errors(field)).unwrap_or_default()
    }

    fn is_absent(&self) -> bool {
        self.is_none()
    }
}

/// Implementation of [`FieldValue`] for a table inside a table.
impl<T: Description> FieldValue for T {
    type Written = Self;
    const TYPE: ValueType = ValueType::Table(T::FIELDS);

    fn from_written(written: Self) -> Self {
        written
    }

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
        #[derive(Clone, Copy, Debug, PartialEq, Eq, ::serde::Serialize, ::serde::Deserialize)]
        pub enum $name {
            $($(#[doc = $doc])+ #[serde(rename = $word)] $variant,)+
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

        impl $crate::value::FieldValue for $name {
            type Written = &'static str;
            const TYPE: $crate::value::ValueType =
                $crate::value::ValueType::Choice(Self::CHOICES);

            fn from_written(written: &'static str) -> Self {
                match written {
                    $($word => Self::$variant,)+
                    _ => panic!("`{written}` is not a word of {}", stringify!($name)),
                }
            }

            fn errors(&self, _: &$crate::value::Field) -> Vec<$crate::value::ValidationError> {
                Vec::new()
            }
        }
    };
}

pub(crate) use choices;

/// Declares a table of a scene file: struct, serde, defaults, table of fields, range checks.
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
/// `Example: Default` and gets the declared defaults. If some key is required, a default of another
/// key must equal the default of its Rust type. Any other default is declared in the form
/// `up: [f64; 3] => "up" "[0.0, 1.0, 0.0]"`, with the function that serde calls and the result of
/// this function as TOML.
macro_rules! description {
    ($(#[doc = $doc:literal])+ pub struct $name:ident: Default { $($fields:tt)+ }) => {
        $crate::value::description!(@struct any all [$($doc)+] [] $name $($fields)+);
        $crate::value::description!(@default $name $($fields)+);
    };
    ($(#[doc = $doc:literal])+ pub struct $name:ident $(: $derived:ident)? { $($fields:tt)+ }) => {
        $crate::value::description!(@struct all any [$($doc)+] [$($derived)?] $name $($fields)+);
    };

    // One of `$per_field` and `$whole` is `all`, the other is `any`. As conditions of `cfg_attr`,
    // `all()` is true and `any()` is false. If `$per_field` is `all`, serde takes the default of
    // each field from the field's Rust type. If `$whole` is `all`, serde takes all defaults from
    // the `Default` of the struct.
    (
        @struct $per_field:ident $whole:ident [$($doc:literal)+] [$($derived:ident)?] $name:ident
        $(
            $(#[doc = $help:literal])+
            $key:ident: $type:ty $(= $default:expr)? $(=> $function:literal $toml:literal)?
            $(, or $absent:literal)?
            $(, in $range:ident $(($($bound:expr),+))? $($unit:literal)?)?
            $(, as $value_type:ident)?;
        )+
        $(skip $hidden:ident: $hidden_type:ty;)?
    ) => {
        $(#[doc = $doc])+
        #[derive(Clone, Debug, PartialEq, ::serde::Serialize, ::serde::Deserialize)]
        $(#[derive($derived)])?
        #[serde(deny_unknown_fields)]
        #[cfg_attr($whole(), serde(default))]
        pub struct $name {
            $(
                $(#[doc = $help])+
                $(
                    #[doc = concat!("\n\nDefault: `", stringify!($default), "`.")]
                    #[cfg_attr($per_field(), serde(default))]
                )?
                $(
                    #[doc = concat!("\n\nDefault: `", $toml, "`.")]
                    #[serde(default = $function)]
                )?
                $(
                    #[doc = concat!("\n\nDefault: none (", $absent, ").")]
                    #[serde(default, skip_serializing_if = "crate::value::is_absent")]
                )?
                pub $key: $type,
            )+
            $(#[serde(skip)] $hidden: $hidden_type,)?
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
        <$type as $crate::value::FieldValue>::from_written($default)
    };
    (@value $type:ty) => {
        <$type as Default>::default()
    };
}
pub(crate) use description;
