//! Cylinder: the points within `radius` of the axis between two points, with flat ends.

use crate::shape::ShapeDesc;
use crate::shape::axial::{axis_faults, by_axis, frustum_between};
use crate::value::{KeyNode, ValidationError, description};
use zerkalo_kernel::primitive::Form;

description! {
    /// A circular cylinder with flat ends.
    pub struct Cylinder {
        /// Centre of one end.
        base: [f64; 3], in COORDINATE "scene units";
        /// Centre of the other end.
        top: [f64; 3], in COORDINATE "scene units";
        /// Radius of the cylinder.
        radius: f64, in SIZE "scene units";
        example "shape.cylinder = { base = [0.0, 0.0, 0.0], top = [0.0, 1.0, 0.0], radius = 0.4 }";
    }
}

impl ShapeDesc for Cylinder {
    fn form(&self) -> Form {
        frustum_between(self.base, self.top, self.radius, self.radius)
    }

    fn faults(&self) -> Vec<ValidationError> {
        let sizes = vec![("radius", self.radius)];
        axis_faults(self.validator(), [self.base, self.top], "top", sizes)
    }

    by_axis!(base, top, radius);
}
