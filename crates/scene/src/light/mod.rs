//! Lights: their descriptions, one kind a file, and the compiled forms that kernels sample.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]
#![allow(missing_docs, reason = "fields and variants whose names say it")]

mod compiled;
mod delta;
mod directional;
mod disk;
mod emitter;
mod emitter_table;
mod environment;
mod form;
mod group;
mod point;
mod rectangle;
mod registry;
mod sample;
mod solid_angle;
mod sphere;
mod spot;
mod triangles;

pub use compiled::CompiledLight;
pub use delta::DeltaLight;
pub use directional::Directional;
pub use disk::DiskLight;
pub use emitter::Emitter;
pub use emitter_table::{EmitterTable, lanes_with};
pub use environment::{Environment, EnvironmentLight};
pub use form::{EmissiveSurface, LightForm};
pub use group::LightGroup;
pub use point::Point;
pub use rectangle::RectangleLight;
pub use registry::{Handles, LightDesc, LightKind, Placement};
pub use sample::LightSample;
pub use sphere::SphereLight;
pub use spot::{Spot, SpotCone, spot_factor};

use crate::value::{Color, Description, Field, KeyNode, ValidationError, choices, description};
use glam::DVec3;

description! {
    /// A light: exactly one of the kinds, with a colour and an intensity.
    pub struct Light {
        /// Name of the light; every light has a different one.
        name: String, or "a number";
        /// Light group in which the light is mixed with others, which keep their proportions.
        group: String, or "a group of its own";
        /// Colour, by which the intensity is multiplied.
        color: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// Sphere, rectangle or disk: radiance or power, as `unit` says. Environment: factor
        /// of its radiance. Point or spot: radiant intensity [W/sr], of a spot inside its
        /// inner cone, if `falloff` is `inverse-square`. Directional light, or point or spot
        /// without falloff: the brightness of a white diffuse surface that faces the light.
        intensity: f64 = 1.0, in LIGHT "W/(sr m²), W, W/sr, or irradiance / π";
        /// Unit of the intensity of a sphere, rectangle or disk.
        unit: LightUnit = "radiance";
        /// Falloff of a point or spot light with the distance.
        falloff: Falloff = "none";
        /// `false` hides a light with a size, or an environment, from the camera and from
        /// mirrors. It still lights diffuse surfaces and makes highlights.
        visible: bool = true;
        /// `false` switches the light off.
        on: bool = true;
        flatten kind: LightKind, after 2;
    }
}

choices! {
    /// Falloff of a point or spot light with the distance.
    pub enum Falloff {
        /// no falloff: the same light at every distance
        None = "none",
        /// falloff with the square of the distance
        InverseSquare = "inverse-square",
    }
}

choices! {
    /// Unit of the intensity of a light with a size.
    pub enum LightUnit {
        /// radiance \[W/(sr m²)\]: the brightness of the light as the camera sees it
        Radiance = "radiance",
        /// power \[W\]: π times the radiance times the area that shines, for any size
        Power = "power",
    }
}

/// Keys of a `[[light]]` table in scene files.
pub const FIELDS: &[Field] = Light::FIELDS;

impl Light {
    /// Creates a white light of intensity 1, without a name.
    pub fn new(kind: impl Into<LightKind>) -> Self {
        Self { kind: kind.into(), ..Self::default() }
    }

    /// Returns the canonical form of the light, which must be valid.
    pub fn form(&self) -> LightForm<'_> {
        self.kind.form()
    }

    /// Returns the surface of a sphere, rectangle or disk light; `None` for other lights.
    pub fn surface(&self) -> Option<EmissiveSurface> {
        match self.form() {
            LightForm::Surface(surface) => Some(surface),
            LightForm::Point { .. } | LightForm::Distant { .. } | LightForm::Environment(_) => None,
        }
    }

    /// Returns the position of a point or spot light; `None` for other lights.
    pub fn apex(&self) -> Option<DVec3> {
        match self.form() {
            LightForm::Point { position, .. } => Some(position),
            LightForm::Distant { .. } | LightForm::Surface(_) | LightForm::Environment(_) => None,
        }
    }

    /// Returns `true` if the camera and mirrors can see the light while `visible` is `true`.
    pub fn has_radiance(&self) -> bool {
        match self.form() {
            LightForm::Surface(_) | LightForm::Environment(_) => true,
            LightForm::Distant { radius, .. } => radius > 0.0,
            LightForm::Point { .. } => false,
        }
    }

    /// Returns `true` if the key `name` has an effect on a light of this kind.
    pub fn has_key(&self, name: &str) -> bool {
        match name {
            "unit" => self.surface().is_some(),
            "falloff" => self.apex().is_some(),
            "visible" => self.has_radiance(),
            _ => true,
        }
    }

    pub fn environment(&self) -> Option<&Environment> {
        match self.form() {
            LightForm::Environment(environment) => Some(environment),
            LightForm::Point { .. } | LightForm::Distant { .. } | LightForm::Surface(_) => None,
        }
    }

    pub fn environment_mut(&mut self) -> Option<&mut Environment> {
        let LightKind::Environment(environment) = &mut self.kind else { return None };
        Some(environment)
    }

    /// Returns the position of the light, or the centre of its surface.
    pub fn position(&self) -> Option<[f64; 3]> {
        self.kind.clone().handles().position.copied()
    }

    pub fn position_mut(&mut self) -> Option<&mut [f64; 3]> {
        self.kind.handles().position
    }

    /// Returns the direction in which a directional light travels, the axis of a spot light, or the
    /// normal of a rectangle or disk; `None` for other lights.
    pub fn direction(&self) -> Option<[f64; 3]> {
        self.kind.clone().handles().direction.copied()
    }

    pub fn faults(&self) -> Vec<ValidationError> {
        let unused = |key, is_given: bool, found, expected| {
            (is_given && !self.has_key(key)).then(|| ValidationError::new(key, found, expected))
        };
        let falloff = unused(
            "falloff",
            self.falloff != Falloff::None,
            "falloff is \"inverse-square\", but only a point or spot light has a falloff",
            "falloff \"none\", or a point or spot light",
        );
        let unit = unused(
            "unit",
            self.unit != LightUnit::Radiance,
            "unit is \"power\", but only a sphere, rectangle or disk has one",
            "unit \"radiance\", or a light with a size",
        );
        let visible = unused(
            "visible",
            !self.visible,
            "visible is false, but no light of this kind is visible",
            "visible = true, or a light with a size or an environment",
        );
        self.validator().and(falloff).and(unit).and(visible).errors()
    }
}

#[cfg(test)]
mod tests {
    use super::{Directional, Falloff, Light, LightKind, Point, Spot};
    use crate::Scene;
    use crate::value::Color;

    fn keys(light: &Light) -> Vec<String> {
        light.faults().into_iter().map(|f| f.key).collect()
    }

    fn point() -> Light {
        Light::new(Point { position: [0.0; 3] })
    }

    #[test]
    fn light_has_exactly_one_kind() {
        let read = |keys: &str| match Scene::parse(&format!("[[light]]\n{keys}"), "a.toml") {
            Ok(mut scene) => Ok(scene.lights.remove(0)),
            Err(errors) => Err(errors.messages[0].found.clone()),
        };
        assert_eq!(read("point.position = [0, 0, 0]"), Ok(point()));
        assert_eq!(read("intensity = 2.0"), Err("the light has no kind".to_string()));
        let both = "directional.direction = [0, -1, 0]\npoint.position = [0, 0, 0]";
        assert_eq!(read(both), Err("both directional and point are given".to_string()));
    }

    #[test]
    fn falloff_belongs_to_point_and_spot_lights() {
        for (kind, has_falloff) in [
            (LightKind::from(Point { position: [0.0; 3] }), true),
            (LightKind::from(Directional::along([0.0, -1.0, 0.0])), false),
            (LightKind::from(SPOT), true),
        ] {
            let mut light = Light::new(kind);
            assert!(keys(&light).is_empty());
            light.falloff = Falloff::InverseSquare;
            assert_eq!(keys(&light).is_empty(), has_falloff);
        }
    }

    const SPOT: Spot = Spot {
        position: [0.0, 2.0, 0.0],
        direction: [0.0, -1.0, 0.0],
        outer_angle: 30.0,
        inner_angle: 30.0,
    };

    #[test]
    fn inner_cone_of_spot_is_inside_the_outer_cone() {
        let faults = |spot: Spot| keys(&Light::new(spot));
        assert!(faults(SPOT).is_empty());
        assert_eq!(faults(Spot { inner_angle: 30.1, ..SPOT }), ["spot.inner_angle"]);
        let pointed = Spot { outer_angle: 0.0, inner_angle: 0.0, ..SPOT };
        assert_eq!(faults(pointed), ["spot.outer_angle"]);
        assert_eq!(faults(Spot { outer_angle: 181.0, ..SPOT }), ["spot.outer_angle"]);
        assert_eq!(faults(Spot { direction: [0.0; 3], ..SPOT }), ["spot.direction"]);
    }

    #[test]
    fn light_ranges_are_checked() {
        let light = Light {
            color: Color([-1.0; 3]),
            intensity: -1.0,
            ..Light::new(Point { position: [f64::NAN, 0.0, 0.0] })
        };
        assert_eq!(keys(&light), ["color", "intensity", "point.position"]);
        let light = Light::new(Directional::along([0.0; 3]));
        assert_eq!(keys(&light), ["directional.direction"]);
    }
}
