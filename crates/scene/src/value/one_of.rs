//! Macro that declares values of one of several kinds: [`one_of!`].

/// Declares an enum whose variants have one value each. In scene files such an enum is a table with
/// one key, the name of the variant. Each variant has its help text, key, range and unit, written as
/// in `description!`:
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
///
/// The short form implements only the access by key, for an enum whose variants are tables.
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
        #[derive(Clone, Debug, PartialEq)]
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
    ($name:ident { $first:literal => $default:ident $(, $key:literal => $variant:ident)* $(,)? }) => {
        impl Default for $name {
            fn default() -> Self {
                Self::$default(Default::default())
            }
        }

        impl $name {
            /// Returns the key of the variant.
            pub fn key(&self) -> &'static str {
                match self {
                    Self::$default(_) => $first,
                    $(Self::$variant(_) => $key,)*
                }
            }

            fn node(&self) -> &dyn $crate::value::KeyNode {
                match self {
                    Self::$default(value) => value,
                    $(Self::$variant(value) => value,)*
                }
            }

            fn node_mut(&mut self) -> &mut dyn $crate::value::KeyNode {
                match self {
                    Self::$default(value) => value,
                    $(Self::$variant(value) => value,)*
                }
            }
        }

        impl $crate::value::KeyNode for $name {
            fn value(&self) -> Option<$crate::value::KeyValue> {
                Some($crate::value::KeyValue::Text(self.key().to_string()))
            }

            fn child(&self, key: &str) -> Option<&dyn $crate::value::KeyNode> {
                (self.key() == key).then(|| self.node())
            }

            fn child_mut(&mut self, key: &str) -> Option<&mut dyn $crate::value::KeyNode> {
                (self.key() == key).then(|| self.node_mut())
            }

            fn make_child(&mut self, key: &str) -> Option<&mut dyn $crate::value::KeyNode> {
                if self.key() != key {
                    *self = match key {
                        $first => Self::$default(Default::default()),
                        $($key => Self::$variant(Default::default()),)*
                        _ => return None,
                    };
                }
                Some(self.node_mut())
            }
        }
    };
}
pub(crate) use one_of;
