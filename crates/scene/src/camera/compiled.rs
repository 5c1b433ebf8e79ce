//! Compiled camera: rays through pixels.

use crate::camera::{Camera, Projection};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};

/// Camera compiled for a film size. Directions to corners of pixels are computed in double
/// precision, offsets inside a pixel in the precision of the rays. The picture plane of a panorama
/// is that of longitude x, from the view direction to the right, and polar angle y, in radians.
#[derive(Clone, Copy, Debug)]
pub struct CompiledCamera {
    /// Position of the eye relative to the `origin` of [`CompiledCamera::new`].
    pub eye: DVec3,
    /// Unit vectors to the right, up in the picture, and forward.
    pub frame: [DVec3; 3],
    projection: Projection,
    /// Vector to the next pixel to the right, on the picture plane at unit distance.
    dx_axis: DVec3,
    dy_axis: DVec3,
    /// Vector from the eye to the picture's upper left corner, on the picture plane.
    raster_corner: DVec3,
    near: f64,
    /// Thin lens of the camera; `None` for a pinhole.
    pub lens: Option<ThinLens>,
}

/// Thin lens: a disk around the eye, perpendicular to the view direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinLens {
    /// Radius of the lens in scene units, greater than 0.
    pub radius: f64,
    /// Distance of the plane in focus along the view direction, in scene units, greater than 0.
    pub focus: f64,
}

impl ThinLens {
    /// Returns the radius of the circle of confusion on a plane at `depth` from the eye.
    pub fn blur(&self, depth: f64) -> f64 {
        self.radius * (1.0 - depth / self.focus).abs()
    }
}

impl CompiledCamera {
    /// Compiles `camera` for a film of `width` x `height` pixels. `origin` is the point of the
    /// scene that is the origin of the compiled coordinates.
    pub fn new(camera: &Camera, [width, height]: [u32; 2], origin: DVec3) -> Self {
        let [u, v, w] = camera.frame();
        let (width, height) = (f64::from(width), f64::from(height));
        let [half_width, half_height] = camera.half_size([width, height]);
        let (radius, focus) = (camera.lens_radius(), camera.focus_depth());
        let (dx_axis, dy_axis, raster_corner) = match camera.projection {
            Projection::Perspective => (
                u * (2.0 * half_width / width),
                -v * (2.0 * half_height / height),
                w - u * half_width + v * half_height,
            ),
            Projection::Equirectangular => {
                (DVec3::X * (TAU / width), DVec3::Y * (PI / height), DVec3::NEG_X * PI)
            }
        };
        Self {
            eye: DVec3::from(camera.eye) - origin,
            frame: [u, v, w],
            projection: camera.projection,
            dx_axis,
            dy_axis,
            raster_corner,
            near: camera.near,
            lens: (radius > 0.0).then_some(ThinLens { radius, focus }),
        }
    }

    /// Returns the radius of the camera's lens in scene units; 0 for a pinhole.
    pub fn lens_radius(&self) -> f64 {
        self.lens.map_or(0.0, |lens| lens.radius)
    }

    /// Returns `true` for an equirectangular projection.
    pub fn is_panorama(&self) -> bool {
        self.projection == Projection::Equirectangular
    }

    /// Returns approximately the smallest angle \[radians\] between rays of neighbouring pixels,
    /// which is found at the picture's corners; in a panorama at the horizon, or in its columns.
    pub fn pixel_angle(&self) -> f64 {
        if self.is_panorama() {
            return self.pixel();
        }
        // A step of the pixel size p perpendicular to a ray, at the distance d, rotates the ray by
        // about p / d. A step on the oblique picture plane rotates it by at least p / d^2.
        self.pixel() / self.raster_corner.length_squared()
    }

    /// Returns the shorter side of a pixel on the picture plane at unit distance.
    pub fn pixel(&self) -> f64 {
        self.dx_axis.length().min(self.dy_axis.length())
    }

    /// Returns the vectors from the eye to the corners of a rectangle of pixels, on the picture
    /// plane at unit distance: clockwise from the upper left one, the corner of pixel `[x, y]`.
    pub fn corners(&self, [x, y]: [usize; 2], [width, height]: [usize; 2]) -> [DVec3; 4] {
        let (x0, y0) = (x as f64, y as f64);
        let (x1, y1) = (x0 + width as f64, y0 + height as f64);
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
            .map(|(x, y)| self.raster_corner + self.dx_axis * x + self.dy_axis * y)
    }

    /// Projects a point to column and row, with fractions. A perspective must have it in front of the
    /// eye.
    pub fn project(&self, point: DVec3) -> [f64; 2] {
        let from_eye = point - self.eye;
        let [x, y, z] = self.frame.map(|axis| axis.dot(from_eye));
        let on_plane = match self.projection {
            Projection::Perspective => from_eye / z,
            Projection::Equirectangular => DVec3::new(x.atan2(z), x.hypot(z).atan2(y), 0.0),
        };
        let on_plane = on_plane - self.raster_corner;
        [self.dx_axis, self.dy_axis].map(|pixel| on_plane.dot(pixel) / pixel.length_squared())
    }

    /// Returns the vector from the eye to the upper left corner of pixel (`x`, `y`); in a panorama its
    /// position on the picture plane.
    #[inline(always)]
    pub fn pixel_corner_direction<S: Float>(&self, (x, y): (u32, u32)) -> [S; 3] {
        let corner = self.raster_corner + self.dx_axis * f64::from(x) + self.dy_axis * f64::from(y);
        corner.to_array().map(S::from_f64)
    }

    /// Returns the rays through points of a pixel, from the near plane. `base` is the pixel's
    /// [`CompiledCamera::pixel_corner_direction`]; `(dx, dy)` is the offset from this corner, to
    /// the right and downward \[pixels\].
    #[inline(always)]
    pub fn rays<L: SimdFloat>(&self, base: Vec3<L>, (dx, dy): (L, L)) -> Ray<L> {
        if self.is_panorama() {
            return self.panorama_rays(base, (dx, dy));
        }
        let dx_axis = Vec3::of(self.dx_axis.to_array());
        let dy_axis = Vec3::of(self.dy_axis.to_array());
        let direction = dx_axis.mul_add(dx, dy_axis.mul_add(dy, base));
        let eye = Vec3::of(self.eye.to_array());
        // The component of `direction` along the view is 1.
        let origin =
            if self.near > 0.0 { direction.mul_add(L::from_f64(self.near), eye) } else { eye };
        Ray { origin, direction: direction.normalize() }
    }

    #[inline(never)]
    fn panorama_rays<L: SimdFloat>(&self, base: Vec3<L>, (dx, dy): (L, L)) -> Ray<L> {
        let axis = |v: DVec3| Vec3::of(v.to_array());
        let (s, c) = L::from_f64(self.dx_axis.x).mul_add(dx, base.x).sin_cos();
        let (sin, cos) = L::from_f64(self.dy_axis.y).mul_add(dy, base.y).sin_cos();
        let [right, up, forward] = self.frame.map(axis);
        let direction = right.mul_add(s * sin, forward.mul_add(c * sin, up * cos));
        Ray { origin: axis(self.eye), direction: direction.normalize() }
    }

    /// Returns the rays through points of the lens, whose coordinates `(x, y)`, to the right and
    /// upward, are in the unit disk. `base` and `(dx, dy)` are as for [`CompiledCamera::rays`].
    ///
    /// The ray starts at eye + o, where o is the vector to the point of the lens, in the direction
    /// d - o / f. Here d is the direction through the eye, with a component of 1 along the view,
    /// and f is the distance of the plane in focus. The ray crosses the ray through the eye in the
    /// plane in focus (Cook, Porter and Carpenter 1984, *Distributed Ray Tracing*, section 4.2).
    #[inline(never)]
    pub fn lens_rays<L: SimdFloat>(
        &self,
        lens: &ThinLens,
        base: Vec3<L>,
        (dx, dy): (L, L),
        (x, y): (L, L),
    ) -> Ray<L> {
        let axis = |v: DVec3| Vec3::of(v.to_array());
        let [u, v, _] = self.frame.map(axis);
        let across = u.mul_add(x, v * y);
        let through_eye = axis(self.dx_axis).mul_add(dx, axis(self.dy_axis).mul_add(dy, base));
        let slope = L::from_f64(-lens.radius / lens.focus);
        let direction = across.mul_add(slope, through_eye);
        let mut origin = across.mul_add(L::from_f64(lens.radius), axis(self.eye));
        if self.near > 0.0 {
            origin = direction.mul_add(L::from_f64(self.near), origin);
        }
        Ray { origin, direction: direction.normalize() }
    }
}
