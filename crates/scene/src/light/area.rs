//! Descriptions of lights with a size: sphere, rectangle and disk. Such a light is a radiating
//! surface that rays pass through and that casts no shadow. A lamp housing must be a separate
//! object behind or around the light.

use crate::value::{description, unit};
use glam::DVec3;
use std::f64::consts::PI;

description! {
    /// Light from a sphere. Points inside of it are lit from all sides.
    pub struct SphereLight: Copy {
        /// Centre of the sphere.
        center: [f64; 3], in COORDINATE "scene units";
        /// Radius of the sphere.
        radius: f64, in SIZE "scene units";
    }
}

description! {
    /// Light from one side of a rectangle.
    pub struct RectangleLight: Copy {
        /// Centre of the rectangle.
        center: [f64; 3], in COORDINATE "scene units";
        /// Width and height of the rectangle; the height is along `up`.
        size: [f64; 2], in SIZE "scene units";
        /// Direction that the emitting side faces.
        normal: [f64; 3], as Direction;
        /// Direction of the height, made perpendicular to `normal`. If the two are parallel, the
        /// height is along z.
        up: [f64; 3] => up "[0.0, 1.0, 0.0]", as Direction;
    }
}

description! {
    /// Light from one side of a disk.
    pub struct DiskLight: Copy {
        /// Centre of the disk.
        center: [f64; 3], in COORDINATE "scene units";
        /// Radius of the disk.
        radius: f64, in SIZE "scene units";
        /// Direction that the emitting side faces.
        normal: [f64; 3], as Direction;
    }
}

/// Returns the default of [`RectangleLight::up`], the +y direction.
pub(super) fn up() -> [f64; 3] {
    [0.0, 1.0, 0.0]
}

/// Returns the unit vectors of a rectangle's frame: across, up and along `normal`. `up` is made
/// perpendicular to the normal. If `up` and `normal` are parallel (the sine of their angle is at
/// most 1e-6), the z axis replaces `up`. If `normal` is also parallel to z, the x axis replaces
/// `up`. Returns `None` if `normal` is zero.
fn frame(normal: [f64; 3], up: [f64; 3]) -> Option<[DVec3; 3]> {
    let front = unit(normal)?;
    let across = |up: DVec3| Some(up.cross(front)).filter(|across| across.length() > 1e-6);
    let right = unit(up).and_then(across).or(across(DVec3::Z)).or(across(DVec3::X))?.normalize();
    Some([right, front.cross(right), front])
}

/// Surface of a light that has a size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EmitterSurface {
    /// Surface of a sphere that emits light outwards.
    Sphere(SphereLight),
    /// Surface of a rectangle that emits light from one side.
    Rectangle(RectangleLight),
    /// Surface of a disk that emits light from one side.
    Disk(DiskLight),
}

impl EmitterSurface {
    /// Returns the centre of the surface \[scene units\].
    pub fn center(&self) -> DVec3 {
        DVec3::from(match self {
            Self::Sphere(sphere) => sphere.center,
            Self::Rectangle(rectangle) => rectangle.center,
            Self::Disk(disk) => disk.center,
        })
    }

    /// Returns the radius \[scene units\] of the smallest sphere around the centre that contains
    /// the surface.
    pub fn radius(&self) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.radius,
            Self::Rectangle(rectangle) => 0.5 * rectangle.size[0].hypot(rectangle.size[1]),
            Self::Disk(disk) => disk.radius,
        }
    }

    /// Returns the area that emits light \[scene units²\].
    pub fn area(&self) -> f64 {
        match self {
            Self::Sphere(sphere) => 4.0 * PI * sphere.radius * sphere.radius,
            Self::Rectangle(rectangle) => rectangle.size[0] * rectangle.size[1],
            Self::Disk(disk) => PI * disk.radius * disk.radius,
        }
    }

    /// Returns a measure of the smallest dimension of the surface \[scene units\]: the shorter side
    /// of a rectangle, or the radius of a sphere or disk.
    pub fn thickness(&self) -> f64 {
        match self {
            Self::Rectangle(rectangle) => rectangle.size[0].min(rectangle.size[1]),
            _ => self.radius(),
        }
    }

    /// Returns the unit vectors of the surface's frame: across, up, and towards the side that emits
    /// light. The frame of a sphere is arbitrary. Returns `None` if the normal is zero.
    pub fn frame(&self) -> Option<[DVec3; 3]> {
        match self {
            Self::Sphere(_) => Some([DVec3::X, DVec3::Y, DVec3::Z]),
            Self::Rectangle(rectangle) => frame(rectangle.normal, rectangle.up),
            Self::Disk(disk) => frame(disk.normal, up()),
        }
    }
}
