//! Rectangle anywhere: the flat mirror.

use crate::primitive::{Form, ParallelogramForm};
use crate::shape::ShapeDesc;

use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType, turned, unit};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A flat rectangle. Its front is the side that `normal` points to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rectangle {
    /// Centre.
    pub center: [f64; 3],
    /// Width (across) and height (along `up`).
    pub size: [f64; 2],
    /// Direction in which the front faces; any length but 0.
    pub normal: [f64; 3],
    /// Direction of the height, made perpendicular to the normal; any length but 0.
    #[serde(default = "up")]
    pub up: [f64; 3],
}

fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

impl Rectangle {
    /// Unit vectors to the right (seen from the front), up and to the front; `None` if `up` lies
    /// along the normal.
    fn frame(&self) -> Option<[DVec3; 3]> {
        let front = unit(self.normal)?;
        let right = unit(self.up)?.cross(front);
        // Within 1e-6 of parallel the direction is noise.
        (right.length() > 1e-6).then(|| {
            let right = right.normalize();
            [right, front.cross(right), front]
        })
    }
}

impl ShapeDesc for Rectangle {
    const DOC: &'static str =
        "A flat rectangle, such as a mirror. Its front is the side that `normal` points to.";
    const EXAMPLE: &'static str = "shape.rectangle = { center = [0.0, 1.5, -2.0], size = [4.0, 3.0], \
         normal = [0.0, 0.0, 1.0] }";
    const FIELDS: &'static [Field] = &[
        Field::required(
            "center",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "Centre.",
        ),
        Field::required(
            "size",
            ValueType::Numbers(2, NumberRange::SIZE),
            "scene units",
            "Width (across) and height (along `up`).",
        ),
        Field::required("normal", ValueType::Direction, "", "Direction in which the front faces."),
        Field::preset(
            "up",
            ValueType::Direction,
            "",
            "[0.0, 1.0, 0.0]",
            "Direction of the height, made perpendicular to `normal`; not parallel to it.",
        ),
    ];

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
        let checks = Validator::new(Self::FIELDS)
            .numbers("center", &self.center)
            .numbers("size", &self.size)
            .numbers("normal", &self.normal)
            .numbers("up", &self.up)
            .ratio(&self.size.map(|s| ("size", s)), &self.center);
        let parallel = checks.clean() && self.frame().is_none();
        checks
            .and(parallel.then(|| {
                ValidationError::new(
                    "up",
                    "up is parallel to normal, so that the rectangle could lie any way round",
                    "an `up` across the normal, such as [0.0, 0.0, -1.0] for one that lies flat",
                )
            }))
            .validate()
    }

    fn fitted_to(base: DVec3, size: DVec3) -> Self {
        Self {
            center: [base.x, base.y + size.y / 2.0, base.z],
            size: [size.x, size.y],
            normal: [0.0, 0.0, 1.0],
            up: up(),
        }
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }

    fn rotate_y(&mut self, degrees: f64) -> bool {
        self.normal = turned(self.normal, degrees);
        self.up = turned(self.up, degrees);
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
    fn the_front_is_where_the_normal_points() {
        for normal in
            [[0.0, 0.0, 1.0], [0.3, -0.2, -1e-200], [-2e150, 1e150, 1e150], [0.0, 0.1, 3.0]]
        {
            let mirror = Rectangle { center: [1.0, 2.0, 3.0], size: [4.0, 3.0], normal, up: up() };
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
    fn an_up_along_the_normal_is_a_fault() {
        for (normal, sound) in [
            ([0.0, 1.0, 0.0], false),
            ([0.0, -1e-300, 0.0], false),
            ([1e-9, 1.0, 0.0], false),
            ([1e-3, 1.0, 0.0], true),
        ] {
            let lying = Rectangle { center: [0.0; 3], size: [1.0; 2], normal, up: up() };
            let keys: Vec<_> = lying.faults().into_iter().map(|f| f.key).collect();
            assert_eq!(keys.is_empty(), sound, "{normal:?} {keys:?}");
        }
    }

    #[test]
    fn platforms_face_up() {
        let platform = HorizontalRectangle { center: [1.0, 2.0, 3.0], size: [8.0, 6.0] };
        let (corner, u, v) = sides(platform.form());
        assert_eq!(u.cross(v), DVec3::new(0.0, 48.0, 0.0));
        assert_eq!(corner, DVec3::new(-3.0, 2.0, 0.0));
        assert_eq!(corner + u + v, DVec3::new(5.0, 2.0, 6.0));
    }
}
