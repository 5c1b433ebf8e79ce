//! Infinite plane.

use crate::primitive::{Form, PlaneForm};
use crate::shape::ShapeDesc;
use crate::shape::texture_space::on_plane;
use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType, turned, unit};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// A plane without end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// Any point of it.
    pub point: [f64; 3],
    /// Direction in which the front faces; any length but 0.
    pub normal: [f64; 3],
}

impl ShapeDesc for Plane {
    const DOC: &'static str = "A plane without end. Its front is the side that `normal` points to.";
    const EXAMPLE: &'static str =
        "shape.plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] }";
    const FIELDS: &'static [Field] = &[
        Field::required(
            "point",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "Any point of the plane.",
        ),
        Field::required("normal", ValueType::Direction, "", "Direction in which the front faces."),
    ];

    fn form(&self) -> Form {
        let normal = unit(self.normal).unwrap_or(DVec3::Y);
        Form::Plane(PlaneForm { normal, offset: normal.dot(DVec3::from_array(self.point)) })
    }

    fn faults(&self) -> Vec<ValidationError> {
        Validator::new(Self::FIELDS)
            .numbers("point", &self.point)
            .numbers("normal", &self.normal)
            .validate()
    }

    /// The ground, through `base`.
    fn fitted_to(base: DVec3, _: DVec3) -> Self {
        Self { point: base.to_array(), normal: [0.0, 1.0, 0.0] }
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.point]
    }

    fn rotate_y(&mut self, degrees: f64) -> bool {
        self.normal = turned(self.normal, degrees);
        true
    }

    fn texture_axes(&self) -> DMat3 {
        match self.form() {
            Form::Plane(PlaneForm { normal, .. }) => on_plane(normal),
            _ => DMat3::IDENTITY,
        }
    }
}
