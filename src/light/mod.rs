//! Lights.

mod delta;

pub use delta::{DeltaLight, LightSample};

use crate::value::{Choice, Color, Field, NumberRange, ValidationError, Validator, ValueType};
use serde::{Deserialize, Serialize};

/// One light: exactly one of `point` and `directional`, a colour, an intensity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Light {
    /// Name, for messages and the outline.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub name: String,
    /// Emits from a point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub point: Option<Point>,
    /// Arrives along one direction everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub directional: Option<Directional>,
    /// Colour; multiplies the intensity.
    pub color: Color,
    /// With falloff `inverse-square` the radiant intensity [W/sr]; otherwise normal irradiance /
    /// pi.
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

/// The keys of `[[light]]`.
pub const FIELDS: &[Field] = &[
    Field::optional("name", ValueType::Text, "", "a number", "Name; no two lights have the same."),
    Field::optional(
        "point",
        ValueType::Table(POINT),
        "",
        "`directional` is needed",
        "Light from one point. Exactly one of `point` and `directional` is given.",
    ),
    Field::optional(
        "directional",
        ValueType::Table(DIRECTIONAL),
        "",
        "`point` is needed",
        "Light from infinitely far away.",
    ),
    Field::preset(
        "color",
        ValueType::Color(NumberRange::LIGHT),
        "",
        "[1.0, 1.0, 1.0]",
        "Colour; multiplies the intensity.",
    ),
    Field::preset(
        "intensity",
        ValueType::Number(NumberRange::LIGHT),
        "W/sr, or irradiance / π",
        "1.0",
        "With falloff `inverse-square` the radiant intensity [W/sr]. With `none`, and for a \
         directional light, the brightness of a white matt surface that faces the light.",
    ),
    Field::preset(
        "falloff",
        ValueType::Choice(FALLOFFS),
        "",
        "\"none\"",
        "How a point light weakens with distance.",
    ),
    Field::preset("on", ValueType::Switch, "", "true", "Whether it shines."),
];

const POINT: &[Field] = &[Field::required(
    "position",
    ValueType::Numbers(3, NumberRange::COORDINATE),
    "scene units",
    "Where it stands.",
)];

const DIRECTIONAL: &[Field] = &[Field::required(
    "direction",
    ValueType::Direction,
    "",
    "Direction in which the light travels.",
)];

const FALLOFFS: &[Choice] = &[
    Choice { name: "none", doc: "not at all" },
    Choice { name: "inverse-square", doc: "with the square of the distance" },
];

impl Light {
    /// What is wrong with it.
    pub fn faults(&self) -> Vec<ValidationError> {
        let point = self
            .point
            .map(|p| Validator::new(POINT).numbers("position", &p.position).validate())
            .unwrap_or_default();
        let directional = self
            .directional
            .map(|d| Validator::new(DIRECTIONAL).numbers("direction", &d.direction).validate())
            .unwrap_or_default();
        let kinds = match (&self.point, &self.directional) {
            (Some(_), None) => None,
            (None, None) => Some(ValidationError::new(
                "",
                "neither point nor directional is given",
                "exactly one of them, such as point = { position = [2.0, 4.0, 3.0] }",
            )),
            (Some(_), Some(_)) => Some(ValidationError::new(
                "directional",
                "both point and directional are given",
                "exactly one of them; a second light needs its own [[light]]",
            )),
            (None, Some(_)) => (self.falloff == Falloff::InverseSquare).then(|| {
                ValidationError::new(
                    "falloff",
                    "falloff is \"inverse-square\", but a directional light has no distance",
                    "falloff \"none\", or a point light",
                )
            }),
        };
        Validator::new(FIELDS)
            .nested("point", point)
            .nested("directional", directional)
            .numbers("color", &self.color.0)
            .numbers("intensity", &[self.intensity])
            .and(kinds)
            .validate()
    }
}

#[cfg(test)]
mod tests {
    use super::{Directional, Falloff, Light, Point};
    use crate::value::Color;

    fn keys(light: &Light) -> Vec<String> {
        light.faults().into_iter().map(|f| f.key).collect()
    }

    #[test]
    fn exactly_one_kind() {
        let mut light = Light::default();
        assert_eq!(keys(&light), [""]);
        light.point = Some(Point { position: [0.0; 3] });
        assert!(keys(&light).is_empty());
        light.falloff = Falloff::InverseSquare;
        assert!(keys(&light).is_empty());
        light.directional = Some(Directional { direction: [0.0, -1.0, 0.0] });
        assert_eq!(keys(&light), ["directional"]);
        light.point = None;
        assert_eq!(keys(&light), ["falloff"]);
        light.falloff = Falloff::None;
        assert!(keys(&light).is_empty());
    }

    #[test]
    fn every_number_is_checked() {
        let light = Light {
            point: Some(Point { position: [f64::NAN, 0.0, 0.0] }),
            color: Color([-1.0; 3]),
            intensity: -1.0,
            ..Light::default()
        };
        assert_eq!(keys(&light), ["point.position", "color", "intensity"]);
        let still = Directional { direction: [0.0; 3] };
        let light = Light { directional: Some(still), ..Light::default() };
        assert_eq!(keys(&light), ["directional.direction"]);
    }
}
