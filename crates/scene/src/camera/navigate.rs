//! Interactive camera movements.
//!
//! Each movement returns a new camera, or the old one if the new one would be invalid. The pivot is
//! the target, or a point `distance` ahead if the camera has no target. Coordinates are rounded to
//! about a millionth of the distance between eye and pivot. Rotations are relative to `up`; the
//! view direction stays at least 0.1 degrees away from it.

use crate::camera::{Camera, Projection, ViewAngle};
use crate::value::{round_fine, round_significant, rounded_to, unit};
use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};

/// Steepest view up or down, in degrees from the plane perpendicular to `up`.
const MAX_PITCH: f64 = 89.9;
/// Smallest and largest opening angle of interactive zoom, in degrees.
const ZOOM_ANGLES: [f64; 2] = [0.1, 170.0];

impl Camera {
    /// Returns the axes: unit vectors to the right, up in the picture, and forward. They are also
    /// defined for an invalid camera.
    pub fn frame(&self) -> [DVec3; 3] {
        let forward = self.view().unwrap_or(DVec3::NEG_Z);
        let up = unit(self.up).unwrap_or(DVec3::Y);
        let right = forward.cross(up).try_normalize();
        let right = right.unwrap_or_else(|| forward.any_orthonormal_vector());
        [right, right.cross(forward), forward]
    }

    /// Returns half the width and half the height of the picture, on the picture plane at unit
    /// distance. `width` and `height` are in any unit.
    pub fn half_size(&self, [width, height]: [f64; 2]) -> [f64; 2] {
        let degrees = self.view_angle.degrees();
        let half = (0.5 * degrees).to_radians().tan();
        match self.view_angle {
            ViewAngle::Vertical(_) => [half * width / height, half],
            ViewAngle::Horizontal(_) => [half, half * height / width],
        }
    }

    /// Returns a vector from the eye through a point of the picture, a column and a row as fractions of
    /// its `size` from the upper left corner. Its component along the view is 1 in a perspective.
    pub fn direction_at(&self, [x, y]: [f64; 2], size: [f64; 2]) -> DVec3 {
        let [right, up, forward] = self.frame();
        match self.projection {
            Projection::Perspective => {
                let [half_width, half_height] = self.half_size(size);
                forward + right * (half_width * (2.0 * x - 1.0))
                    - up * (half_height * (2.0 * y - 1.0))
            }
            Projection::Equirectangular => {
                let ((s, c), (sin, cos)) = ((TAU * (x - 0.5)).sin_cos(), (PI * y).sin_cos());
                (right * s + forward * c) * sin + up * cos
            }
        }
    }

    /// Orbits around the pivot, `right` degrees to the right and `up` degrees upwards.
    pub fn orbit(&self, right: f64, up: f64, distance: f64) -> Self {
        let distance = self.pivot_distance(distance);
        // If the eye moves to the right around the pivot, the view direction rotates to the left.
        let Some(forward) = self.rotated(-right, -up) else { return self.clone() };
        let pivot = DVec3::from_array(self.eye) + self.frame()[2] * distance;
        let pivot = self.target.map_or(pivot, DVec3::from_array);
        self.placed(pivot - forward * distance, forward, distance)
    }

    /// Moves the eye and the target to the right and up, by fractions of the distance to the pivot.
    pub fn pan(&self, right: f64, up: f64, distance: f64) -> Self {
        let distance = self.pivot_distance(distance);
        let [x, y, _] = self.frame();
        self.shifted((x * right + y * up) * distance, distance)
    }

    /// Multiplies the distance to the pivot by `factor`.
    pub fn dolly(&self, factor: f64, distance: f64) -> Self {
        let old = self.pivot_distance(distance);
        if !(factor > 0.0 && factor.is_finite()) {
            return self.clone();
        }
        let forward = self.frame()[2];
        let eye = DVec3::from_array(self.eye);
        let pivot = self.target.map_or(eye + forward * old, DVec3::from_array);
        let new = old * factor;
        // Nearer to the pivot, coordinates would have too little precision.
        if new < 1e-6 * pivot.abs().max_element().max(1e-6) {
            return self.clone();
        }
        self.placed(pivot - forward * new, forward, new)
    }

    /// Moves the eye and the target by `right`, `up` (in the picture) and `ahead`, in scene units.
    pub fn fly(&self, [right, up, ahead]: [f64; 3]) -> Self {
        let [x, y, z] = self.frame();
        let translation = x * right + y * up + z * ahead;
        self.shifted(translation, self.pivot_distance(translation.length().max(1e-3)))
    }

    /// Rotates the view about the eye, `right` degrees to the right and `up` degrees upwards. A
    /// target moves on a circle around the eye.
    pub fn look(&self, right: f64, up: f64) -> Self {
        let distance = self.pivot_distance(1.0);
        match self.rotated(right, up) {
            Some(forward) => self.placed(DVec3::from_array(self.eye), forward, distance),
            None => self.clone(),
        }
    }

    /// Rolls the camera about the view direction, `degrees` clockwise as seen by the camera.
    pub fn roll(&self, degrees: f64) -> Self {
        if !degrees.is_finite() {
            return self.clone();
        }
        let forward = self.frame()[2];
        let up = unit(self.up).unwrap_or(DVec3::Y);
        let rolled = DMat3::from_axis_angle(forward, degrees.to_radians()) * up;
        let up = rolled.map(|x| rounded_to(x, -6)).to_array();
        self.valid_or_self(Self { up, ..self.clone() })
    }

    /// Multiplies the width of the picture plane at unit distance by `factor`; below 1 narrows the
    /// view.
    pub fn zoom(&self, factor: f64) -> Self {
        if !(factor > 0.0 && factor.is_finite()) {
            return self.clone();
        }
        let zoomed = |degrees: f64| {
            let half = (0.5 * degrees).to_radians().tan() * factor;
            let [narrow, wide] = ZOOM_ANGLES;
            let new = round_significant(2.0 * half.atan().to_degrees(), 4).clamp(narrow, wide);
            // Clamping an angle outside the limits would change it in the direction opposite to the
            // zoom.
            if (new < degrees) == (factor < 1.0) { new } else { degrees }
        };
        let view_angle = match self.view_angle {
            ViewAngle::Vertical(degrees) => ViewAngle::Vertical(zoomed(degrees)),
            ViewAngle::Horizontal(degrees) => ViewAngle::Horizontal(zoomed(degrees)),
        };
        self.valid_or_self(Self { view_angle, ..self.clone() })
    }

    /// Moves the eye along the view direction so that the sphere of `radius` around `center` fills
    /// the picture of the given width and height, with a margin of 10 %. A target becomes `center`.
    pub fn framed(&self, center: [f64; 3], radius: f64, size: [f64; 2]) -> Self {
        let forward = self.frame()[2];
        let half = self.half_size(size).into_iter().fold(f64::INFINITY, f64::min).atan();
        let distance = 1.1 * radius / half.sin();
        if !(distance > 0.0 && distance.is_finite()) {
            return self.clone();
        }
        let center = DVec3::from_array(center).map(|x| round_fine(x, distance));
        let mut aimed = self.clone();
        if aimed.target.is_some() {
            aimed.target = Some(center.to_array());
        }
        self.valid_or_self(aimed.placed(center - forward * distance, forward, distance))
    }

    /// Returns the distance to the target, or `distance` if there is no target. If that is not
    /// positive and finite, returns 1.
    fn pivot_distance(&self, distance: f64) -> f64 {
        let to_target = self.target.map(|t| DVec3::from_array(t) - DVec3::from_array(self.eye));
        let distance = to_target.map_or(distance, DVec3::length);
        if distance > 0.0 && distance.is_finite() { distance } else { 1.0 }
    }

    /// Returns the view direction rotated by angles in degrees; `None` if an angle is not finite.
    fn rotated(&self, right: f64, up: f64) -> Option<DVec3> {
        if !(right.is_finite() && up.is_finite()) {
            return None;
        }
        let axis = unit(self.up).unwrap_or(DVec3::Y);
        let [side, _, forward] = self.frame();
        // View direction without its component along `up`.
        let ahead = axis.cross(side);
        let pitch = forward.dot(axis).clamp(-1.0, 1.0).asin().to_degrees();
        let pitch = (pitch + up).clamp(-MAX_PITCH, MAX_PITCH).to_radians();
        let (sin, cos) = right.to_radians().sin_cos();
        let level = ahead * cos + side * sin;
        Some((level * pitch.cos() + axis * pitch.sin()).normalize())
    }

    /// Returns the camera at `eye` with the view direction `forward`. If the eye stays, the target
    /// moves to the point `distance` ahead.
    fn placed(&self, eye: DVec3, forward: DVec3, distance: f64) -> Self {
        let mut next = self.clone();
        let round = |v: DVec3| v.map(|x| round_fine(x, distance)).to_array();
        if let Some(direction) = next.direction {
            let length = DVec3::from_array(direction).length();
            let length = if length.is_normal() { length } else { 1.0 };
            next.direction = Some((forward * length).map(|x| round_fine(x, length)).to_array());
        }
        if DVec3::from_array(self.eye) == eye {
            next.target = next.target.map(|_| round(eye + forward * distance));
        } else {
            next.eye = round(eye);
        }
        self.valid_or_self(next)
    }

    /// Returns the camera with eye and target moved by `translation`. Changed coordinates are
    /// rounded to a fine fraction of `distance`. An invalid result is discarded.
    fn shifted(&self, translation: DVec3, distance: f64) -> Self {
        let moved = |point: [f64; 3]| {
            std::array::from_fn(|i| match translation[i] {
                0.0 => point[i],
                by => round_fine(point[i] + by, distance),
            })
        };
        let target = self.target.map(moved);
        self.valid_or_self(Self { eye: moved(self.eye), target, ..self.clone() })
    }

    /// Returns `next` if it is valid, otherwise `self`.
    fn valid_or_self(&self, next: Self) -> Self {
        if next.faults().is_empty() { next } else { self.clone() }
    }
}
