//! Platform: the ground that things stand on.

use crate::primitive::{Form, ParallelogramForm};
use crate::shape::ShapeDesc;
use crate::shape::texture_space::on_plane;
use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A horizontal rectangle that faces up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HorizontalRectangle {
    /// Centre.
    pub center: [f64; 3],
    /// Lengths along x and z.
    pub size: [f64; 2],
}

impl ShapeDesc for HorizontalRectangle {
    const DOC: &'static str =
        "A horizontal rectangle that faces up: the ground that things stand on.";
    const EXAMPLE: &'static str =
        "shape.platform = { center = [0.0, 0.0, 0.0], size = [8.0, 8.0] }";
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
            "Lengths along x and z.",
        ),
    ];

    fn form(&self) -> Form {
        let [x, z] = self.size;
        Form::Parallelogram(ParallelogramForm {
            corner: DVec3::from_array(self.center) - DVec3::new(x, 0.0, z) / 2.0,
            u: DVec3::new(0.0, 0.0, z),
            v: DVec3::new(x, 0.0, 0.0),
        })
    }

    fn faults(&self) -> Vec<ValidationError> {
        Validator::new(Self::FIELDS)
            .numbers("center", &self.center)
            .numbers("size", &self.size)
            .ratio(&self.size.map(|s| ("size", s)), &self.center)
            .validate()
    }

    /// A table top: at the height of the box's upper side.
    fn fitted_to(base: DVec3, size: DVec3) -> Self {
        Self { center: [base.x, base.y + size.y, base.z], size: [size.x, size.z] }
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }

    fn rotate_y(&mut self, _: f64) -> bool {
        false
    }

    fn texture_axes(&self) -> DMat3 {
        on_plane(DVec3::Y)
    }
}
