//! Platform: a horizontal rectangle, such as the ground.

use crate::shape::ShapeDesc;
use crate::shape::texture_space::on_plane;
use crate::value::description;
use glam::{DMat3, DVec3};
use zerkalo_kernel::primitive::{Form, ParallelogramForm};

description! {
    /// A horizontal rectangle that faces up, such as the ground.
    pub struct HorizontalRectangle {
        /// Centre of the rectangle.
        center: [f64; 3], in COORDINATE "scene units";
        /// Lengths of the rectangle along x and z.
        size: [f64; 2], in SIZE "scene units";
        example "shape.platform = { center = [0.0, 0.0, 0.0], size = [8.0, 8.0] }";
    }
}

impl ShapeDesc for HorizontalRectangle {
    fn form(&self) -> Form {
        let [x, z] = self.size;
        Form::Parallelogram(ParallelogramForm {
            corner: DVec3::from_array(self.center) - DVec3::new(x, 0.0, z) / 2.0,
            u: DVec3::new(0.0, 0.0, z),
            v: DVec3::new(x, 0.0, 0.0),
        })
    }

    /// Creates the rectangle that is the upper side of a box; see [`ShapeDesc::fit`].
    fn fit(&mut self, base: DVec3, size: DVec3) {
        *self = Self { center: [base.x, base.y + size.y, base.z], size: [size.x, size.z] };
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }

    fn texture_axes(&self) -> DMat3 {
        on_plane(DVec3::Y)
    }
}
