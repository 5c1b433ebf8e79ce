//! Moving a camera by hand: orbit, pan, dolly, fly, look, roll, zoom, frame.
//!
//! Every function gives a new camera in the form of the old one (target or direction), its numbers
//! rounded to about a millionth of the distance to the pivot. What would be no camera (beyond the
//! coordinates, no distance left) leaves the old one. Turns are relative to `up`; the view never
//! comes nearer to it than 0.1 degrees.

use crate::camera::{Camera, ViewAngle};
use crate::value::{floor_log10, round_significant, rounded_to, unit};
use glam::DVec3;

/// The steepest view up or down, in degrees above or below the plane across `up`.
const STEEPEST: f64 = 89.9;
/// The narrowest and the widest opening angle that a zoom leads to, in degrees.
const ANGLES: [f64; 2] = [0.1, 170.0];

impl Camera {
    /// Unit vectors to the right, up in the picture, and forward; orthonormal also for a camera that
    /// has faults.
    pub fn frame(&self) -> [DVec3; 3] {
        let forward = self.view().unwrap_or(DVec3::NEG_Z);
        let up = unit(self.up).unwrap_or(DVec3::Y);
        let right = forward.cross(up).try_normalize();
        let right = right.unwrap_or_else(|| forward.any_orthonormal_vector());
        [right, right.cross(forward), forward]
    }

    /// Half the width and half the height of the picture at unit distance, for a picture `aspect`
    /// times as wide as high.
    pub fn half_size(&self, aspect: f64) -> [f64; 2] {
        let (_, degrees) = self.view_angle.key_degrees();
        let half = (0.5 * degrees).to_radians().tan();
        match self.view_angle {
            ViewAngle::Vertical(_) => [half * aspect, half],
            ViewAngle::Horizontal(_) => [half, half / aspect],
        }
    }

    /// Goes round the pivot, `right` degrees to the right and `up` degrees upwards, looking at it from
    /// the same distance. The pivot is the target, or `distance` ahead.
    pub fn orbit(&self, right: f64, up: f64, distance: f64) -> Self {
        let distance = self.reach(distance);
        // The view turns the other way than the eye goes.
        let Some(forward) = self.turned(-right, -up) else { return self.clone() };
        let pivot = DVec3::from_array(self.eye) + self.frame()[2] * distance;
        let pivot = self.target.map_or(pivot, DVec3::from_array);
        self.placed(pivot - forward * distance, forward, distance)
    }

    /// Moves across the view direction: to the right and up, in shares of the distance to the pivot
    /// (the target, or `distance` ahead).
    pub fn pan(&self, right: f64, up: f64, distance: f64) -> Self {
        let distance = self.reach(distance);
        let [x, y, _] = self.frame();
        self.shifted((x * right + y * up) * distance, distance)
    }

    /// Changes the distance to the pivot (the target, or `distance` ahead) by the factor `factor`: less
    /// than 1 is nearer. It never comes through the pivot.
    pub fn dolly(&self, factor: f64, distance: f64) -> Self {
        let old = self.reach(distance);
        if !(factor > 0.0 && factor.is_finite()) {
            return self.clone();
        }
        let forward = self.frame()[2];
        let eye = DVec3::from_array(self.eye);
        let pivot = self.target.map_or(eye + forward * old, DVec3::from_array);
        let new = old * factor;
        // Nearer than this, coordinates have no digits left for it.
        if new < 1e-6 * pivot.abs().max_element().max(1e-6) {
            return self.clone();
        }
        self.placed(pivot - forward * new, forward, new)
    }

    /// Moves by so many scene units to the right, up in the picture and forward; the target goes along.
    pub fn fly(&self, [right, up, ahead]: [f64; 3]) -> Self {
        let [x, y, z] = self.frame();
        let by = x * right + y * up + z * ahead;
        self.shifted(by, self.reach(by.length().max(1e-3)))
    }

    /// Turns the view in place, `right` degrees to the right and `up` degrees upwards. A target goes
    /// round the eye.
    pub fn look(&self, right: f64, up: f64) -> Self {
        let distance = self.reach(1.0);
        match self.turned(right, up) {
            Some(forward) => self.placed(DVec3::from_array(self.eye), forward, distance),
            None => self.clone(),
        }
    }

    /// Turns the camera about the view direction, `degrees` clockwise for one who looks through it.
    pub fn roll(&self, degrees: f64) -> Self {
        if !degrees.is_finite() {
            return self.clone();
        }
        let forward = self.frame()[2];
        let up = unit(self.up).unwrap_or(DVec3::Y);
        let (sin, cos) = degrees.to_radians().sin_cos();
        // Rodrigues' rotation about the view direction.
        let rolled = up * cos + forward.cross(up) * sin + forward * (forward.dot(up) * (1.0 - cos));
        let up = rolled.map(|x| rounded_to(x, -6)).to_array();
        self.sound(Self { up, ..self.clone() })
    }

    /// Multiplies the width of what is seen by `factor`: less than 1 is narrower.
    pub fn zoom(&self, factor: f64) -> Self {
        if !(factor > 0.0 && factor.is_finite()) {
            return self.clone();
        }
        let zoomed = |degrees: f64| {
            let half = (0.5 * degrees).to_radians().tan() * factor;
            let [narrow, wide] = ANGLES;
            let new = round_significant(2.0 * half.atan().to_degrees(), 4).clamp(narrow, wide);
            // An angle beyond the limits does not jump to them against the zoom.
            if (new < degrees) == (factor < 1.0) { new } else { degrees }
        };
        let view_angle = match self.view_angle {
            ViewAngle::Vertical(degrees) => ViewAngle::Vertical(zoomed(degrees)),
            ViewAngle::Horizontal(degrees) => ViewAngle::Horizontal(zoomed(degrees)),
        };
        self.sound(Self { view_angle, ..self.clone() })
    }

    /// Looks at `center` from the same side, from so far that a ball of `radius` around it fills a
    /// picture `aspect` times as wide as high, but for a small margin. A target becomes the centre.
    pub fn framed(&self, center: [f64; 3], radius: f64, aspect: f64) -> Self {
        let forward = self.frame()[2];
        let half = self.half_size(aspect).into_iter().fold(f64::INFINITY, f64::min).atan();
        let distance = 1.1 * radius / half.sin();
        if !(distance > 0.0 && distance.is_finite()) {
            return self.clone();
        }
        let center = DVec3::from_array(center).map(|x| rounded(x, distance));
        let mut aimed = self.clone();
        if aimed.target.is_some() {
            aimed.target = Some(center.to_array());
        }
        self.sound(aimed.put(center - forward * distance, forward, distance, false))
    }

    /// The distance to the pivot: the target's, or `distance`.
    fn reach(&self, distance: f64) -> f64 {
        let aimed = self.target.map(|t| DVec3::from_array(t) - DVec3::from_array(self.eye));
        let reach = aimed.map_or(distance, DVec3::length);
        if reach > 0.0 && reach.is_finite() { reach } else { 1.0 }
    }

    /// The view direction turned to the right and upwards, in degrees; `None` if that is no angle.
    fn turned(&self, right: f64, up: f64) -> Option<DVec3> {
        if !(right.is_finite() && up.is_finite()) {
            return None;
        }
        let axis = unit(self.up).unwrap_or(DVec3::Y);
        let [side, _, forward] = self.frame();
        // Forward, but level.
        let ahead = axis.cross(side);
        let pitch = forward.dot(axis).clamp(-1.0, 1.0).asin().to_degrees();
        let pitch = (pitch + up).clamp(-STEEPEST, STEEPEST).to_radians();
        let (sin, cos) = right.to_radians().sin_cos();
        let level = ahead * cos + side * sin;
        Some((level * pitch.cos() + axis * pitch.sin()).normalize())
    }

    /// At `eye`, looking `forward`, the target (if it has one) or the pivot `distance` ahead. What
    /// does not change keeps its digits.
    fn placed(&self, eye: DVec3, forward: DVec3, distance: f64) -> Self {
        let stays = DVec3::from_array(self.eye) == eye;
        self.sound(self.put(eye, forward, distance, stays))
    }

    fn put(&self, eye: DVec3, forward: DVec3, distance: f64, eye_stays: bool) -> Self {
        let mut next = self.clone();
        let round = |v: DVec3| v.map(|x| rounded(x, distance)).to_array();
        if let Some(direction) = next.direction {
            let length = DVec3::from_array(direction).length();
            let length = if length.is_normal() { length } else { 1.0 };
            next.direction = Some((forward * length).map(|x| rounded(x, length)).to_array());
        }
        if eye_stays {
            next.target = next.target.map(|_| round(eye + forward * distance));
        } else {
            next.eye = round(eye);
        }
        next
    }

    /// The eye, and the target if there is one, moved by the same vector.
    fn shifted(&self, by: DVec3, distance: f64) -> Self {
        let moved = |at: [f64; 3]| {
            let at = DVec3::from_array(at);
            std::array::from_fn(
                |i| if by[i] == 0.0 { at[i] } else { rounded(at[i] + by[i], distance) },
            )
        };
        let target = self.target.map(moved);
        self.sound(Self { eye: moved(self.eye), target, ..self.clone() })
    }

    /// `next` if it is a camera, otherwise this one.
    fn sound(&self, next: Self) -> Self {
        if next.faults().is_empty() { next } else { self.clone() }
    }
}

/// Rounded to about a millionth of `scale`.
fn rounded(x: f64, scale: f64) -> f64 {
    rounded_to(x, floor_log10(scale) - 6)
}
