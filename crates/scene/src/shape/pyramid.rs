//! Regular pyramid with a square base, whole or truncated.

use crate::shape::ShapeDesc;
use crate::shape::cube::square;
use crate::shape::prismoid::{by_corner_and_rotation, corner_of_centered, prismoid};
use crate::value::description;
use glam::DVec3;
use zerkalo_kernel::primitive::Form;

description! {
    /// A regular pyramid on a square base, truncated at `height`. If `apex_height` is not larger
    /// than `height`, it is an ordinary pyramid whose height is the smaller of the two.
    pub struct Pyramid {
        /// Lower left near corner of the base, before the rotation (near is +z).
        corner: [f64; 3], in COORDINATE "scene units";
        /// Length of a side of the base.
        side: f64, in SIZE "scene units";
        /// Height of the untruncated pyramid.
        apex_height: f64, in SIZE "scene units";
        /// Height of the truncated pyramid.
        height: f64, in SIZE "scene units";
        /// Rotation about the vertical through the base's centre, counter-clockwise seen from
        /// above.
        rotation: f64 = 0.0, in FINITE "degrees";
        example "shape.pyramid = { corner = [-0.5, 0.0, 0.5], side = 1.0, apex_height = 1.5, \
            height = 0.8 }";
    }
}

impl ShapeDesc for Pyramid {
    fn form(&self) -> Form {
        let height = self.height.min(self.apex_height);
        let top_over_base = (self.apex_height - height) / self.apex_height;
        let corner = DVec3::from_array(self.corner);
        prismoid(corner, &square(self.side), height, top_over_base, self.rotation)
    }

    fn fit(&mut self, base: DVec3, size: DVec3) {
        let side = size.x.min(size.z);
        let corner = corner_of_centered(base, side, side);
        *self = Self { corner, side, apex_height: size.y, height: size.y, rotation: 0.0 };
    }

    by_corner_and_rotation!();
}
