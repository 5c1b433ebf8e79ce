//! Torus: the points at distance `tube` from the circle of radius `ring` about `axis`.

use crate::shape::ShapeDesc;
use crate::shape::texture_space::around_axis;
use crate::value::{KeyNode, ValidationError, description, rotated_y, round_nice, unit};
use glam::{DAffine3, DMat3, DVec3};
use zerkalo_kernel::primitive::{Form, TorusForm};

description! {
    /// A torus: a tube along a circle about `axis`.
    pub struct Torus {
        /// Centre of the ring.
        center: [f64; 3], in COORDINATE "scene units";
        /// Direction of the axis, which is perpendicular to the plane of the ring.
        axis: [f64; 3], as Direction;
        /// Radius of the circle in the middle of the tube.
        ring: f64, in SIZE "scene units";
        /// Radius of the tube, at most `ring`.
        tube: f64, in SIZE "scene units";
        example "shape.torus = { center = [0.0, 0.25, 0.0], axis = [0.0, 1.0, 0.0], ring = 1.0, \
            tube = 0.25 }";
    }
}

impl ShapeDesc for Torus {
    fn form(&self) -> Form {
        let scene_from_torus =
            DAffine3::from_mat3_translation(self.texture_axes(), self.center.into());
        TorusForm { scene_from_torus, ring: self.ring, tube: self.tube }.into()
    }

    /// Returns the validation errors. A spindle torus would intersect itself.
    fn faults(&self) -> Vec<ValidationError> {
        let spindle = (self.ring > 0.0 && self.tube > self.ring).then(|| {
            let found = format!("tube ({}) is larger than ring ({})", self.tube, self.ring);
            ValidationError::new("tube", found, "a tube at most as large as ring")
        });
        self.validator().and(spindle).lengths(self).errors()
    }

    /// Creates a flat torus whose tube is at most a third of its ring.
    fn fit(&mut self, base: DVec3, size: DVec3) {
        let across = size.x.min(size.z);
        let tube = round_nice((across / 8.0).min(size.y / 2.0), across);
        let ring = round_nice(3.0 * across / 8.0, across);
        let center = [base.x, base.y + tube, base.z];
        *self = Self { center, axis: [0.0, 1.0, 0.0], ring, tube };
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }

    fn rotate_y(&mut self, degrees: f64) -> bool {
        self.axis = rotated_y(self.axis, degrees);
        true
    }

    fn texture_axes(&self) -> DMat3 {
        around_axis(unit(self.axis).unwrap_or(DVec3::Y))
    }
}
