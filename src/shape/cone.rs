//! Cone: from a disc to its apex.

use crate::primitive::Form;
use crate::shape::ShapeDesc;
use crate::shape::axial::axes_between;
use crate::shape::axial::{degenerate_axis, frustum_between, height, is_upright};
use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A right circular cone with its base closed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cone {
    /// Centre of the base.
    pub base: [f64; 3],
    /// The apex.
    pub apex: [f64; 3],
    /// Radius of the base.
    pub radius: f64,
}

impl ShapeDesc for Cone {
    const DOC: &'static str = "A right circular cone with a flat base.";
    const EXAMPLE: &'static str =
        "shape.cone = { base = [0.0, 0.0, 0.0], apex = [0.0, 1.0, 0.0], radius = 0.5 }";
    const FIELDS: &'static [Field] = &[
        Field::required(
            "base",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "Centre of the base.",
        ),
        Field::required(
            "apex",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "The apex.",
        ),
        Field::required(
            "radius",
            ValueType::Number(NumberRange::SIZE),
            "scene units",
            "Radius of the base.",
        ),
    ];

    fn form(&self) -> Form {
        frustum_between(self.base, self.apex, self.radius, 0.0)
    }

    fn faults(&self) -> Vec<ValidationError> {
        let sizes = [("radius", self.radius), ("apex", height(self.base, self.apex))];
        Validator::new(Self::FIELDS)
            .numbers("base", &self.base)
            .numbers("apex", &self.apex)
            .numbers("radius", &[self.radius])
            .and(degenerate_axis(self.base, self.apex, "apex"))
            .ratio(&sizes, &[self.base, self.apex].concat())
            .validate()
    }

    fn fitted_to(base: DVec3, size: DVec3) -> Self {
        let top = base + DVec3::Y * size.y;
        let radius = size.x.min(size.z) / 2.0;
        Self { base: base.to_array(), apex: top.to_array(), radius }
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.base, &mut self.apex]
    }

    /// Upright it looks the same from all sides.
    fn rotate_y(&mut self, _: f64) -> bool {
        is_upright(self.base, self.apex)
    }

    fn texture_axes(&self) -> DMat3 {
        axes_between(self.base, self.apex)
    }
}
