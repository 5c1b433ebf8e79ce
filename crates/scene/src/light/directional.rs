//! Directional light: parallel rays, or a sun with an angular diameter.
//!
//! A sun is a disk at an infinite distance with the angular radius a and the same radiance in all of
//! its directions. Its irradiance on a surface that faces its centre is pi sin^2(a) times the
//! radiance. The radiance is chosen so that this irradiance does not depend on a.

use crate::light::{Handles, LightDesc, LightForm, Placement};
use crate::value::{KeyNode, ValidationError, description, number, unit};
use glam::DVec3;

/// Smallest angular diameter of a sun \[degrees\]. Rounding of directions to single precision
/// changes the solid angle of such a sun by 0.2 %.
const MIN_ANGLE: f64 = 0.01;

description! {
    /// Light from infinitely far away, such as the sun.
    pub struct Directional: Copy {
        /// Direction in which the light travels.
        direction: [f64; 3], as Direction;
        /// Angular diameter of the light, which is a disk for the camera and for mirrors; 0 for
        /// parallel rays, otherwise at least 0.01. That of the sun is 0.53. It blurs shadows and
        /// keeps the brightness of surfaces that face the light.
        angle: f64 = 0.0, in closed(0.0, 180.0) "degrees";
    }
}

impl Directional {
    /// Creates parallel rays in the given direction.
    pub fn along(direction: [f64; 3]) -> Self {
        Self { direction, angle: 0.0 }
    }
}

impl LightDesc for Directional {
    fn form(&self) -> LightForm<'_> {
        LightForm::Distant {
            wi: -unit(self.direction).unwrap_or(DVec3::NEG_Y),
            radius: 0.5 * self.angle.to_radians(),
        }
    }

    /// Refuses angles that single precision cannot resolve.
    fn faults(&self) -> Vec<ValidationError> {
        let angle = self.angle;
        let is_narrow = angle > 0.0 && angle < MIN_ANGLE;
        let fault = is_narrow.then(|| {
            ValidationError::new(
                "angle",
                format!("angle is {}", number(angle)),
                format!("0, or a number from {MIN_ANGLE} to 180"),
            )
        });
        self.validator().and(fault).errors()
    }

    fn usual_name(&self) -> &'static str {
        "sun"
    }

    fn handles(&mut self) -> Handles<'_> {
        Handles { direction: Some(&mut self.direction), ..Handles::default() }
    }

    fn place(&mut self, placement: &Placement) {
        self.direction = placement.direction;
    }
}
