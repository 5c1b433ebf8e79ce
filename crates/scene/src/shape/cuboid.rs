//! Box with sides parallel to the axes, described by centre and size, so that one key moves it.

use crate::shape::ShapeDesc;
use crate::shape::prismoid::prismoid;
use crate::value::description;
use glam::{DVec2, DVec3};
use zerkalo_kernel::primitive::Form;

description! {
    /// A box with sides parallel to the axes; an object's `transform` can rotate it.
    pub struct Cuboid {
        /// Centre of the box.
        center: [f64; 3], in COORDINATE "scene units";
        /// Lengths of the box along x, y and z.
        size: [f64; 3], in SIZE "scene units";
        example "shape.box = { center = [0.0, 0.5, 0.0], size = [2.0, 1.0, 0.5] }";
    }
}

impl ShapeDesc for Cuboid {
    fn form(&self) -> Form {
        let [x, y, z] = self.size;
        let corner = DVec3::from_array(self.center) + DVec3::new(-x, -y, z) / 2.0;
        let base = [(0.0, 0.0), (x, 0.0), (x, -z), (0.0, -z)].map(DVec2::from);
        prismoid(corner, &base, y, 1.0, 0.0)
    }

    fn fit(&mut self, base: DVec3, size: DVec3) {
        *self = Self { center: [base.x, base.y + size.y / 2.0, base.z], size: size.to_array() };
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }
}
