//! Tapered cylinder: its radius changes evenly along the axis between two points.

use crate::primitive::Form;
use crate::shape::ShapeDesc;
use crate::shape::axial::axes_between;
use crate::shape::axial::{degenerate_axis, frustum_between, height, is_upright};
use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A circular cylinder that narrows or widens evenly, with its ends closed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaperedCylinder {
    /// Centre of one end.
    pub base: [f64; 3],
    /// Centre of the other end.
    pub top: [f64; 3],
    /// Radius at `base`; 0: a cone that points there.
    pub base_radius: f64,
    /// Radius at `top`; 0: a cone that points there.
    pub top_radius: f64,
}

/// A radius that may be 0.
const RADIUS: ValueType = ValueType::Number(NumberRange::closed(0.0, NumberRange::SIZE.high));

impl ShapeDesc for TaperedCylinder {
    const DOC: &'static str =
        "A circular cylinder that narrows or widens evenly, with flat ends: a cone cut off.";
    const EXAMPLE: &'static str = "shape.tapered_cylinder = { base = [0.0, 0.0, 0.0], top = [0.0, 1.0, 0.0], \
         base_radius = 0.5, top_radius = 0.3 }";
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
        Field::required("base_radius", RADIUS, "scene units", "Radius at `base`; 0: an apex."),
        Field::required("top_radius", RADIUS, "scene units", "Radius at `top`; 0: an apex."),
    ];

    fn form(&self) -> Form {
        frustum_between(self.base, self.top, self.base_radius, self.top_radius)
    }

    fn faults(&self) -> Vec<ValidationError> {
        let radii = [("base_radius", self.base_radius), ("top_radius", self.top_radius)];
        let mut sizes: Vec<_> = radii.into_iter().filter(|(_, r)| *r != 0.0).collect();
        let thin = sizes.is_empty().then(|| {
            ValidationError::new(
                "top_radius",
                "both radii are 0",
                "a radius greater than 0 at one end at least",
            )
        });
        sizes.push(("top", height(self.base, self.top)));
        Validator::new(Self::FIELDS)
            .numbers("base", &self.base)
            .numbers("top", &self.top)
            .numbers("base_radius", &[self.base_radius])
            .numbers("top_radius", &[self.top_radius])
            .and(degenerate_axis(self.base, self.top, "top"))
            .and(thin)
            .ratio(&sizes, &[self.base, self.top].concat())
            .validate()
    }

    fn fitted_to(base: DVec3, size: DVec3) -> Self {
        let top = base + DVec3::Y * size.y;
        let radius = size.x.min(size.z) / 2.0;
        Self {
            base: base.to_array(),
            top: top.to_array(),
            base_radius: radius,
            top_radius: 0.6 * radius,
        }
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
