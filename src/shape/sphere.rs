//! Sphere: the points at distance `radius` from `center`.

use crate::primitive::{Form, SphereForm};
use crate::shape::ShapeDesc;
use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType, round_nice};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sphere {
    /// Centre.
    pub center: [f64; 3],
    /// Radius.
    pub radius: f64,
}

impl ShapeDesc for Sphere {
    const DOC: &'static str = "A sphere.";
    const EXAMPLE: &'static str = "shape.sphere = { center = [0.0, 1.0, 0.0], radius = 1.0 }";
    const FIELDS: &'static [Field] = &[
        Field::required(
            "center",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "Centre.",
        ),
        Field::required("radius", ValueType::Number(NumberRange::SIZE), "scene units", "Radius."),
    ];

    fn form(&self) -> Form {
        Form::Sphere(SphereForm { center: DVec3::from_array(self.center), radius: self.radius })
    }

    fn faults(&self) -> Vec<ValidationError> {
        Validator::new(Self::FIELDS)
            .numbers("center", &self.center)
            .numbers("radius", &[self.radius])
            .ratio(&[("radius", self.radius)], &self.center)
            .validate()
    }

    fn fitted_to(base: DVec3, size: DVec3) -> Self {
        let radius = round_nice(size.min_element() / 2.0, size.min_element());
        Self { center: [base.x, base.y + radius, base.z], radius }
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.center]
    }

    /// It looks the same from all sides.
    fn rotate_y(&mut self, _: f64) -> bool {
        true
    }
}
