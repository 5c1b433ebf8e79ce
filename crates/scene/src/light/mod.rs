//! Lights: points, directions, cones, surfaces with a size, and the emission of objects.

mod area;
mod delta;
mod emitter;
mod environment;
mod object_emitter;

pub use area::{DiskLight, EmitterSurface, RectangleLight, SphereLight};
pub use delta::{DeltaLight, LightSample, SpotCone, spot_factor};
pub use emitter::{Emitter, EmitterSample};
pub use environment::{Environment, EnvironmentLight, EnvironmentSample};
pub use object_emitter::{ObjectEmitter, ObjectSurface};

use glam::DVec3;

use crate::value::{
    Color, Description, Field, ValidationError, choices, description, round_nice, round_significant,
};

description! {
    /// A light: exactly one of `point`, `directional`, `spot`, `sphere`, `rectangle`, `disk` and
    /// `environment`, with a colour and an intensity.
    pub struct Light: Default {
        /// Name of the light; every light has a different one.
        name: String, or "a number";
        /// Light from one point. A light has exactly one of `point`, `directional`, `spot`,
        /// `sphere`, `rectangle`, `disk` and `environment`.
        point: Option<Point>, or "another kind is needed";
        /// Light from infinitely far away.
        directional: Option<Directional>, or "another kind is needed";
        /// Light from one point into a cone.
        spot: Option<Spot>, or "another kind is needed";
        /// Light from a sphere.
        sphere: Option<SphereLight>, or "another kind is needed";
        /// Light from one side of a rectangle.
        rectangle: Option<RectangleLight>, or "another kind is needed";
        /// Light from one side of a disk.
        disk: Option<DiskLight>, or "another kind is needed";
        /// Light from all directions.
        environment: Option<Environment>, or "another kind is needed";
        /// Colour, by which the intensity is multiplied.
        color: Color = [1.0, 1.0, 1.0], in LIGHT;
        /// Sphere, rectangle or disk: radiance or power, as `unit` says. Environment: factor of its
        /// radiance. Point or spot: radiant intensity [W/sr], of a spot inside its inner cone, if
        /// `falloff` is `inverse-square`. Directional light, or point or spot without falloff: the
        /// brightness of a white matt surface that faces the light.
        intensity: f64 = 1.0, in LIGHT "W/(sr m²), W, W/sr, or irradiance / π";
        /// Unit of the intensity of a sphere, rectangle or disk.
        unit: LightUnit = "radiance";
        /// Falloff of a point or spot light with the distance.
        falloff: Falloff = "none";
        /// `false` hides an environment, or the surface of a sphere, rectangle or disk, from the
        /// camera and from mirrors. It still lights matt surfaces and makes highlights.
        visible: bool = true;
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

description! {
    /// Light from one point into a cone. Between the inner and the outer cone it decreases smoothly
    /// to zero.
    pub struct Spot: Copy {
        /// Position of the light: the apex of the cone.
        position: [f64; 3], in COORDINATE "scene units";
        /// Direction of the cone's axis, in which the light travels.
        direction: [f64; 3], as Direction;
        /// Angle between the axis and the edge of the cone, outside of which there is no light.
        outer_angle: f64, in above(0.0, 180.0) "degrees";
        /// Angle between the axis and the edge of the inner cone, inside of which the light has
        /// its full intensity; at most `outer_angle`.
        inner_angle: f64 = 0.0, in closed(0.0, 180.0) "degrees";
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

/// Keys of the kinds of lights; each light has exactly one of them.
pub const KINDS: &[&str] =
    &["point", "directional", "spot", "sphere", "rectangle", "disk", "environment"];

/// Keys of a `[[light]]` table in scene files.
pub const FIELDS: &[Field] = Light::FIELDS;

impl Light {
    /// Returns the position of a point or spot light; `None` for any other light.
    pub fn apex(&self) -> Option<[f64; 3]> {
        self.point.map(|point| point.position).or(self.spot.map(|spot| spot.position))
    }

    /// Returns the direction in which a directional light travels, the axis of a spot light, or the
    /// normal of a rectangle or disk light; `None` for any other light.
    pub fn direction(&self) -> Option<[f64; 3]> {
        let directional = self.directional.map(|sun| sun.direction);
        let rectangle = self.rectangle.map(|rectangle| rectangle.normal);
        let flat = rectangle.or(self.disk.map(|disk| disk.normal));
        directional.or(self.spot.map(|spot| spot.direction)).or(flat)
    }

    /// Returns [`Light::direction`] as a mutable reference.
    pub fn direction_mut(&mut self) -> Option<&mut [f64; 3]> {
        let directional = self.directional.as_mut().map(|sun| &mut sun.direction);
        let rectangle = self.rectangle.as_mut().map(|rectangle| &mut rectangle.normal);
        let flat = rectangle.or(self.disk.as_mut().map(|disk| &mut disk.normal));
        directional.or(self.spot.as_mut().map(|spot| &mut spot.direction)).or(flat)
    }

    /// Returns the validation errors of the light's keys and values.
    pub fn faults(&self) -> Vec<ValidationError> {
        let kinds = self.kinds();
        let kind_fault = match &kinds[..] {
            [_] => None,
            [] => Some(ValidationError::new(
                "",
                "the light has no kind",
                "one of point, directional, spot, sphere, rectangle, disk and environment, such as \
                 point = { position = [2.0, 4.0, 3.0] }",
            )),
            [first, second, ..] => Some(ValidationError::new(
                second,
                format!("both {first} and {second} are given"),
                "exactly one kind; a second light needs its own [[light]]",
            )),
        };
        let falls_off = kinds == ["point"] || kinds == ["spot"];
        let has_size = self.surface().is_some();
        let other_fault = if kind_fault.is_some() {
            None
        } else if self.falloff == Falloff::InverseSquare && !falls_off {
            Some(ValidationError::new(
                "falloff",
                "falloff is \"inverse-square\", but only a point or spot light has a falloff",
                "falloff \"none\", or a point or spot light",
            ))
        } else if self.unit == LightUnit::Power && !has_size {
            Some(ValidationError::new(
                "unit",
                "unit is \"power\", but only a sphere, rectangle or disk has one",
                "unit \"radiance\", or a light with a size",
            ))
        } else if !self.visible && !has_size && self.environment.is_none() {
            Some(ValidationError::new(
                "visible",
                "visible is false, but no light of this kind is visible",
                "visible = true, or a sphere, rectangle, disk or environment",
            ))
        } else if let Some(Spot { inner_angle, outer_angle, .. }) =
            self.spot.filter(|spot| spot.inner_angle > spot.outer_angle)
        {
            Some(ValidationError::new(
                "spot.inner_angle",
                format!("inner_angle is {inner_angle}, but outer_angle is only {outer_angle}"),
                "an inner_angle of at most outer_angle; both are measured from the axis",
            ))
        } else {
            None
        };
        let file = self.environment.as_ref().and_then(Environment::fault);
        let file_fault = file.map(|fault| fault.prefixed("environment"));
        self.validator().and(kind_fault).and(other_fault).and(file_fault).errors()
    }

    /// Returns the names of the kinds (such as `point`) that the light has. A valid light has
    /// exactly one.
    pub fn kinds(&self) -> Vec<&'static str> {
        let given = [
            ("point", self.point.is_some()),
            ("directional", self.directional.is_some()),
            ("spot", self.spot.is_some()),
            ("sphere", self.sphere.is_some()),
            ("rectangle", self.rectangle.is_some()),
            ("disk", self.disk.is_some()),
            ("environment", self.environment.is_some()),
        ];
        given.into_iter().filter(|(_, given)| *given).map(|(name, _)| name).collect()
    }

    /// Returns the surface of a light with a size; `None` for any other light.
    pub fn surface(&self) -> Option<EmitterSurface> {
        let sphere = self.sphere.map(EmitterSurface::Sphere);
        let rectangle = self.rectangle.map(EmitterSurface::Rectangle);
        sphere.or(rectangle).or(self.disk.map(EmitterSurface::Disk))
    }

    /// Removes the kind of the light and its values, so that another kind can be set.
    pub fn clear_kind(&mut self) {
        (self.point, self.directional, self.spot) = (None, None, None);
        (self.sphere, self.rectangle, self.disk) = (None, None, None);
        self.environment = None;
    }

    /// Gives the light a surface of the kind `name` (`sphere`, `rectangle` or `disk`) with the
    /// given radius; the sides of a rectangle are 2 x `radius` long. `normal` is the normal of a
    /// rectangle or disk. `radius` is rounded to two significant digits. The coordinates of
    /// `center` are rounded to multiples of a power of ten that is at most 1e-4 x `radius`. If
    /// `name` is another word, the light is unchanged.
    pub fn set_surface(&mut self, name: &str, center: DVec3, normal: [f64; 3], radius: f64) {
        let center = center.map(|x| round_nice(x, radius)).to_array();
        let radius = round_significant(radius, 2);
        match name {
            "sphere" => self.sphere = Some(SphereLight { center, radius }),
            "rectangle" => {
                let size = [2.0 * radius; 2];
                self.rectangle = Some(RectangleLight { center, size, normal, up: area::up() });
            }
            "disk" => self.disk = Some(DiskLight { center, radius, normal }),
            _ => {}
        }
    }

    /// Returns the position of a point or spot light, or the centre of the surface of a light with
    /// a size. `None` for a directional or environment light.
    pub fn position(&self) -> Option<[f64; 3]> {
        self.apex().or(self.surface().map(|surface| surface.center().to_array()))
    }

    /// Returns the position of the light as a mutable reference. `None` for a directional or
    /// environment light.
    pub fn position_mut(&mut self) -> Option<&mut [f64; 3]> {
        let Self { point, spot, sphere, rectangle, disk, .. } = self;
        let point = point.as_mut().map(|point| &mut point.position);
        let point = point.or(spot.as_mut().map(|spot| &mut spot.position));
        let sphere = sphere.as_mut().map(|sphere| &mut sphere.center);
        let rectangle = rectangle.as_mut().map(|rectangle| &mut rectangle.center);
        point.or(sphere).or(rectangle).or(disk.as_mut().map(|disk| &mut disk.center))
    }
}

#[cfg(test)]
mod tests {
    use super::{Directional, Falloff, Light, Point, Spot};
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
        light.spot = Some(SPOT);
        assert_eq!(keys(&light), ["spot"]);
        light.directional = None;
        light.falloff = Falloff::InverseSquare;
        assert!(keys(&light).is_empty());
    }

    const SPOT: Spot = Spot {
        position: [0.0, 2.0, 0.0],
        direction: [0.0, -1.0, 0.0],
        outer_angle: 30.0,
        inner_angle: 30.0,
    };

    #[test]
    fn inner_cone_of_spot_is_inside_the_outer_cone() {
        let faults = |spot| keys(&Light { spot: Some(spot), ..Light::default() });
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
