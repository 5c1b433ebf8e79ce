//! Macros for values of one of several kinds: [`one_of!`] for single values, [`kinds!`] for tables.

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
/// The short form, without types, implements only the access by key; [`kinds!`] uses it.
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

            /// Returns the validation errors of the value. Their keys begin with the variant's key.
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

/// Declares an enum whose variants are descriptions, each with its key in scene files. The enum
/// dereferences to the trait after the colon, which all the descriptions implement and which has
/// the method `faults`. The help text of a key is that of its description.
///
/// ```ignore
/// kinds! {
///     /// Shape of an object.
///     pub enum Shape: ShapeDesc {
///         "sphere" => Sphere(Sphere),
///         "box" => Cuboid(Cuboid),
///     }
/// }
/// ```
macro_rules! kinds {
    (
        $(#[$attribute:meta])+
        pub enum $name:ident: $description:ident {
            $($key:literal => $variant:ident($kind:ident),)+
        }
    ) => {
        $(#[$attribute])+
        #[derive(Clone, Debug, PartialEq)]
        pub enum $name {
            $(
                #[doc = concat!("`", $key, "`")]
                $variant($kind),
            )+
        }

        $crate::value::one_of! {
            $name { $($key => $variant),+ }
        }

        // A static, because the table may refer to itself through the parts of compounds.
        static KIND_TABLE: [$crate::value::Field; [$($key),+].len()] = [$(
            $crate::value::Field::required(
                $key,
                <$kind as $crate::value::FieldValue>::TYPE,
                "",
                <$kind as $crate::value::Description>::DOC,
            )
            .or("another kind is needed"),
        )+];

        impl $name {
            /// Every kind, with its key, its fields and its help text; exactly one is given.
            pub const FIELDS: &[$crate::value::Field] = &KIND_TABLE;

            /// Keys of all kinds.
            pub const KEYS: &[&str] = &[$($key),+];

            /// Key and example of every kind, in the order of [`Self::FIELDS`].
            pub const EXAMPLES: &[(&str, &str)] =
                &[$(($key, <$kind as $crate::value::Description>::EXAMPLE)),+];

            /// Creates the default value of the kind `key`; `None` if there is no such kind.
            pub(crate) fn of_kind(key: &str) -> Option<Self> {
                let mut value = Self::default();
                $crate::value::KeyNode::make_child(&mut value, key)?;
                Some(value)
            }

            /// Returns the validation errors; each key begins with the kind.
            pub fn faults(&self) -> Vec<$crate::value::ValidationError> {
                (**self).faults().into_iter().map(|error| error.prefixed(self.key())).collect()
            }
        }

        $(
            impl From<$kind> for $name {
                fn from(kind: $kind) -> Self {
                    Self::$variant(kind)
                }
            }
        )+

        impl $crate::value::FieldValue for $name {
            const TYPE: $crate::value::ValueType = $crate::value::ValueType::OneOf(Self::FIELDS);

            fn errors(&self, field: &$crate::value::Field) -> Vec<$crate::value::ValidationError> {
                self.faults().into_iter().map(|error| error.prefixed(field.name)).collect()
            }
        }

        impl std::ops::Deref for $name {
            type Target = dyn $description;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$variant(kind) => kind,)+
                }
            }
        }

        impl std::ops::DerefMut for $name {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self {
                    $(Self::$variant(kind) => kind,)+
                }
            }
        }
    };
}
pub(crate) use kinds;
