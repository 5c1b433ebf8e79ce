//! The camera, compiled: rays from pixels.

use crate::camera::{Camera, ViewAngle};
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::value::unit;
use glam::DVec3;

/// A pinhole camera with its raster. Directions of pixels are computed in double precision and
/// rounded once; only the offset inside the pixel is computed in the kernel's.
#[derive(Clone, Copy, Debug)]
pub struct PinholeCamera {
    eye: DVec3,
    /// Right, up and forward, orthonormal.
    u: DVec3,
    v: DVec3,
    w: DVec3,
    /// Per pixel to the right and downward, on the picture plane at unit distance.
    dx_axis: DVec3,
    dy_axis: DVec3,
    /// The picture plane's corner above pixel (0, 0), seen from the eye.
    raster_corner: DVec3,
    near: f64,
}

impl PinholeCamera {
    /// Compiles `camera` for a film of `width` x `height` pixels, in a scene shifted so that `origin`
    /// becomes zero.
    ///
    /// If `up` is parallel to the view direction (a scene file cannot say that), the axis least
    /// parallel to it takes its place.
    pub fn new(camera: &Camera, [width, height]: [u32; 2], origin: DVec3) -> Self {
        let eye = DVec3::from(camera.eye);
        let look = match (camera.direction, camera.target) {
            (Some(direction), _) => DVec3::from(direction),
            (None, Some(target)) => DVec3::from(target) - eye,
            (None, None) => DVec3::NEG_Z,
        };
        let w = unit(look).unwrap_or(DVec3::NEG_Z);
        let up = unit(camera.up).unwrap_or(DVec3::Y);
        let mut u = w.cross(up);
        if u.length() <= 1e-6 {
            let a = w.abs();
            let least = if a.x <= a.y && a.x <= a.z {
                DVec3::X
            } else if a.y <= a.z {
                DVec3::Y
            } else {
                DVec3::Z
            };
            u = w.cross(least);
        }
        let u = u.normalize();
        let v = u.cross(w);
        let (width, height) = (f64::from(width), f64::from(height));
        // Half the size of the picture at unit distance.
        let (half_width, half_height) = match camera.view_angle {
            ViewAngle::Vertical(degrees) => {
                let half = (0.5 * degrees).to_radians().tan();
                (half * width / height, half)
            }
            ViewAngle::Horizontal(degrees) => {
                let half = (0.5 * degrees).to_radians().tan();
                (half, half * height / width)
            }
        };
        Self {
            eye: eye - origin,
            u,
            v,
            w,
            dx_axis: u * (2.0 * half_width / width),
            dy_axis: -v * (2.0 * half_height / height),
            raster_corner: w - u * half_width + v * half_height,
            near: camera.near,
        }
    }

    /// The eye.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// Right, up and forward, orthonormal.
    pub fn frame(&self) -> [DVec3; 3] {
        [self.u, self.v, self.w]
    }

    /// The smallest angle between the rays through the middles of neighbouring pixels \[radians\]: at the
    /// picture's corners, where pixels look smallest.
    pub fn pixel_angle(&self) -> f64 {
        // At the distance d along the ray a step across it by p turns the ray by about p / d, and one
        // aslant by no less than p / d^2.
        self.pixel() / self.raster_corner.length_squared()
    }

    /// Side of a pixel on the picture plane at unit distance; of an oblong one the smaller.
    pub fn pixel(&self) -> f64 {
        self.dx_axis.length().min(self.dy_axis.length())
    }

    /// From the eye to the corners of a rectangle of the raster, on the picture plane at unit distance.
    pub fn corners(&self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> [DVec3; 4] {
        let (x0, y0) = (x as f64, y as f64);
        let (x1, y1) = (x0 + width as f64, y0 + height as f64);
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
            .map(|(x, y)| self.raster_corner + self.dx_axis * x + self.dy_axis * y)
    }

    /// Where a point in front of the eye is seen on the raster \[pixels\].
    pub fn project(&self, point: DVec3) -> [f64; 2] {
        let to = point - self.eye;
        let on_plane = to / to.dot(self.w) - self.raster_corner;
        [self.dx_axis, self.dy_axis].map(|pixel| on_plane.dot(pixel) / pixel.length_squared())
    }

    /// From the eye to the corner of a pixel, on the plane at unit distance.
    #[inline(always)]
    pub fn pixel_corner_direction<S: Float>(&self, (x, y): (u32, u32)) -> [S; 3] {
        let raster_corner =
            self.raster_corner + self.dx_axis * f64::from(x) + self.dy_axis * f64::from(y);
        raster_corner.to_array().map(S::from_f64)
    }

    /// Origins and unit directions of rays through points of pixels: `base` as [`PinholeCamera::pixel_corner_direction`] gives it, `(dx,
    /// dy)` from there to the right and downward \[pixels\]. They begin on the near plane.
    #[inline(always)]
    pub fn rays<L: SimdFloat>(&self, base: Vec3<L>, (dx, dy): (L, L)) -> (Vec3<L>, Vec3<L>) {
        let dx_axis = Vec3::of(self.dx_axis.to_array());
        let dy_axis = Vec3::of(self.dy_axis.to_array());
        let pixel_corner_direction = dx_axis.mul_add(dx, dy_axis.mul_add(dy, base));
        let eye = Vec3::of(self.eye.to_array());
        // At unit distance along w, `pixel_corner_direction` reaches the plane at distance `near` after `near` steps.
        let origin = if self.near > 0.0 {
            pixel_corner_direction.mul_add(L::from_f64(self.near), eye)
        } else {
            eye
        };
        (origin, pixel_corner_direction.normalize())
    }
}
