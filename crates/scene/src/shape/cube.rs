//! Shape `cube`: an upright cube that can be rotated about the vertical.

use crate::shape::ShapeDesc;
use crate::shape::prismoid::{by_corner_and_rotation, corner_of_centered, prismoid};
use crate::value::description;
use glam::{DVec2, DVec3};
use zerkalo_kernel::primitive::Form;

description! {
    /// A cube that stands upright.
    pub struct Cube {
        /// Lower left near corner, before the rotation (near is +z).
        corner: [f64; 3], in COORDINATE "scene units";
        /// Length of an edge.
        edge: f64, in SIZE "scene units";
        /// Rotation about the vertical through the centre, counter-clockwise seen from above.
        rotation: f64 = 0.0, in FINITE "degrees";
        example "shape.cube = { corner = [-0.5, 0.0, 0.5], edge = 1.0, rotation = 30.0 }";
    }
}

impl ShapeDesc for Cube {
    fn form(&self) -> Form {
        let e = self.edge;
        prismoid(DVec3::from_array(self.corner), &square(e), e, 1.0, self.rotation)
    }

    fn fit(&mut self, base: DVec3, size: DVec3) {
        let edge = size.min_element();
        let corner = corner_of_centered(base, edge, edge);
        *self = Self { corner, edge, rotation: 0.0 };
    }

    by_corner_and_rotation!();
}

/// Returns the corners of a square, as (x, z) offsets from its lower left near corner (near is +z).
pub(super) fn square(side: f64) -> [DVec2; 4] {
    [(0.0, 0.0), (side, 0.0), (side, -side), (0.0, -side)].map(DVec2::from)
}
