//! Shape `prism`: a right prism over a regular triangle.

use crate::shape::ShapeDesc;
use crate::shape::prismoid::{by_corner_and_rotation, corner_of_centered, prismoid};
use crate::value::description;
use glam::{DVec2, DVec3};
use zerkalo_kernel::primitive::Form;

description! {
    /// A right prism on a base with three equal sides. Without a rotation, the base has an edge
    /// along +x from `corner` and its third vertex towards -z.
    pub struct Prism {
        /// Lower left near corner of the base, before the rotation (near is +z).
        corner: [f64; 3], in COORDINATE "scene units";
        /// Length of a side of the base.
        side: f64, in SIZE "scene units";
        /// Height of the prism.
        height: f64, in SIZE "scene units";
        /// Rotation about the vertical through the base's centroid, counter-clockwise seen from
        /// above.
        rotation: f64 = 0.0, in FINITE "degrees";
        example "shape.prism = { corner = [-0.5, 0.0, 0.3], side = 1.0, height = 1.2 }";
    }
}

impl ShapeDesc for Prism {
    fn form(&self) -> Form {
        let s = self.side;
        let base = [(0.0, 0.0), (s, 0.0), (s / 2.0, -s * 0.75f64.sqrt())].map(DVec2::from);
        prismoid(DVec3::from_array(self.corner), &base, self.height, 1.0, self.rotation)
    }

    fn fit(&mut self, base: DVec3, size: DVec3) {
        let side = size.x;
        let corner = corner_of_centered(base, side, side * 0.75f64.sqrt());
        *self = Self { corner, side, height: size.y, rotation: 0.0 };
    }

    by_corner_and_rotation!();
}
