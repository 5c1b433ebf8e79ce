//! Table of shape kinds. A new kind needs a file of its own and one line in this table.

use crate::shape::{
    Cone, CsgOperand, Cube, Cuboid, Cylinder, Difference, HorizontalRectangle, Intersection,
    MeshDesc, Plane, Prism, Pyramid,
};
use crate::shape::{Rectangle, Sphere, TaperedCylinder, Torus, TransformOp, Union, UnitFrustum};
use crate::value::{
    Description, Field, FieldValue, KeyNode, ValidationError, ValueType, one_of, rounded_to,
};
use glam::{DMat3, DVec3};
use std::ops::{Deref, DerefMut};
use zerkalo_kernel::primitive::Form;

/// Description of one kind of shape, with the keys that users write in scene files.
pub trait ShapeDesc: KeyNode {
    /// Converts the valid description to its canonical form.
    fn form(&self) -> Form;

    /// Returns the validation errors of the description.
    fn faults(&self) -> Vec<ValidationError> {
        self.validator().lengths(self).errors()
    }

    /// Creates an upright instance that roughly fills a box. `base` is the centre of its lower
    /// side.
    fn fitted_to(base: DVec3, size: DVec3) -> Self
    where
        Self: Sized;

    /// Returns the points that move the shape if a vector is added to all of them; empty if only a
    /// transform can.
    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        Vec::new()
    }

    /// Rotates the shape by `degrees` about the vertical through its centre, counter-clockwise seen
    /// from above. Returns `false`, without a change, if its keys cannot express that.
    fn rotate_y(&mut self, _degrees: f64) -> bool {
        false
    }

    /// Returns the rotation about the vertical \[degrees\], as far as the keys of the kind express it.
    fn rotation(&self) -> f64 {
        0.0
    }

    /// Returns the step that makes the kind stand upright, if its axis is not y.
    fn upright(&self) -> Option<TransformOp> {
        None
    }

    /// Returns the parts of a compound; `None` for any other kind.
    fn parts(&self) -> Option<&[CsgOperand]> {
        None
    }

    /// Returns the parts of a compound; empty for any other kind.
    fn parts_mut(&mut self) -> &mut [CsgOperand] {
        &mut []
    }

    /// Returns the axes of the [`TextureSpace`](crate::shape::TextureSpace): right-handed,
    /// orthonormal columns.
    fn texture_axes(&self) -> DMat3 {
        DMat3::IDENTITY
    }
}

/// Returns `rotation + degrees`, above -180 and at most 180, rounded to a millionth.
pub(crate) fn wrapped_angle(rotation: f64, degrees: f64) -> f64 {
    let angle = rounded_to((rotation + degrees).rem_euclid(360.0), -6);
    if angle > 180.0 { rounded_to(angle - 360.0, -6) } else { angle }
}

macro_rules! kinds {
    ($($key:literal => $kind:ident),+ $(,)?) => {
        /// Shape of an object. In scene files it is a table with one key, the kind.
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

        // A static, because the table refers to itself through the parts of compounds.
        static KIND_TABLE: [Field; [$($key),+].len()] = [
            $(Field::required($key, ValueType::Table($kind::FIELDS), "", $kind::DOC),)+
        ];

        /// Every kind of shape, with its key, its fields and its help text.
        pub const KINDS: &[Field] = &KIND_TABLE;

        /// Key and example of every kind of shape, in the order of [`KINDS`].
        pub const EXAMPLES: &[(&str, &str)] = &[$(($key, $kind::EXAMPLE)),+];

        impl Shape {
            /// Creates a shape by [`ShapeDesc::fitted_to`]; `None` if there is no such kind.
            pub fn fitted_to(key: &str, base: DVec3, size: DVec3) -> Option<Self> {
                match key {
                    $($key => Some(Self::$kind($kind::fitted_to(base, size))),)+
                    _ => None,
                }
            }
        }

        impl Deref for Shape {
            type Target = dyn ShapeDesc;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$kind(kind) => kind,)+
                }
            }
        }

        impl DerefMut for Shape {
            fn deref_mut(&mut self) -> &mut Self::Target {
                match self {
                    $(Self::$kind(kind) => kind,)+
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
    "union" => Union,
    "intersection" => Intersection,
    "difference" => Difference,
}

impl FieldValue for Shape {
    const TYPE: ValueType = ValueType::OneOf(KINDS);

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        self.faults().into_iter().map(|error| error.prefixed(field.name)).collect()
    }
}

impl Shape {
    /// Returns the validation errors; each key begins with the kind.
    pub fn faults(&self) -> Vec<ValidationError> {
        (**self).faults().into_iter().map(|fault| fault.prefixed(self.key())).collect()
    }

    /// Returns the first anchor point, or the origin.
    pub fn position(&self) -> DVec3 {
        self.clone()
            .anchor_points_mut()
            .first()
            .map_or(DVec3::ZERO, |point| DVec3::from_array(**point))
    }
}
