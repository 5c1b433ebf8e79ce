//! Table of shape kinds. CONTRIBUTING.md lists what a new kind needs.

use crate::shape::{
    Cone, CsgOperand, Cube, Cuboid, Cylinder, Difference, HorizontalRectangle, Intersection,
    MeshDesc, Plane, Prism, Pyramid, Rectangle, Sphere, TaperedCylinder, Torus, TransformOp, Union,
    UnitFrustum,
};
use crate::value::{Field, KeyNode, ValidationError, kinds, rounded_to};
use glam::{DMat3, DVec3};
use zerkalo_kernel::primitive::Form;

/// Description of one kind of shape, with the keys that users write in scene files.
pub trait ShapeDesc: KeyNode {
    /// Converts the valid description to its canonical form.
    fn form(&self) -> Form;

    /// Returns the validation errors of the description.
    fn faults(&self) -> Vec<ValidationError> {
        self.validator().lengths(self).errors()
    }

    /// Makes the shape upright, so that it roughly fills a box of the given size. `base` is the
    /// centre of the box's lower side.
    fn fit(&mut self, _base: DVec3, _size: DVec3) {}

    /// Returns the points that move the shape if a vector is added to all of them; empty if only a
    /// transform can move it.
    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        Vec::new()
    }

    /// Rotates the shape by `degrees` about the vertical through its centre, counter-clockwise seen
    /// from above. Returns `true` if it is rotated; `false`, without a change, if its keys cannot
    /// express the rotation.
    fn rotate_y(&mut self, _degrees: f64) -> bool {
        false
    }

    /// Returns the rotation about the vertical \[degrees\], as far as the keys of the kind express it.
    fn rotation(&self) -> f64 {
        0.0
    }

    /// Returns the step that makes the kind stand upright; `None` if it does so without a step.
    fn upright(&self) -> Option<TransformOp> {
        None
    }

    /// Returns the parts of a compound; `None` for any other kind.
    fn parts(&self) -> Option<&[CsgOperand]> {
        None
    }

    /// Returns [`ShapeDesc::parts`] as a mutable reference.
    fn parts_mut(&mut self) -> Option<&mut Vec<CsgOperand>> {
        None
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

kinds! {
    /// Shape of an object. In scene files it is a table with one key, the kind.
    pub enum Shape: ShapeDesc {
        "sphere" => Sphere(Sphere),
        "cube" => Cube(Cube),
        "box" => Cuboid(Cuboid),
        "pyramid" => Pyramid(Pyramid),
        "prism" => Prism(Prism),
        "cylinder" => Cylinder(Cylinder),
        "cone" => Cone(Cone),
        "tapered_cylinder" => TaperedCylinder(TaperedCylinder),
        "unit_frustum" => UnitFrustum(UnitFrustum),
        "torus" => Torus(Torus),
        "platform" => HorizontalRectangle(HorizontalRectangle),
        "rectangle" => Rectangle(Rectangle),
        "plane" => Plane(Plane),
        "mesh" => MeshDesc(MeshDesc),
        "union" => Union(Union),
        "intersection" => Intersection(Intersection),
        "difference" => Difference(Difference),
    }
}

/// Every kind of shape, with its key, its fields and its help text.
pub const KINDS: &[Field] = Shape::FIELDS;

/// Key and example of every kind of shape, in the order of [`KINDS`].
pub const EXAMPLES: &[(&str, &str)] = Shape::EXAMPLES;

impl Shape {
    /// Creates a shape of the kind `key` by [`ShapeDesc::fit`]; `None` if there is no such kind.
    pub fn fitted_to(key: &str, base: DVec3, size: DVec3) -> Option<Self> {
        let mut shape = Self::of_kind(key)?;
        shape.fit(base, size);
        Some(shape)
    }

    /// Returns the first anchor point, or the origin.
    pub fn position(&self) -> DVec3 {
        self.clone()
            .anchor_points_mut()
            .first()
            .map_or(DVec3::ZERO, |point| DVec3::from_array(**point))
    }
}
