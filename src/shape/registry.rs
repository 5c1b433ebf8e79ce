//! The table of kinds. A new kind of shape is one file and one line here.

use crate::primitive::Form;
use crate::shape::csg::OF_FIELDS;
use crate::shape::{
    Cone, Cube, Cuboid, Cylinder, Difference, HorizontalRectangle, Intersection, MeshDesc, Plane,
    Prism, Pyramid,
};
use crate::shape::{Rectangle, Sphere, TaperedCylinder, Torus, Union, UnitFrustum};
use crate::value::{Field, ValidationError, ValueType, rounded_to};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// What every kind's description says of itself.
pub trait ShapeDesc {
    /// What it is, in a sentence or two.
    const DOC: &'static str;
    /// A line for a scene file.
    const EXAMPLE: &'static str;
    /// Its keys.
    const FIELDS: &'static [Field];

    /// The geometry, in double precision. Of a description without faults.
    fn form(&self) -> Form;

    /// What is wrong with it.
    fn faults(&self) -> Vec<ValidationError>;

    /// One of this kind that stands upright on `base`, the middle of its lower side, and fills about
    /// a box with the lengths `size` along x, y and z, all greater than 0.
    fn fitted_to(base: DVec3, size: DVec3) -> Self;

    /// The points that move it: adding a vector to all of them moves the whole shape by that vector.
    /// Empty: only a transform moves it.
    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]>;

    /// Turns it by `degrees` about the vertical through its middle, counter-clockwise seen from
    /// above. `false`: it has no key for that, and nothing was done.
    fn rotate_y(&mut self, degrees: f64) -> bool;

    /// The axes of the space in which textures lie on it ([`TextureSpace`](crate::shape::TextureSpace)), in its
    /// own: right-handed, of unit length.
    fn texture_axes(&self) -> DMat3 {
        DMat3::IDENTITY
    }
}

/// The angle `rotation + degrees` as it is written in a file: above -180, at most 180.
pub(super) fn turned_rotation(rotation: f64, degrees: f64) -> f64 {
    let rotate_y = rounded_to((rotation + degrees).rem_euclid(360.0), -6);
    if rotate_y > 180.0 { rounded_to(rotate_y - 360.0, -6) } else { rotate_y }
}

/// The keys of a kind; those of compounds by the name of their static, since a constant could not
/// take part in a table that refers to itself.
macro_rules! keys {
    ($kind:ident) => {
        $kind::FIELDS
    };
    ($kind:ident $fields:path) => {
        &$fields
    };
}

macro_rules! kinds {
    ($($key:literal => $kind:ident $(with $fields:path)?),+ $(,)?) => {
        /// What an object looks like: one kind with its parameters. In files a table with one key.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub enum Shape {
            $(
                #[doc = concat!("`shape.", $key, "`")]
                #[serde(rename = $key)]
                $kind($kind),
            )+
        }

        // A static, since the parts of compounds have shapes, too: the table refers to itself.
        pub(super) static KIND_TABLE: [Field; [$($key),+].len()] = [
            $(Field::required($key, ValueType::Table(keys!($kind $($fields)?)), "", $kind::DOC),)+
        ];

        /// Every kind: its key, its fields, what it is.
        pub const KINDS: &[Field] = &KIND_TABLE;

        /// Every kind's key with an example as it stands in an `[[object]]`.
        pub const EXAMPLES: &[(&str, &str)] = &[$(($key, $kind::EXAMPLE),)+];

        impl Shape {
            /// The key of its kind.
            pub fn key(&self) -> &'static str {
                match self {
                    $(Self::$kind(_) => $key,)+
                }
            }

            /// The geometry, in double precision, before the object's transform. Only of a shape
            /// without faults.
            pub fn form(&self) -> Form {
                match self {
                    $(Self::$kind(kind) => kind.form(),)+
                }
            }

            /// What is wrong with it; keys begin with the kind's.
            pub fn faults(&self) -> Vec<ValidationError> {
                let faults = match self {
                    $(Self::$kind(kind) => kind.faults(),)+
                };
                faults.into_iter().map(|f| f.prefixed(self.key())).collect()
            }

            /// The axes of the space in which textures lie on it, in its own.
            pub(super) fn texture_axes(&self) -> DMat3 {
                match self {
                    $(Self::$kind(kind) => kind.texture_axes(),)+
                }
            }

            /// The kind with this key as [`ShapeDesc::fitted_to`] makes it; `None`: no kind has it.
            pub fn fitted_to(key: &str, base: DVec3, size: DVec3) -> Option<Self> {
                match key {
                    $($key => Some(Self::$kind($kind::fitted_to(base, size))),)+
                    _ => None,
                }
            }

            /// The points that move it: adding a vector to all of them moves the whole shape by that
            /// vector. Empty: only a transform moves it.
            pub fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
                match self {
                    $(Self::$kind(kind) => kind.anchor_points_mut(),)+
                }
            }

            /// Turns it by `degrees` about the vertical through its middle, counter-clockwise seen
            /// from above. `false`: its kind has no key for that, and nothing was done.
            pub fn rotate_y(&mut self, degrees: f64) -> bool {
                match self {
                    $(Self::$kind(kind) => kind.rotate_y(degrees),)+
                }
            }
        }
    };
}

kinds! {
    "sphere" => Sphere,
    "cube" => Cube,
    "box" => Cuboid,
    "pyramid" => Pyramid,
    "prism" => Prism,
    "cylinder" => Cylinder,
    "cone" => Cone,
    "tapered_cylinder" => TaperedCylinder,
    "unit_cylinder" => UnitFrustum,
    "torus" => Torus,
    "platform" => HorizontalRectangle,
    "rectangle" => Rectangle,
    "plane" => Plane,
    "mesh" => MeshDesc,
    "union" => Union with OF_FIELDS,
    "intersection" => Intersection with OF_FIELDS,
    "difference" => Difference with OF_FIELDS,
}

impl Shape {
    /// The first of the points that move it; the origin if there is none.
    pub fn position(&self) -> DVec3 {
        self.clone().anchor_points_mut().first().map_or(DVec3::ZERO, |at| DVec3::from_array(**at))
    }
}
