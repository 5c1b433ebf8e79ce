//! Light from a rectangle.

use crate::light::{EmissiveSurface, Handles, LightDesc, LightForm, Placement, registry};
use crate::value::{description, unit};
use glam::DVec3;

description! {
    /// Light from one side of a rectangle, such as a window.
    pub struct RectangleLight: Copy {
        /// Centre of the rectangle.
        center: [f64; 3], in COORDINATE "scene units";
        /// Width and height of the rectangle; the height is along `up`.
        size: [f64; 2], in SIZE "scene units";
        /// Direction that the emitting side faces.
        normal: [f64; 3], as Direction;
        /// Direction of the height, made perpendicular to `normal`. If the two are parallel, the
        /// height is along z.
        up: [f64; 3] = [0.0, 1.0, 0.0], as Direction;
    }
}

/// Returns the unit vectors of the frame of a flat light: across, up and along `normal`. `up` is
/// made perpendicular to the normal. If the sine of their angle is at most 1e-6, the z axis replaces
/// `up`, or the x axis if the normal is also parallel to z.
pub(super) fn frame(normal: [f64; 3], up: [f64; 3]) -> [DVec3; 3] {
    let front = unit(normal).unwrap_or(DVec3::Z);
    let across = |up: DVec3| Some(up.cross(front)).filter(|across| across.length() > 1e-6);
    let right = unit(up).and_then(across).or(across(DVec3::Z)).or(across(DVec3::X));
    let right = right.unwrap_or(DVec3::X).normalize();
    [right, front.cross(right), front]
}

impl LightDesc for RectangleLight {
    fn form(&self) -> LightForm<'_> {
        let Self { center, size, normal, up } = *self;
        let axes = frame(normal, up);
        LightForm::Surface(EmissiveSurface::Rectangle { center: DVec3::from(center), axes, size })
    }

    fn handles(&mut self) -> Handles<'_> {
        Handles {
            position: Some(&mut self.center),
            direction: Some(&mut self.normal),
            up: Some(&mut self.up),
        }
    }

    fn place(&mut self, placement: &Placement) {
        let (center, radius) = registry::rounded_ball(placement);
        (self.center, self.size) = (center, [2.0 * radius; 2]);
        self.normal = placement.direction;
    }
}
