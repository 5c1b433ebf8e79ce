//! Cylinder: the points within `radius` of the axis between two points, with flat ends.

use crate::primitive::Form;
use crate::shape::ShapeDesc;
use crate::shape::axial::axes_between;
use crate::shape::axial::{degenerate_axis, frustum_between, height, is_upright};
use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A circular cylinder with its ends closed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// Centre of one end.
    pub base: [f64; 3],
    /// Centre of the other end.
    pub top: [f64; 3],
    /// Radius.
    pub radius: f64,
}

impl ShapeDesc for Cylinder {
    const DOC: &'static str = "A circular cylinder with flat ends.";
    const EXAMPLE: &'static str =
        "shape.cylinder = { base = [0.0, 0.0, 0.0], top = [0.0, 1.0, 0.0], radius = 0.4 }";
    const FIELDS: &'static [Field] = &[
        Field::required(
            "base",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "Centre of one end.",
        ),
        Field::required(
            "top",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "Centre of the other end.",
        ),
        Field::required("radius", ValueType::Number(NumberRange::SIZE), "scene units", "Radius."),
    ];

    fn form(&self) -> Form {
        frustum_between(self.base, self.top, self.radius, self.radius)
    }

    fn faults(&self) -> Vec<ValidationError> {
        let sizes = [("radius", self.radius), ("top", height(self.base, self.top))];
        Validator::new(Self::FIELDS)
            .numbers("base", &self.base)
            .numbers("top", &self.top)
            .numbers("radius", &[self.radius])
            .and(degenerate_axis(self.base, self.top, "top"))
            .ratio(&sizes, &[self.base, self.top].concat())
            .validate()
    }

    fn fitted_to(base: DVec3, size: DVec3) -> Self {
        let top = base + DVec3::Y * size.y;
        let radius = size.x.min(size.z) / 2.0;
        Self { base: base.to_array(), top: top.to_array(), radius }
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.base, &mut self.top]
    }

    /// Upright it looks the same from all sides.
    fn rotate_y(&mut self, _: f64) -> bool {
        is_upright(self.base, self.top)
    }

    fn texture_axes(&self) -> DMat3 {
        axes_between(self.base, self.top)
    }
}
