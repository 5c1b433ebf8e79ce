//! Description of a thin lens: its aperture and the plane in focus.

use crate::camera::{Camera, ViewAngle};
use crate::value::{ValidationError, one_of};
use glam::DVec3;

one_of! {
    #[derive(Copy)]
    /// Aperture of the camera's lens, given by its radius or its f-number. The blur of objects
    /// outside of the plane in focus is in proportion to the radius.
    pub enum Aperture {
        /// Radius of the lens; 0 is a pinhole.
        Radius(f64) = "radius", in closed(0.0, MAX_RADIUS) "scene units";
        /// Focal length divided by the diameter of the lens, for film of 36 x 24 mm and scene units
        /// of 1 m.
        FNumber(f64) = "f_number", in closed(0.01, 1e9);
    }
}

one_of! {
    #[derive(Copy)]
    /// Plane in focus of the camera's lens, perpendicular to the view direction. It is given by its
    /// distance or by a point.
    pub enum Focus {
        /// Distance from the eye along the view direction.
        Distance(f64) = "distance", in SIZE "scene units";
        /// A point that is in focus; the plane contains it.
        Point([f64; 3]) = "point", in COORDINATE "scene units";
    }
}

/// Largest valid lens radius, in scene units.
const MAX_RADIUS: f64 = 1e9;

/// Smallest distance of the plane in focus from the eye, as a fraction of the lens radius.
const MIN_FOCUS_PER_RADIUS: f64 = 1e-6;

/// Half the height of the picture on film of 36 x 24 mm \[m\].
const HALF_FILM_HEIGHT: f64 = 0.012;
/// Half the width of the picture on film of 36 x 24 mm \[m\].
const HALF_FILM_WIDTH: f64 = 0.018;

impl Camera {
    /// Returns this camera with the projection, the near plane, the aperture and the focus of `other`.
    pub fn with_lens_of(&self, other: &Self) -> Self {
        let Self { projection, near, aperture, focus, .. } = *other;
        Self { projection, near, aperture, focus, ..self.clone() }
    }

    /// Returns the radius of the lens in scene units, 0 to 1e9; 0 is a pinhole. A lens of the focal
    /// length f and the f-number N has the radius f / (2 N).
    pub fn lens_radius(&self) -> f64 {
        match self.aperture {
            None => 0.0,
            Some(Aperture::Radius(radius)) => radius,
            Some(Aperture::FNumber(number)) => {
                (self.focal_length() / (2.0 * number)).min(MAX_RADIUS)
            }
        }
    }

    /// Returns the focal length h / tan(angle / 2) in metres, where h is half the height or width
    /// of the film.
    pub fn focal_length(&self) -> f64 {
        let half = match self.view_angle {
            ViewAngle::Vertical(_) => HALF_FILM_HEIGHT,
            ViewAngle::Horizontal(_) => HALF_FILM_WIDTH,
        };
        half / (0.5 * self.view_angle.degrees()).to_radians().tan()
    }

    /// Returns the distance of the plane in focus from the eye along the view direction, greater
    /// than 0. Without `focus`, the plane goes through the target. A point behind the eye counts as
    /// in front of it. The result is at least a millionth of the lens radius and of the distance of
    /// the point.
    pub fn focus_depth(&self) -> f64 {
        let point = match (self.focus, self.target) {
            (Some(Focus::Distance(distance)), _) => Err(distance),
            (Some(Focus::Point(point)), _) | (None, Some(point)) => Ok(point),
            // Without an aperture the distance has no effect.
            (None, None) => Err(1.0),
        };
        let depth = point.map_or_else(
            |distance| distance,
            |point| {
                let from_eye = DVec3::from_array(point) - DVec3::from_array(self.eye);
                let along = from_eye.dot(self.view().unwrap_or(DVec3::NEG_Z)).abs();
                along.max(1e-6 * from_eye.length())
            },
        );
        depth.max(MIN_FOCUS_PER_RADIUS * self.lens_radius()).max(f64::MIN_POSITIVE)
    }

    /// Returns a validation error if the point in focus is the eye, or if an open lens has no plane
    /// in focus.
    pub(super) fn focus_error(&self) -> Option<ValidationError> {
        if self.focus == Some(Focus::Point(self.eye)) {
            return Some(ValidationError::new(
                "focus.point",
                "focus.point is the eye itself",
                "a point away from the eye",
            ));
        }
        let blurs = self.lens_radius() > 0.0 && self.focus.is_none() && self.target.is_none();
        blurs.then(|| {
            ValidationError::new(
                "aperture",
                "aperture is open, but neither target nor focus gives a plane in focus",
                "focus.distance, such as focus.distance = 5.0, or focus.point",
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn errors(camera: &Camera) -> Vec<String> {
        camera.faults().into_iter().map(|error| error.key).collect()
    }

    #[test]
    fn lens_radius_follows_from_f_number_and_view_angle() {
        let with = |view_angle, aperture| Camera {
            view_angle,
            aperture: Some(aperture),
            ..Camera::at_origin()
        };
        // A lens of 50 mm at f/2 has a radius of 12.5 mm. Both view angles below give the focal
        // length of 50 mm: across the 24 mm side and across the 36 mm side of the film.
        let degrees = |half: f64| 2.0 * (half / 0.05f64).atan().to_degrees();
        for view_angle in
            [ViewAngle::Vertical(degrees(0.012)), ViewAngle::Horizontal(degrees(0.018))]
        {
            let camera = with(view_angle, Aperture::FNumber(2.0));
            assert!((camera.lens_radius() - 0.0125).abs() < 1e-15, "{}", camera.lens_radius());
        }
        assert_eq!(with(ViewAngle::Vertical(40.0), Aperture::Radius(0.3)).lens_radius(), 0.3);
        assert_eq!(Camera::at_origin().lens_radius(), 0.0);
        let tele = with(ViewAngle::Vertical(1e-300), Aperture::FNumber(1.0));
        assert_eq!(tele.lens_radius(), 1e9);
    }

    #[test]
    fn plane_in_focus_is_perpendicular_to_the_view() {
        let camera = Camera {
            eye: [1.0, 2.0, 3.0],
            target: Some([1.0, 2.0, -1.0]),
            aperture: Some(Aperture::Radius(0.1)),
            ..Camera::at_origin()
        };
        let focused = |focus| Camera { focus: Some(focus), ..camera.clone() }.focus_depth();
        assert_eq!(camera.focus_depth(), 4.0);
        assert_eq!(focused(Focus::Distance(7.0)), 7.0);
        assert_eq!(focused(Focus::Point([9.0, -5.0, 1.0])), 2.0);
        assert_eq!(focused(Focus::Point([0.0, 0.0, 5.5])), 2.5);
        assert!((focused(Focus::Point([1.0, 7.0, 3.0])) - 5e-6).abs() < 1e-12);
        assert_eq!(focused(Focus::Distance(1e-300)), 1e-7);
    }

    #[test]
    fn lens_ranges_are_checked() {
        let camera = Camera { aperture: Some(Aperture::Radius(0.1)), ..Camera::at_origin() };
        assert_eq!(errors(&camera), [""; 0]);
        let unfocused =
            Camera { target: None, direction: Some([0.0, 0.0, -1.0]), ..camera.clone() };
        assert_eq!(errors(&unfocused), ["aperture"]);
        let pinhole = Camera { aperture: Some(Aperture::Radius(0.0)), ..unfocused.clone() };
        assert_eq!(errors(&pinhole), [""; 0]);
        let distance = Some(Focus::Distance(2.0));
        assert_eq!(errors(&Camera { focus: distance, ..unfocused }), [""; 0]);
        for (aperture, focus, key) in [
            (Aperture::Radius(-1.0), None, "aperture.radius"),
            (Aperture::Radius(f64::NAN), None, "aperture.radius"),
            (Aperture::FNumber(0.0), None, "aperture.f_number"),
            (Aperture::Radius(0.1), Some(Focus::Distance(0.0)), "focus.distance"),
            (Aperture::Radius(0.1), Some(Focus::Point([f64::INFINITY; 3])), "focus.point"),
            (Aperture::Radius(0.1), Some(Focus::Point(camera.eye)), "focus.point"),
        ] {
            let camera = Camera { aperture: Some(aperture), focus, ..camera.clone() };
            assert_eq!(errors(&camera), [key], "{aperture:?} {focus:?}");
        }
    }
}
