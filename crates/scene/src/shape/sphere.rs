//! Sphere: the points at distance `radius` from `center`.

use crate::shape::ShapeDesc;
use crate::value::{description, round_nice};
use glam::DVec3;
use zerkalo_kernel::primitive::{Form, SphereForm};

description! {
    /// A sphere.
    pub struct Sphere {
        /// Centre of the sphere.
        center: [f64; 3], in COORDINATE "scene units";
        /// Radius of the sphere.
        radius: f64, in SIZE "scene units";
        example "shape.sphere = { center = [0.0, 1.0, 0.0], radius = 1.0 }";
    }
}

impl ShapeDesc for Sphere {
    fn form(&self) -> Form {
        Form::Sphere(SphereForm { center: DVec3::from_array(self.center), radius: self.radius })
    }

    fn fit(&mut self, base: DVec3, size: DVec3) {
        let radius = round_nice(size.min_element() / 2.0, size.min_element());
        *self = Self { center: [base.x, base.y + radius, base.z], radius };
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }

    /// Returns `true` without a change: a sphere is symmetric about the vertical.
    fn rotate_y(&mut self, _: f64) -> bool {
        true
    }
}
