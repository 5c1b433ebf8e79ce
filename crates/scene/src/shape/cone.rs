//! Right circular cone between the centre of its flat base and its apex.

use crate::shape::ShapeDesc;
use crate::shape::axial::{axis_faults, by_axis, frustum_between};
use crate::value::{KeyNode, ValidationError, description};
use zerkalo_kernel::primitive::Form;

description! {
    /// A right circular cone with a flat base.
    pub struct Cone {
        /// Centre of the base.
        base: [f64; 3], in COORDINATE "scene units";
        /// Apex of the cone.
        apex: [f64; 3], in COORDINATE "scene units";
        /// Radius of the base.
        radius: f64, in SIZE "scene units";
        example "shape.cone = { base = [0.0, 0.0, 0.0], apex = [0.0, 1.0, 0.0], radius = 0.5 }";
    }
}

impl ShapeDesc for Cone {
    fn form(&self) -> Form {
        frustum_between(self.base, self.apex, self.radius, 0.0)
    }

    fn faults(&self) -> Vec<ValidationError> {
        let sizes = vec![("radius", self.radius)];
        axis_faults(self.validator(), [self.base, self.apex], "apex", sizes)
    }

    by_axis!(base, apex, radius);
}
