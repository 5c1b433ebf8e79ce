//! Transforms: steps that move, rotate and scale an object or a part of one, applied in order.

use crate::shape::Shape;
use crate::value::{
    Field, FieldValue, KeyValue, NumberRange, ValidationError, ValueType, description, one_of,
    sin_cos_degrees, single_value, unit,
};
use glam::{DAffine3, DMat3, DVec3};
use zerkalo_kernel::primitive::Form;

one_of! {
    #[derive(Copy)]
    /// One step of a transform. Angles are counter-clockwise for a viewer at whom the axis points.
    pub enum TransformOp {
        /// Moves by this vector.
        Translate([f64; 3]) = "translate", in COORDINATE "scene units";
        /// Rotates about the x axis.
        RotateX(f64) = "rotate_x", in FINITE "degrees";
        /// Rotates about the y axis, the vertical: counter-clockwise seen from above.
        RotateY(f64) = "rotate_y", in FINITE "degrees";
        /// Rotates about the z axis.
        RotateZ(f64) = "rotate_z", in FINITE "degrees";
        /// Rotates about any axis through the origin.
        Rotate(Rotate) = "rotate";
        /// Scales away from the origin; negative: mirrors.
        Scale(Scale) = "scale";
    }
}

description! {
    /// Rotates about any axis through the origin.
    pub struct Rotate: Copy {
        /// Direction of the axis.
        axis: [f64; 3], as Direction;
        /// Angle, counter-clockwise for a viewer at whom the axis points.
        degrees: f64, in FINITE "degrees";
    }
}

/// Scaling by factors along x, y and z. In scene files one number means three equal factors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale(pub [f64; 3]);

single_value! {
    Scale: ValueType::Factor,
        |scale| {
            let [x, y, z] = scale.0;
            KeyValue::Numbers(if x == y && y == z { vec![x] } else { vec![x, y, z] })
        },
        |value| {
            let uniform = value.clone().numbers().map(|[factor]| [factor; 3]);
            uniform.or_else(|| value.numbers()).map(Self)
        };
}

impl TransformOp {
    /// Steps that change nothing: one of every kind.
    pub const IDENTITIES: [Self; Self::FIELDS.len()] = [
        Self::Translate([0.0; 3]),
        Self::RotateX(0.0),
        Self::RotateY(0.0),
        Self::RotateZ(0.0),
        Self::Rotate(Rotate { axis: [0.0, 1.0, 0.0], degrees: 0.0 }),
        Self::Scale(Scale([1.0; 3])),
    ];

    /// Returns the transform step as an affine map. The step must be valid.
    pub fn map(&self) -> DAffine3 {
        match *self {
            Self::Translate(by) => DAffine3::from_translation(DVec3::from_array(by)),
            Self::RotateX(degrees) => rotation(DVec3::X, degrees),
            Self::RotateY(degrees) => rotation(DVec3::Y, degrees),
            Self::RotateZ(degrees) => rotation(DVec3::Z, degrees),
            Self::Rotate(Rotate { axis, degrees }) => {
                rotation(unit(axis).unwrap_or(DVec3::Y), degrees)
            }
            Self::Scale(Scale(by)) => DAffine3::from_scale(DVec3::from_array(by)),
        }
    }
}

impl FieldValue for Vec<TransformOp> {
    const TYPE: ValueType = ValueType::ListOf(TransformOp::FIELDS);

    fn errors(&self, field: &Field) -> Vec<ValidationError> {
        let errors = |(i, step): (usize, &TransformOp)| {
            let key = format!("{}.{i}", field.name);
            step.faults().into_iter().map(move |error| error.prefixed(&key))
        };
        self.iter().enumerate().flat_map(errors).collect()
    }
}

/// Returns the rotation about the unit vector `axis` (Rodrigues' formula), exact for quarter turns
/// about coordinate axes.
fn rotation(axis: DVec3, degrees: f64) -> DAffine3 {
    let (sin, cos) = sin_cos_degrees(degrees);
    let rotated = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
    DAffine3::from_mat3(DMat3::from_cols(rotated(DVec3::X), rotated(DVec3::Y), rotated(DVec3::Z)))
}

/// Returns `true` if the map is finite, its largest element `m` is within 1e-12..=1e12, and `m`
/// times the largest element of the inverse is at most 1e12, which leaves 4 of 16 digits.
fn is_well_conditioned(map: &DAffine3) -> bool {
    let linear = map.matrix3;
    let largest = linear.to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    if !map.is_finite() || !(1e-12..=1e12).contains(&largest) {
        return false;
    }
    let inverse = (linear * largest.recip()).inverse();
    inverse.is_finite() && inverse.to_cols_array().iter().all(|x| x.abs() <= 1e12)
}

/// Returns the affine map that applies the steps in order, the first step first.
pub fn compose(steps: &[TransformOp]) -> DAffine3 {
    steps.iter().fold(DAffine3::IDENTITY, |map, step| step.map() * map)
}

/// Returns an error if the composition of the valid `steps` flattens `shape`, stretches it out of
/// range, moves it beyond the largest coordinate, or makes it too small for its distance from the
/// origin. A compound without points is never too small.
pub fn ill_conditioned(shape: &Shape, steps: &[TransformOp]) -> Option<ValidationError> {
    if steps.is_empty() {
        return None;
    }
    let map = compose(steps);
    if !is_well_conditioned(&map) {
        return Some(ValidationError::new(
            "transform",
            "transform flattens or stretches the object too much",
            "factors within 1e12 of each other and of 1",
        ));
    }
    let form = shape.form().transformed(&map);
    let max_coordinate = form.max_coordinate();
    let is_empty = matches!(&form, Form::Csg(solid) if solid.is_empty());
    let is_tiny = |(low, high): (DVec3, DVec3)| (high - low).max_element() < 1e-12 * max_coordinate;
    if !NumberRange::COORDINATE.holds(max_coordinate) {
        return Some(ValidationError::new(
            "transform",
            "transform moves the object to coordinates beyond 1e9",
            "coordinates from -1e9 to 1e9",
        ));
    }
    (!is_empty && form.bounds().is_some_and(is_tiny)).then(|| {
        ValidationError::new(
            "transform",
            "transform makes the object too small for its distance from the origin",
            "sizes and coordinates within a factor of 1e12 of each other",
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: DVec3, b: DVec3) -> bool {
        (a - b).length() < 1e-14
    }

    #[test]
    fn rotation_is_counter_clockwise_against_axis() {
        assert_eq!(TransformOp::RotateX(90.0).map().transform_point3(DVec3::Y), DVec3::Z);
        assert_eq!(TransformOp::RotateY(90.0).map().transform_point3(DVec3::Z), DVec3::X);
        assert_eq!(TransformOp::RotateZ(90.0).map().transform_point3(DVec3::X), DVec3::Y);
        let third = TransformOp::Rotate(Rotate { axis: [2.0; 3], degrees: 120.0 }).map();
        assert!(near(third.transform_point3(DVec3::X), DVec3::Y));
        let half = TransformOp::RotateY(30.0).map().transform_point3(DVec3::X);
        assert!(near(half, DVec3::new(0.75f64.sqrt(), 0.0, -0.5)), "{half}");
    }

    #[test]
    fn zero_factors_and_axes_are_rejected() {
        for (step, key) in [
            (TransformOp::Scale(Scale([0.0; 3])), "scale"),
            (TransformOp::Scale(Scale([1.0, 0.0, 1.0])), "scale"),
            (TransformOp::Rotate(Rotate { axis: [0.0; 3], degrees: 1.0 }), "rotate.axis"),
            (TransformOp::Rotate(Rotate { axis: [1.0; 3], degrees: f64::NAN }), "rotate.degrees"),
            (TransformOp::Translate([1e10, 0.0, 0.0]), "translate"),
            (TransformOp::RotateX(f64::INFINITY), "rotate_x"),
            (TransformOp::RotateY(f64::NAN), "rotate_y"),
            (TransformOp::RotateZ(f64::NAN), "rotate_z"),
        ] {
            let keys: Vec<_> = step.faults().into_iter().map(|f| f.key).collect();
            assert_eq!(keys, [key], "{step:?}");
        }
        assert!(TransformOp::Scale(Scale([-1.0, 1.0, 2.0])).faults().is_empty());
    }

    #[test]
    fn conditioning_depends_on_ratios() {
        let scaled = |x, y, z| DAffine3::from_scale(DVec3::new(x, y, z));
        assert!(is_well_conditioned(&scaled(1e-6, 1e-6, 1e-6)));
        assert!(is_well_conditioned(&scaled(1e5, 1e-5, -1.0)));
        assert!(!is_well_conditioned(&scaled(1e7, 1e-7, 1.0)));
        assert!(!is_well_conditioned(&scaled(1e-200, 1e-200, 1e-200)));
        assert!(!is_well_conditioned(&scaled(1.0, 0.0, 1.0)));
    }
}
