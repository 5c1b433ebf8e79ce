//! Point and directional lights.

mod delta;

pub use delta::{DeltaLight, LightSample};

use crate::value::{Color, Description, Field, ValidationError, choices, description};

description! {
    /// A light: exactly one of `point` and `directional`, a colour, an intensity.
    pub struct Light: Default {
        /// Name; no two lights have the same.
        name: String, or "a number";
        /// Light from one point. Exactly one of `point` and `directional` is given.
        point: Option<Point>, or "`directional` is needed";
        /// Light from infinitely far away.
        directional: Option<Directional>, or "`point` is needed";
        /// Colour; multiplies the intensity.
        color: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// With falloff `inverse-square` the radiant intensity [W/sr]. With `none`, and for a
        /// directional light, the brightness of a white matt surface that faces the light.
        intensity: f64 = 1.0, in LIGHT "W/sr, or irradiance / π";
        /// Falloff of a point light with the distance.
        falloff: Falloff = "none";
        /// `false` switches the light off.
        on: bool = true;
    }
}

description! {
    /// Light from one point.
    pub struct Point: Copy {
        /// Position of the light.
        position: [f64; 3], in COORDINATE "scene units";
    }
}

description! {
    /// Light from infinitely far away.
    pub struct Directional: Copy {
        /// Direction in which the light travels.
        direction: [f64; 3], as Direction;
    }
}

choices! {
    /// Falloff of a point light with the distance.
    pub enum Falloff {
        /// not at all
        None = "none",
        /// with the square of the distance
        InverseSquare = "inverse-square",
    }
}

/// Keys of `[[light]]`.
pub const FIELDS: &[Field] = Light::FIELDS;

impl Light {
    /// Returns the validation errors of the light.
    pub fn faults(&self) -> Vec<ValidationError> {
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
        self.validator().and(kinds).errors()
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
    fn light_has_exactly_one_kind() {
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
    fn light_ranges_are_checked() {
        let light = Light {
            point: Some(Point { position: [f64::NAN, 0.0, 0.0] }),
            color: Color([-1.0; 3]),
            intensity: -1.0,
            ..Light::default()
        };
        assert_eq!(keys(&light), ["point.position", "color", "intensity"]);
        let no_direction = Directional { direction: [0.0; 3] };
        let light = Light { directional: Some(no_direction), ..Light::default() };
        assert_eq!(keys(&light), ["directional.direction"]);
    }
}
