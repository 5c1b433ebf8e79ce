//! Tapered cylinder: its radius changes linearly along the axis between two points.

use crate::shape::ShapeDesc;
use crate::shape::axial::{axis_faults, by_axis, frustum_between};
use crate::value::{KeyNode, NumberRange, ValidationError, description};
use glam::DVec3;
use zerkalo_kernel::primitive::Form;

description! {
    /// A circular cylinder that narrows or widens linearly, with flat ends: a cone cut off.
    pub struct TaperedCylinder {
        /// Centre of one end.
        base: [f64; 3], in COORDINATE "scene units";
        /// Centre of the other end.
        top: [f64; 3], in COORDINATE "scene units";
        /// Radius of the end at `base`; 0 makes an apex.
        base_radius: f64, in closed(0.0, NumberRange::SIZE.high) "scene units";
        /// Radius of the end at `top`; 0 makes an apex.
        top_radius: f64, in closed(0.0, NumberRange::SIZE.high) "scene units";
        example "shape.tapered_cylinder = { base = [0.0, 0.0, 0.0], top = [0.0, 1.0, 0.0], \
            base_radius = 0.5, top_radius = 0.3 }";
    }
}

impl ShapeDesc for TaperedCylinder {
    fn form(&self) -> Form {
        frustum_between(self.base, self.top, self.base_radius, self.top_radius)
    }

    fn faults(&self) -> Vec<ValidationError> {
        let radii = [("base_radius", self.base_radius), ("top_radius", self.top_radius)];
        let sizes: Vec<_> = radii.into_iter().filter(|(_, r)| *r != 0.0).collect();
        let both_zero = sizes.is_empty().then(|| {
            ValidationError::new(
                "top_radius",
                "both radii are 0",
                "a radius greater than 0 at one end at least",
            )
        });
        axis_faults(self.validator().and(both_zero), [self.base, self.top], "top", sizes)
    }

    fn fit(&mut self, base: DVec3, size: DVec3) {
        let top = base + DVec3::Y * size.y;
        let radius = size.x.min(size.z) / 2.0;
        *self = Self {
            base: base.to_array(),
            top: top.to_array(),
            base_radius: radius,
            top_radius: 0.6 * radius,
        };
    }

    by_axis!(base, top);
}
