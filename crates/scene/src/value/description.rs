//! Macros for the tables of scene files: [`description!`] declares a struct for a table of keys,
//! [`choices!`] declares an enum for a key that accepts a set of words.

use crate::value::{Color, Field, KeyNode, KeyValue, NumberRange, ValidationError, ValueType};

/// Table of a scene file: the keys that it has and the checks of their values. In its `Default`,
/// keys have their declared defaults; required keys are 0, empty, or of the first kind.
pub trait Description: KeyNode + Default {
    /// Help text of the table, for the dashboard and the documentation.
    const DOC: &'static str;
    /// Keys of this kind of table, in the order of their declaration.
    const FIELDS: &'static [Field];
    /// Example in TOML, for the manual and for tests; may be empty.
    const EXAMPLE: &'static str;
}

/// Rust type to which the values of keys in scene files are converted.
pub trait FieldValue: KeyNode + Default {
    /// Type of the values in scene files. A declaration may give it a narrower range.
    const TYPE: ValueType;

    /// Returns the validation errors of the value. Their keys begin with `field.name`.
    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        match self.value() {
            Some(KeyValue::Numbers(numbers)) => field.check(&numbers).into_iter().collect(),
            Some(KeyValue::Switch(_) | KeyValue::Text(_)) | None => Vec::new(),
        }
    }
}

/// Conversion of a default from the type that declarations write, such as `[f64; 3]` for a colour.
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

/// Implements `FieldValue` and `KeyNode` for types by their conversions to and from [`KeyValue`].
macro_rules! single_value {
    ($(
        $type:ty: $value_type:expr, $to:expr, $from:expr
        $(, absent $is_absent:expr, $make_absent:expr)?;
    )+) => {$(
        impl $crate::value::FieldValue for $type {
            const TYPE: $crate::value::ValueType = $value_type;
        }

        impl $crate::value::KeyNode for $type {
            fn value(&self) -> Option<$crate::value::KeyValue> {
                let to: fn(&Self) -> $crate::value::KeyValue = $to;
                Some(to(self))
            }

            fn set_value(&mut self, value: $crate::value::KeyValue) -> bool {
                let from: fn($crate::value::KeyValue) -> Option<Self> = $from;
                from(value).map(|new| *self = new).is_some()
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
    )+};
}
pub(crate) use single_value;

single_value! {
    f64: ValueType::Number(NumberRange::FINITE),
        |x| KeyValue::Numbers(vec![*x]), |value| value.numbers().map(|[x]| x);
    [f64; 2]: ValueType::Numbers(2, NumberRange::FINITE),
        |list| KeyValue::Numbers(list.to_vec()), |value| value.numbers();
    [f64; 3]: ValueType::Numbers(3, NumberRange::FINITE),
        |list| KeyValue::Numbers(list.to_vec()), |value| value.numbers();
    u32: ValueType::Whole(NumberRange::FINITE),
        |x| KeyValue::Numbers(vec![f64::from(*x)]), |value| value.wholes().map(|[x]| x);
    [u32; 2]: ValueType::Wholes(2, NumberRange::FINITE),
        |list| KeyValue::Numbers(list.map(f64::from).to_vec()), |value| value.wholes();
    Color: ValueType::Color(NumberRange::FINITE),
        |color| KeyValue::Numbers(color.0.to_vec()), |value| value.numbers().map(Color);
    bool: ValueType::Switch,
        |on| KeyValue::Switch(*on), |value| value.switch();
    String: ValueType::Text,
        |text| KeyValue::Text(text.clone()), |value| value.text(),
        absent String::is_empty, String::clear;
}

impl<T: FieldValue> FieldValue for Option<T> {
    const TYPE: ValueType = T::TYPE;

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.as_ref().map(|value| value.errors(field)).unwrap_or_default()
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

        impl Default for $name {
            fn default() -> Self {
                Self::ALL[0]
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

        $crate::value::single_value! {
            $name: $crate::value::ValueType::Choice(Self::CHOICES),
                |choice| $crate::value::KeyValue::Text(Self::CHOICES[*choice as usize].name.into()),
                |value| match value.text()?.as_str() {
                    $($word => Some(Self::$variant),)+
                    _ => None,
                };
        }
    };
}

pub(crate) use choices;

/// Declares a table of a scene file: struct, defaults, table of fields, range checks, access by key.
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
///         /// A key whose range and unit do not determine the step of arrow keys.
///         offset: f64 = 0.0, in closed(-1e6, 1e6), step Units(0.05);
///         // The keys of another table, as if they were declared here after the first three.
///         flatten placement: Placement, after 3;
///         // A private field for the content of the key `file`.
///         loads content: Loaded<Image>;
///         // Method that returns the values of omitted keys, if `preset` determines them.
///         based on preset_material;
///         // An example in TOML.
///         example "example = { center = [0.0, 1.0, 0.0] }";
///     }
/// }
/// ```
///
/// Ranges are those of [`NumberRange`]. A default whose Rust expression is not TOML is declared as
/// `=> expression, written "TOML"`.
macro_rules! description {
    (
        $(#[doc = $doc:literal])+
        pub struct $name:ident $(: $derived:ident)? {
            $(
                $(#[doc = $help:literal])+
                $key:ident: $type:ty $(= $default:expr)? $(=> $value:expr, written $toml:literal)?
                $(, or $absent:literal)?
                $(, in $range:ident $(($($bound:expr),+))? $($unit:literal)?)?
                $(, as $value_type:ident)?
                $(, step $step:ident($width:literal))?;
            )+
            $(flatten $flat:ident: $flat_type:ty, after $position:literal;)?
            $(loads $hidden:ident: $hidden_type:ty;)?
            $(based on $base:ident;)?
            $(example $example:literal;)?
        }
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
            $(
                #[doc = concat!("Keys of [`", stringify!($flat_type), "`].")]
                pub $flat: $flat_type,
            )?
            $(pub(crate) $hidden: $hidden_type,)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $($key: $crate::value::description!(
                        @default
                        $($crate::value::FromWritten::from_written($default))? $($value)?
                    ),)+
                    $($flat: Default::default(),)?
                    $($hidden: Default::default(),)?
                }
            }
        }

        impl $crate::value::Description for $name {
            const DOC: &'static str = $crate::value::doc_text(concat!($($doc),+));
            const EXAMPLE: &'static str = concat!("" $(, $example)?);
            const FIELDS: &'static [$crate::value::Field] = {
                const OWN: &[$crate::value::Field] = &[$(
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
                    $(.or($absent))?
                    $(.stepped($crate::value::Step::$step($width)))?,
                )+];
                $crate::value::description!(@fields OWN $(, <$flat_type>::FIELDS, $position)?)
            };
        }

        impl $crate::value::KeyNode for $name {
            fn validator(&self) -> $crate::value::Validator {
                $crate::value::Validator::new(<Self as $crate::value::Description>::FIELDS)
                    $(.field(stringify!($key), &self.$key))+
                    $(.flattened(&self.$flat))?
                    $(.and(self.$hidden.fault()))?
            }

            $(
                fn base(&self) -> Option<Box<dyn $crate::value::KeyNode>> {
                    self.$base().map(|base| Box::new(base) as _)
                }

                fn rebase(&mut self) {
                    *self = self.$base().unwrap_or_else(|| self.clone());
                }
            )?

            $crate::value::children! { $(stringify!($key) => $key),+ $(; $flat: $flat_type)? }
        }
    };

    (@default) => { Default::default() };
    (@default $default:expr) => { $default };

    (@fields $own:ident) => { $own };
    (@fields $own:ident, $flat:expr, $position:literal) => {
        &$crate::value::inserted::<{ $own.len() + $flat.len() }>($own, $flat, $position)
    };
}
pub(crate) use description;

/// Defines `child` and `child_mut` of a struct, given the field of each key. All other keys are
/// looked up in the field after the semicolon, if there is one.
macro_rules! children {
    ($($key:pat => $field:ident),+ $(; $flat:ident: $flat_type:ty)?) => {
        fn child(&self, key: &str) -> Option<&dyn $crate::value::KeyNode> {
            match key {
                $($key => Some(&self.$field),)+
                _ => None$(.or(self.$flat.child(key)))?,
            }
        }

        fn child_mut(&mut self, key: &str) -> Option<&mut dyn $crate::value::KeyNode> {
            match key {
                $($key => Some(&mut self.$field),)+
                _ => None$(.or(self.$flat.child_mut(key)))?,
            }
        }

        $(
            fn make_child(&mut self, key: &str) -> Option<&mut dyn $crate::value::KeyNode> {
                match <$flat_type>::FIELDS.iter().any(|field| field.name == key) {
                    true => self.$flat.make_child(key),
                    false => self.child_mut(key),
                }
            }
        )?
    };
}
pub(crate) use children;
