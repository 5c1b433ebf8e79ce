//! Camera: description in scene files, lens, navigation, and compiled form.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

mod compiled;
mod lens;
mod navigate;

pub use compiled::{CompiledCamera, ThinLens};
pub use lens::{Aperture, Focus};

use crate::TomlText;
use crate::value::{
    Description, Field, KeyNode, ValidationError, choices, description, one_of, unit,
};
use glam::DVec3;
use toml::Value;

description! {
    /// Camera: a pinhole, a thin lens with a plane in focus, or a panorama.
    pub struct Camera {
        /// Position of the camera.
        eye: [f64; 3] = [0.0, 1.0, 5.0], in COORDINATE "scene units";
        /// Point that the camera looks at. Exactly one of `target` and `direction` is given.
        target: Option<[f64; 3]>, or "`direction` is needed", in COORDINATE "scene units";
        /// View direction of the camera.
        direction: Option<[f64; 3]>, or "`target` is needed", as Direction;
        /// Up direction of the picture; not parallel to the view direction.
        up: [f64; 3] = [0.0, 1.0, 0.0], as Direction;
        /// Map from directions to the picture.
        projection: Projection = "perspective";
        /// Opening angle of the camera, across the height or across the width of the picture; without
        /// effect in a panorama.
        view_angle: ViewAngle => ViewAngle::Vertical(40.0), written "{ vertical = 40.0 }";
        /// Near plane: its distance along the view direction; surfaces in front of it are
        /// invisible.
        near: f64 = 0.0, in closed(0.0, 1e9) "scene units";
        /// Opening of the lens, for depth of field.
        aperture: Option<Aperture>, or "a pinhole: everything is in focus";
        /// Plane in focus, perpendicular to the view direction.
        focus: Option<Focus>, or "the plane through `target`";
    }
}

choices! {
    /// Map from directions to the picture.
    pub enum Projection {
        /// picture plane in front of the eye
        Perspective = "perspective",
        /// panorama of all directions: columns are angles around the camera's upward axis, rows are angles
        /// from it, as in images of environments. Its film is usually twice as wide as high. It has no
        /// near plane and no lens
        Equirectangular = "equirectangular",
    }
}

one_of! {
    #[derive(Copy)]
    /// Opening angle of the camera in degrees, between 0 and 180.
    pub enum ViewAngle {
        /// Across the picture's height.
        Vertical(f64) = "vertical", in between(0.0, 180.0) "degrees";
        /// Across the picture's width.
        Horizontal(f64) = "horizontal", in between(0.0, 180.0) "degrees";
    }
}

/// Keys of the `[camera]` table in scene files.
pub const FIELDS: &[Field] = Camera::FIELDS;

impl ViewAngle {
    /// Returns the angle in degrees.
    pub fn degrees(&self) -> f64 {
        let (Self::Vertical(degrees) | Self::Horizontal(degrees)) = *self;
        degrees
    }
}

impl Camera {
    /// Returns the camera of a scene file without a `[camera]` table.
    pub fn at_origin() -> Self {
        Self { target: Some([0.0; 3]), ..Self::default() }
    }

    /// Returns the unit vector of the view direction; `None` if the camera does not define one.
    pub fn view(&self) -> Option<DVec3> {
        let look = match (self.target, self.direction) {
            (Some(target), None) => DVec3::from_array(target) - DVec3::from_array(self.eye),
            (None, Some(direction)) => DVec3::from_array(direction),
            _ => return None,
        };
        unit(look)
    }

    /// Formats the camera as the value of the key `camera` in a scene file, in one line.
    pub fn to_inline_table(&self) -> String {
        Value::Table(self.to_table()).to_string()
    }

    /// Returns the validation errors.
    pub fn faults(&self) -> Vec<ValidationError> {
        let given = match (&self.target, &self.direction) {
            (None, None) => Some(ValidationError::new(
                "",
                "neither target nor direction is given",
                "exactly one of them, such as target = [0.0, 0.0, 0.0]",
            )),
            (Some(_), Some(_)) => Some(ValidationError::new(
                "direction",
                "both target and direction are given",
                "exactly one of them",
            )),
            _ => None,
        };
        let checks = self.validator().and(given).and(self.projection_error());
        if !checks.is_clean() {
            return checks.errors();
        }
        checks.and(self.orientation_error()).and(self.focus_error()).errors()
    }

    /// Returns a validation error if a panorama has a near plane or a lens.
    fn projection_error(&self) -> Option<ValidationError> {
        let given = [
            ("near", self.near != 0.0),
            ("aperture", self.aperture.is_some()),
            ("focus", self.focus.is_some()),
        ];
        let (key, _) = given.into_iter().find(|(_, is_given)| *is_given)?;
        (self.projection == Projection::Equirectangular).then(|| {
            ValidationError::new(
                key,
                format!("{key} is given, but the projection is equirectangular"),
                "projection = \"perspective\", or neither near nor aperture nor focus",
            )
        })
    }

    /// Returns a validation error if the target is the eye, or if `up` is parallel to the view
    /// direction. All numbers must be in range.
    fn orientation_error(&self) -> Option<ValidationError> {
        let Some(view) = self.view() else {
            return Some(ValidationError::new(
                "target",
                "target is the eye itself, which leaves no direction to look in",
                "a target away from the eye",
            ));
        };
        let up = unit(self.up)?;
        // If the sine of the angle is 1e-6 or less, rounding errors would determine the picture's
        // axes.
        (view.cross(up).length() <= 1e-6).then(|| {
            ValidationError::new(
                "up",
                "up is parallel to the view direction, which leaves the orientation of the picture undefined",
                "an `up` across the view direction, such as [0.0, 0.0, -1.0] when looking down",
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::{Aperture, Camera, Focus, Projection, ViewAngle};

    fn keys(camera: &Camera) -> Vec<String> {
        camera.faults().into_iter().map(|f| f.key).collect()
    }

    #[test]
    fn camera_ranges_are_checked() {
        let camera = Camera {
            eye: [f64::INFINITY, 0.0, 0.0],
            target: Some([f64::NAN; 3]),
            direction: Some([0.0; 3]),
            up: [0.0; 3],
            view_angle: ViewAngle::Vertical(180.0),
            near: -1.0,
            projection: Projection::Perspective,
            aperture: None,
            focus: None,
        };
        assert_eq!(
            keys(&camera),
            ["eye", "target", "direction", "up", "view_angle.vertical", "near", "direction"]
        );
        for degrees in [0.0, 180.0, -1.0, f64::NAN] {
            let view_angle = ViewAngle::Horizontal(degrees);
            let camera = Camera { view_angle, ..Camera::at_origin() };
            assert_eq!(keys(&camera), ["view_angle.horizontal"], "{degrees}");
        }
    }

    #[test]
    fn panorama_has_no_lens() {
        let panorama = Camera { projection: Projection::Equirectangular, ..Camera::at_origin() };
        assert_eq!(keys(&panorama), [""; 0]);
        let (aperture, focus) = (Some(Aperture::Radius(0.1)), Some(Focus::Distance(2.0)));
        assert_eq!(keys(&Camera { aperture, ..panorama.clone() }), ["aperture"]);
        assert_eq!(keys(&Camera { near: 0.1, focus, ..panorama }), ["near"]);
    }

    #[test]
    fn camera_needs_direction_and_up_across_it() {
        let camera = Camera::at_origin();
        assert!(keys(&camera).is_empty());
        assert_eq!(keys(&Camera { target: None, ..camera.clone() }), [""]);
        assert_eq!(keys(&Camera { target: Some(camera.eye), ..camera.clone() }), ["target"]);
        for sign in [1.0, -1e-200] {
            let direction = Some([0.0, sign, 0.0]);
            assert_eq!(keys(&Camera { target: None, direction, ..camera.clone() }), ["up"]);
        }
        let direction = Some([0.0, -1.0, 1e-3]);
        assert!(keys(&Camera { target: None, direction, ..camera }).is_empty());
    }
}
