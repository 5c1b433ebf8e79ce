//! Cube, standing upright.

use crate::primitive::Form;
use crate::shape::ShapeDesc;
use crate::shape::prismoid::{corner_of_centered, prismoid};
use crate::shape::registry::turned_rotation;
use crate::shape::texture_space::turned_axes;
use crate::value::{Field, NumberRange, ValidationError, Validator, ValueType};
use glam::{DMat3, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A cube. Unturned it spans x to x + edge, y to y + edge and z - edge to z from its corner
/// (x, y, z).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cube {
    /// Lower left near corner before the rotation; near is +z.
    pub corner: [f64; 3],
    /// Length of an edge.
    pub edge: f64,
    /// Degrees about the vertical through the centre, counter-clockwise seen from above.
    #[serde(default)]
    pub rotation: f64,
}

impl ShapeDesc for Cube {
    const DOC: &'static str = "A cube that stands upright.";
    const EXAMPLE: &'static str =
        "shape.cube = { corner = [-0.5, 0.0, 0.5], edge = 1.0, rotation = 30.0 }";
    const FIELDS: &'static [Field] = &[
        Field::required(
            "corner",
            ValueType::Numbers(3, NumberRange::COORDINATE),
            "scene units",
            "Lower left near corner, before the rotation (near is +z).",
        ),
        Field::required(
            "edge",
            ValueType::Number(NumberRange::SIZE),
            "scene units",
            "Length of an edge.",
        ),
        Field::preset(
            "rotation",
            ValueType::Number(NumberRange::FINITE),
            "degrees",
            "0.0",
            "Turn about the vertical through the centre, counter-clockwise seen from above.",
        ),
    ];

    fn form(&self) -> Form {
        let e = self.edge;
        prismoid(DVec3::from_array(self.corner), &square(e), e, 1.0, self.rotation)
    }

    fn faults(&self) -> Vec<ValidationError> {
        Validator::new(Self::FIELDS)
            .numbers("corner", &self.corner)
            .numbers("edge", &[self.edge])
            .numbers("rotation", &[self.rotation])
            .ratio(&[("edge", self.edge)], &self.corner)
            .validate()
    }

    fn fitted_to(base: DVec3, size: DVec3) -> Self {
        let edge = size.min_element();
        let corner = corner_of_centered(base, edge, edge);
        Self { corner, edge, rotation: 0.0 }
    }

    fn anchor_points_mut(&mut self) -> Vec<&mut [f64; 3]> {
        vec![&mut self.corner]
    }

    fn rotate_y(&mut self, degrees: f64) -> bool {
        self.rotation = turned_rotation(self.rotation, degrees);
        true
    }

    fn texture_axes(&self) -> DMat3 {
        turned_axes(self.rotation)
    }
}

/// A square base with its lower left near corner at the origin.
pub(super) fn square(side: f64) -> [DVec2; 4] {
    [(0.0, 0.0), (side, 0.0), (side, -side), (0.0, -side)].map(DVec2::from)
}
