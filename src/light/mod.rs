//! Lights.

use crate::value::Color;
use serde::{Deserialize, Serialize};

/// One light: exactly one of `point` and `directional`, a colour, an intensity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Light {
    /// Name, for messages and the outline.
    pub name: String,
    /// Emits from a point.
    pub point: Option<Point>,
    /// Arrives along one direction everywhere.
    pub directional: Option<Directional>,
    /// Colour; multiplies the intensity.
    pub color: Color,
    /// With falloff `inverse-square` the radiant intensity [W/sr]; otherwise normal irradiance / pi.
    pub intensity: f64,
    /// How a point light weakens with distance.
    pub falloff: Falloff,
    /// Whether it shines.
    pub on: bool,
}

/// Light from one point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Point {
    /// Where it stands.
    pub position: [f64; 3],
}

/// Light from infinitely far away.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Directional {
    /// The direction in which the light travels; any length but 0.
    pub direction: [f64; 3],
}

/// How a point light weakens with distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Falloff {
    /// Not at all.
    None,
    /// With the square of the distance.
    InverseSquare,
}

impl Default for Light {
    fn default() -> Self {
        Self {
            name: String::new(),
            point: None,
            directional: None,
            color: Color::WHITE,
            intensity: 1.0,
            falloff: Falloff::None,
            on: true,
        }
    }
}
