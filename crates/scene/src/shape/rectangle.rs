//! Rectangle in any orientation, such as a flat mirror.

use crate::shape::ShapeDesc;
use crate::value::{KeyNode, ValidationError, description, rotated_y, unit};
use glam::{DMat3, DVec3};
use zerkalo_kernel::primitive::{Form, ParallelogramForm};

description! {
    /// A flat rectangle, such as a mirror. Its front is the side that `normal` points to.
    pub struct Rectangle {
        /// Centre of the rectangle.
        center: [f64; 3], in COORDINATE "scene units";
        /// Width and height of the rectangle; the height is along `up`.
        size: [f64; 2], in SIZE "scene units";
        /// Direction in which the front faces.
        normal: [f64; 3], as Direction;
        /// Direction of the height, made perpendicular to `normal`; not parallel to it.
        up: [f64; 3] = [0.0, 1.0, 0.0], as Direction;
        example "shape.rectangle = { center = [0.0, 1.5, -2.0], size = [4.0, 3.0], \
            normal = [0.0, 0.0, 1.0] }";
    }
}

impl Rectangle {
    /// Returns the unit vectors to the right (seen from the front), up and to the front; `None` if
    /// `up` is parallel to the normal.
    fn frame(&self) -> Option<[DVec3; 3]> {
        let front = unit(self.normal)?;
        let right = unit(self.up)?.cross(front);
        // If the vectors are parallel within 1e-6, rounding errors would determine the direction.
        (right.length() > 1e-6).then(|| {
            let right = right.normalize();
            [right, front.cross(right), front]
        })
    }
}

impl ShapeDesc for Rectangle {
    fn form(&self) -> Form {
        let [right, up, _] = self.frame().unwrap_or([DVec3::X, DVec3::Y, DVec3::Z]);
        let (u, v) = (right * self.size[0], up * self.size[1]);
        Form::Parallelogram(ParallelogramForm {
            corner: DVec3::from_array(self.center) - (u + v) / 2.0,
            u,
            v,
        })
    }

    fn faults(&self) -> Vec<ValidationError> {
        let checks = self.validator().lengths(self);
        let parallel = checks.is_clean() && self.frame().is_none();
        checks
            .and(parallel.then(|| {
                ValidationError::new(
                    "up",
                    "up is parallel to normal, which leaves the orientation of the rectangle undefined",
                    "an `up` across the normal, such as [0.0, 0.0, -1.0] for one that lies flat",
                )
            }))
            .errors()
    }

    fn fit(&mut self, base: DVec3, size: DVec3) {
        *self = Self {
            center: [base.x, base.y + size.y / 2.0, base.z],
            size: [size.x, size.y],
            normal: [0.0, 0.0, 1.0],
            up: [0.0, 1.0, 0.0],
        };
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }

    fn rotate_y(&mut self, degrees: f64) -> bool {
        self.normal = rotated_y(self.normal, degrees);
        self.up = rotated_y(self.up, degrees);
        true
    }

    fn texture_axes(&self) -> DMat3 {
        let [right, up, front] = self.frame().unwrap_or([DVec3::X, DVec3::Y, DVec3::Z]);
        DMat3::from_cols(right, up, front)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::HorizontalRectangle;

    fn sides(form: Form) -> (DVec3, DVec3, DVec3) {
        match form {
            Form::Parallelogram(ParallelogramForm { corner, u, v }) => (corner, u, v),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn rectangle_front_faces_normal() {
        for normal in
            [[0.0, 0.0, 1.0], [0.3, -0.2, -1e-200], [-2e150, 1e150, 1e150], [0.0, 0.1, 3.0]]
        {
            let mirror = Rectangle {
                center: [1.0, 2.0, 3.0],
                size: [4.0, 3.0],
                normal,
                up: [0.0, 1.0, 0.0],
            };
            assert_eq!(mirror.faults(), []);
            let (corner, u, v) = sides(mirror.form());
            let front = unit(normal).unwrap();
            assert!((u.cross(v) / 12.0 - front).length() < 1e-14, "{normal:?}");
            assert!((u.length() - 4.0).abs() < 1e-14 && (v.length() - 3.0).abs() < 1e-14);
            assert!(u.y.abs() < 1e-14 && v.y > 0.0, "{normal:?}: width is level, height goes up");
            assert!((corner + (u + v) / 2.0 - DVec3::new(1.0, 2.0, 3.0)).length() < 1e-14);
        }
    }

    #[test]
    fn up_parallel_to_normal_is_rejected() {
        for (normal, sound) in [
            ([0.0, 1.0, 0.0], false),
            ([0.0, -1e-300, 0.0], false),
            ([1e-9, 1.0, 0.0], false),
            ([1e-3, 1.0, 0.0], true),
        ] {
            let lying = Rectangle { center: [0.0; 3], size: [1.0; 2], normal, up: [0.0, 1.0, 0.0] };
            let keys: Vec<_> = lying.faults().into_iter().map(|f| f.key).collect();
            assert_eq!(keys.is_empty(), sound, "{normal:?} {keys:?}");
        }
    }

    #[test]
    fn platform_faces_up() {
        let platform = HorizontalRectangle { center: [1.0, 2.0, 3.0], size: [8.0, 6.0] };
        let (corner, u, v) = sides(platform.form());
        assert_eq!(u.cross(v), DVec3::new(0.0, 48.0, 0.0));
        assert_eq!(corner, DVec3::new(-3.0, 2.0, 0.0));
        assert_eq!(corner + u + v, DVec3::new(5.0, 2.0, 6.0));
    }
}
