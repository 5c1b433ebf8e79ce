//! Shape `plane`: an infinite plane.

use crate::shape::ShapeDesc;
use crate::shape::texture_space::on_plane;
use crate::value::{description, rotated_y, unit};
use glam::{DMat3, DVec3};
use zerkalo_kernel::primitive::{Form, PlaneForm};

description! {
    /// An infinite plane. Its front is the side that `normal` points to.
    pub struct Plane {
        /// Any point of the plane.
        point: [f64; 3], in COORDINATE "scene units";
        /// Direction in which the front faces.
        normal: [f64; 3], as Direction;
        example "shape.plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }";
    }
}

impl ShapeDesc for Plane {
    fn form(&self) -> Form {
        let normal = unit(self.normal).unwrap_or(DVec3::Y);
        Form::Plane(PlaneForm { normal, offset: normal.dot(DVec3::from_array(self.point)) })
    }

    /// Creates the horizontal plane through `base`.
    fn fit(&mut self, base: DVec3, _: DVec3) {
        *self = Self { point: base.to_array(), normal: [0.0, 1.0, 0.0] };
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.point]
    }

    fn rotate_y(&mut self, degrees: f64) -> bool {
        self.normal = rotated_y(self.normal, degrees);
        true
    }

    fn texture_axes(&self) -> DMat3 {
        on_plane(unit(self.normal).unwrap_or(DVec3::Y))
    }
}
