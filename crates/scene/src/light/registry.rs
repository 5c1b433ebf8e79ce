//! Table of light kinds. A new kind needs a file of its own, its `mod` and one line in this table.

use crate::light::{
    Directional, DiskLight, Environment, LightForm, Point, RectangleLight, SphereLight, Spot,
};
use crate::value::{
    Description, Field, FieldValue, ValidationError, ValueType, doc_text, one_of, round_nice,
    round_significant,
};
use glam::DVec3;

/// Description of one kind of light, with the keys that users write in scene files.
pub trait LightDesc: Description {
    /// Converts the description, which must be valid, to its canonical form.
    fn form(&self) -> LightForm<'_>;

    /// Returns the validation errors of the description.
    fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }

    /// Returns the values that edits of position and direction change.
    fn handles(&mut self) -> Handles<'_>;

    /// Creates a light with those values of `placement` for which the kind has keys.
    fn placed(placement: &Placement) -> Self;
}

/// Values of a light that determine its position and direction.
#[derive(Debug, Default)]
pub struct Handles<'a> {
    /// Position of the light, or centre of its surface.
    pub position: Option<&'a mut [f64; 3]>,
    /// Direction in which the light travels, axis of its cone, or normal of its surface.
    pub direction: Option<&'a mut [f64; 3]>,
    pub up: Option<&'a mut [f64; 3]>,
}

/// Position, direction and size of a light that is created.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Position of the light, or centre of its surface.
    pub position: [f64; 3],
    /// Direction in which the light travels.
    pub direction: [f64; 3],
    /// Radius of the surface, or half of the side of a square.
    pub radius: f64,
}

macro_rules! kinds {
    ($($(#[doc = $doc:literal])+ $key:literal => $variant:ident($kind:ident),)+) => {
        #[derive(Clone, Debug, PartialEq)]
        pub enum LightKind {
            $($(#[doc = $doc])+ $variant($kind),)+
        }

        one_of! {
            LightKind { $($key => $variant),+ }
        }

        $(
            impl From<$kind> for LightKind {
                fn from(kind: $kind) -> Self {
                    Self::$variant(kind)
                }
            }
        )+

        pub const KIND_KEYS: &[&str] = &[$($key),+];

        impl LightKind {
            /// Every kind of light, with its key, its fields and its help text. A light has exactly
            /// one of these keys.
            pub const FIELDS: &[Field] = &[$(
                Field::required(
                    $key,
                    ValueType::Table($kind::FIELDS),
                    "",
                    doc_text(concat!($($doc),+)),
                )
                .or("another kind is needed"),
            )+];

            /// Creates a light of the kind `key`, see [`LightDesc::placed`]. Returns `None` if there
            /// is no such kind.
            pub fn placed(key: &str, placement: &Placement) -> Option<Self> {
                match key {
                    $($key => Some(Self::$variant($kind::placed(placement))),)+
                    _ => None,
                }
            }

            pub fn form(&self) -> LightForm<'_> {
                match self {
                    $(Self::$variant(kind) => kind.form(),)+
                }
            }

            /// Returns the validation errors; each key begins with the kind.
            fn faults(&self) -> Vec<ValidationError> {
                let faults = match self {
                    $(Self::$variant(kind) => kind.faults(),)+
                };
                faults.into_iter().map(|fault| fault.prefixed(self.key())).collect()
            }

            /// Returns the values that edits of position and direction change.
            pub fn handles(&mut self) -> Handles<'_> {
                match self {
                    $(Self::$variant(kind) => kind.handles(),)+
                }
            }
        }
    };
}

kinds! {
    /// Light from one point, such as a lamp.
    "point" => Point(Point),
    /// Light from infinitely far away, such as the sun.
    "directional" => Directional(Directional),
    /// Light from one point into a cone, such as a spotlight.
    "spot" => Spot(Spot),
    /// Light from a sphere, such as a bulb: soft shadows.
    "sphere" => Sphere(SphereLight),
    /// Light from one side of a rectangle, such as a window.
    "rectangle" => Rectangle(RectangleLight),
    /// Light from one side of a disk.
    "disk" => Disk(DiskLight),
    /// Light from all directions, such as the sky.
    "environment" => Environment(Environment),
}

impl FieldValue for LightKind {
    const TYPE: ValueType = ValueType::OneOf(Self::FIELDS);

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.faults().into_iter().map(|error| error.prefixed(field.name)).collect()
    }
}

/// Returns `center`, rounded to multiples of a power of ten that is at most 1e-4 x `radius`, and
/// `radius`, rounded to two significant digits.
pub(super) fn rounded_ball(placement: &Placement) -> ([f64; 3], f64) {
    let Placement { position, radius, .. } = *placement;
    let center = DVec3::from(position).map(|x| round_nice(x, radius)).to_array();
    (center, round_significant(radius, 2))
}
