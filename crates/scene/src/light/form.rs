//! Canonical forms of lights, in double precision and scene coordinates.

use crate::light::{Environment, Spot};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_kernel::lanes::Vec3;

#[derive(Clone, Debug, PartialEq)]
pub enum LightForm<'a> {
    Point {
        position: DVec3,
        /// Cone that limits the light; `None` for light in all directions.
        cone: Option<&'a Spot>,
    },
    /// Light from infinitely far away.
    Distant {
        /// Unit vector towards the light.
        wi: DVec3,
        /// Angular radius of the light \[radians\]; 0 for parallel rays.
        radius: f64,
    },
    /// Light from a surface without a body: rays pass through it, and it casts no shadow.
    Surface(EmissiveSurface),
    Environment(&'a Environment),
}

#[derive(Clone, Debug, PartialEq)]
pub enum EmissiveSurface {
    Sphere {
        center: DVec3,
        radius: f64,
    },
    Rectangle {
        center: DVec3,
        /// Unit vectors across and up the rectangle, and along the normal of its front.
        axes: [DVec3; 3],
        size: [f64; 2],
    },
    Disk {
        center: DVec3,
        /// Perpendicular unit vectors, the third of which is the normal of the disk's front.
        axes: [DVec3; 3],
        radius: f64,
    },
    /// Triangles with areas greater than 0, counter-clockwise as seen from the front.
    Triangles(Vec<[DVec3; 3]>),
    /// Triangles that enclose a convex solid, counter-clockwise as seen from outside.
    ConvexTriangles(Vec<[DVec3; 3]>),
}

impl EmissiveSurface {
    /// Returns the centre of the surface: for triangles, that of their bounding box.
    pub fn center(&self) -> DVec3 {
        match self {
            Self::Sphere { center, .. }
            | Self::Rectangle { center, .. }
            | Self::Disk { center, .. } => *center,
            Self::Triangles(triangles) | Self::ConvexTriangles(triangles) => {
                let corners = || triangles.iter().flatten().copied();
                let low = corners().fold(DVec3::INFINITY, DVec3::min);
                let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
                0.5 * (low + high)
            }
        }
    }

    /// Returns the radius of the smallest sphere around the centre that contains the surface.
    pub fn radius(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } | Self::Disk { radius, .. } => *radius,
            Self::Rectangle { size: [width, height], .. } => 0.5 * width.hypot(*height),
            Self::Triangles(triangles) | Self::ConvexTriangles(triangles) => {
                let center = self.center();
                triangles.iter().flatten().map(|p| p.distance(center)).fold(0.0, f64::max)
            }
        }
    }

    pub fn area(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Self::Rectangle { size: [width, height], .. } => width * height,
            Self::Disk { radius, .. } => PI * radius * radius,
            Self::Triangles(triangles) | Self::ConvexTriangles(triangles) => {
                triangles.iter().map(|corners| 0.5 * doubled_normal(corners).length()).sum()
            }
        }
    }

    /// Returns the area that the surface shows to a distant point in front of it.
    pub fn frontal_area(&self) -> f64 {
        match self {
            Self::Sphere { .. } => 0.25 * self.area(),
            Self::Rectangle { .. }
            | Self::Disk { .. }
            | Self::Triangles(_)
            | Self::ConvexTriangles(_) => self.area(),
        }
    }

    /// Returns the size of the surface's smallest details: the radius of a sphere or disk, the
    /// shorter side of a rectangle, or the square root of the total area of triangles.
    pub fn thickness(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } | Self::Disk { radius, .. } => *radius,
            Self::Rectangle { size: [width, height], .. } => width.min(*height),
            Self::Triangles(_) | Self::ConvexTriangles(_) => self.area().sqrt(),
        }
    }
}

/// Ratio of a triangle's length to its height above which [`doubled_normal`] is computed more exactly.
const MAX_ASPECT: f64 = 64.0;

/// Returns the normal of a triangle; its length is twice the triangle's area.
pub(super) fn doubled_normal([a, b, c]: &[DVec3; 3]) -> DVec3 {
    let edges = [b - a, c - a];
    let normal = edges[0].cross(edges[1]);
    let longest = edges[0].length_squared().max(edges[1].length_squared());
    if longest <= MAX_ASPECT * normal.length() {
        return normal;
    }
    let [u, v] = edges.map(|edge| Vec3::<f64>::of(edge.to_array()));
    DVec3::from(u.exact_cross(v).lane(0))
}
