//! Table of shape kinds. A new kind needs a file of its own and one line in this table.
//! Tests then demand an example of it, in `tests/common/shape_examples.rs`.

use crate::shape::csg::OF_FIELDS;
use crate::shape::{
    Cone, Cube, Cuboid, Cylinder, Difference, HorizontalRectangle, Intersection, MeshDesc, Plane,
    Prism, Pyramid,
};
use crate::shape::{Rectangle, Sphere, TaperedCylinder, Torus, Union, UnitFrustum};
use crate::value::{
    Description, Field, FieldValue, ValidationError, ValueType, one_of, rounded_to,
};
use glam::{DMat3, DVec3};
use zerkalo_kernel::primitive::Form;

/// Description of one kind of shape, with the keys that users write in scene files.
pub trait ShapeDesc: Description {
    /// Converts the description to its canonical form: the geometry as one of the kinds of
    /// primitives, in double precision. The description must be valid.
    fn form(&self) -> Form;

    /// Returns the validation errors of the description.
    fn faults(&self) -> Vec<ValidationError> {
        self.validator().errors()
    }

    /// Creates an upright instance that roughly fills a box. `base` is the centre of the box's
    /// lower side. `size` is its lengths along x, y and z, all greater than 0.
    fn fitted_to(base: DVec3, size: DVec3) -> Self;

    /// Returns the points that determine the shape's position: adding a vector to all of them moves
    /// the shape by that vector. Empty if only a transform can move the shape.
    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        Vec::new()
    }

    /// Rotates the shape by `degrees` about the vertical through its centre, counter-clockwise seen
    /// from above. Returns `false`, without a change, if the keys of the kind cannot express the
    /// rotation.
    fn rotate_y(&mut self, _degrees: f64) -> bool {
        false
    }

    /// Returns the axes of the [`TextureSpace`](crate::shape::TextureSpace) as the columns of a
    /// matrix. They are right-handed, orthonormal vectors in the shape's space.
    fn texture_axes(&self) -> DMat3 {
        DMat3::IDENTITY
    }
}

/// Returns the angle `rotation + degrees`, rounded to a millionth of a degree and reduced to more
/// than -180 and at most 180 degrees.
pub(super) fn turned_rotation(rotation: f64, degrees: f64) -> f64 {
    let angle = rounded_to((rotation + degrees).rem_euclid(360.0), -6);
    if angle > 180.0 { rounded_to(angle - 360.0, -6) } else { angle }
}

/// Expands to the keys of the shape kind `$kind`, for the table of kinds. The keys of a compound
/// are in the static `$fields`. These keys refer to the table of kinds, because the parts of a
/// compound can be of any kind. Such a cycle is possible between statics, but not between
/// constants.
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
        /// Shape of an object: one kind of shape with its parameters. In scene files it is a table
        /// with one key, the name of the kind.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Shape {
            $(
                #[doc = concat!("`shape.", $key, "`")]
                $kind($kind),
            )+
        }

        one_of! {
            Shape { $($key => $kind),+ }
        }

        // A static instead of a constant, because the table refers to itself through the keys of
        // compounds: their parts are shapes of any kind in this table.
        pub(super) static KIND_TABLE: [Field; [$($key),+].len()] = [
            $(Field::required($key, ValueType::Table(keys!($kind $($fields)?)), "", $kind::DOC),)+
        ];

        /// Every kind of shape, with its key, its fields and its help text.
        pub const KINDS: &[Field] = &KIND_TABLE;

        impl Shape {
            /// Returns the key of the shape's kind.
            pub fn key(&self) -> &'static str {
                match self {
                    $(Self::$kind(_) => $key,)+
                }
            }

            /// Converts the shape to its canonical form in double precision, without the object's
            /// transform. The shape must be valid.
            pub fn form(&self) -> Form {
                match self {
                    $(Self::$kind(kind) => kind.form(),)+
                }
            }

            /// Returns the validation errors of the shape. Each key begins with the key of the
            /// shape's kind.
            pub fn faults(&self) -> Vec<ValidationError> {
                let faults = match self {
                    $(Self::$kind(kind) => kind.faults(),)+
                };
                faults.into_iter().map(|f| f.prefixed(self.key())).collect()
            }

            /// Returns the axes of the shape's texture space, as the columns of a rotation matrix.
            pub(super) fn texture_axes(&self) -> DMat3 {
                match self {
                    $(Self::$kind(kind) => kind.texture_axes(),)+
                }
            }

            /// Creates a shape of the kind `key` that roughly fills a box, see
            /// [`ShapeDesc::fitted_to`]; `None` if there is no such kind.
            pub fn fitted_to(key: &str, base: DVec3, size: DVec3) -> Option<Self> {
                match key {
                    $($key => Some(Self::$kind($kind::fitted_to(base, size))),)+
                    _ => None,
                }
            }

            /// Returns the points that determine the shape's position: adding a vector to all of
            /// them moves the shape by that vector. Empty if only a transform can move the shape.
            pub fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
                match self {
                    $(Self::$kind(kind) => kind.anchor_points_mut(),)+
                }
            }

            /// Rotates the shape by `degrees` about the vertical through its centre,
            /// counter-clockwise seen from above. Returns `false`, without a change, if the keys of
            /// its kind cannot express the rotation.
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
    "unit_frustum" => UnitFrustum,
    "torus" => Torus,
    "platform" => HorizontalRectangle,
    "rectangle" => Rectangle,
    "plane" => Plane,
    "mesh" => MeshDesc,
    "union" => Union with OF_FIELDS,
    "intersection" => Intersection with OF_FIELDS,
    "difference" => Difference with OF_FIELDS,
}

impl FieldValue for Shape {
    const TYPE: ValueType = ValueType::OneOf(KINDS);

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.faults().into_iter().map(|error| error.prefixed(field.name)).collect()
    }
}

impl Shape {
    /// Returns the position of the shape: the first of its anchor points, or the origin if it has
    /// none. Moving all anchor points by a vector moves the shape by that vector.
    pub fn position(&self) -> DVec3 {
        self.clone()
            .anchor_points_mut()
            .first()
            .map_or(DVec3::ZERO, |point| DVec3::from_array(**point))
    }
}
