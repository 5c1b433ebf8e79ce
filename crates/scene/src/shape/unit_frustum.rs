//! Canonical tapered cylinder, with radius 1 at z = 0 and radius s at z = 1:
//!   x^2 + y^2 <= (1 + (s - 1) z)^2, 0 <= z <= 1

use crate::shape::texture_space::around_axis;
use crate::shape::{ShapeDesc, TransformOp};
use crate::value::description;
use glam::{DAffine3, DMat3, DVec3};
use zerkalo_kernel::primitive::Form;

description! {
    /// The canonical tapered cylinder, to be placed by `transform`: its axis runs from the origin
    /// to z = 1; its radius is 1 at z = 0 and `s` at z = 1.
    pub struct UnitFrustum {
        /// Radius at z = 1: 0 makes a cone, 1 a cylinder, more than 1 widens.
        s: f64, in closed(0.0, 1e6);
        example "shape.unit_frustum = { s = 0.5 }";
    }
}

impl ShapeDesc for UnitFrustum {
    fn form(&self) -> Form {
        Form::conical_frustum(DAffine3::IDENTITY, self.s)
    }

    /// Becomes a cylinder, which only a transform moves.
    fn fit(&mut self, _: DVec3, _: DVec3) {
        self.s = 1.0;
    }

    fn upright(&self) -> Option<TransformOp> {
        Some(TransformOp::RotateX(-90.0))
    }

    fn texture_axes(&self) -> DMat3 {
        around_axis(DVec3::Z)
    }
}
