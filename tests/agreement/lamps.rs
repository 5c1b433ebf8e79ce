//! Lights with a size (lamps) in the reference tracer. For direct light, points are sampled
//! uniformly over the lamp's area. Camera and mirror rays find the lamps that they hit. There is no
//! importance sampling.

use crate::agreement::tracer::Mutation;
use crate::common::Numbers;
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_scene::light::{Light, LightKind, LightUnit};

/// Lamp: a light with a size.
pub enum Lamp {
    Sphere {
        center: DVec3,
        radius: f64,
    },
    Rectangle {
        center: DVec3,
        across: DVec3,
        up: DVec3,
        normal: DVec3,
    },
    Disk {
        center: DVec3,
        radius: f64,
        normal: DVec3,
    },
    /// Directional light with the angular radius `radius`.
    Sun {
        towards: DVec3,
        radius: f64,
    },
}

/// Light that arrives from a point of a lamp: direction to the point, distance, and irradiance on a
/// surface perpendicular to this direction.
pub type Arrival = (DVec3, f64, f64);

impl Lamp {
    /// Creates the lamp of a light with a size. Returns `None` for a light without a size.
    pub fn new(light: &Light) -> Option<Self> {
        match &light.kind {
            LightKind::Sphere(sphere) => {
                Some(Self::Sphere { center: sphere.center.into(), radius: sphere.radius })
            }
            LightKind::Rectangle(rectangle) => {
                let normal = DVec3::from(rectangle.normal).normalize();
                let given = DVec3::from(rectangle.up);
                let parallel = given.cross(normal).length() < 1e-6;
                let given = if parallel { DVec3::Z } else { given };
                let across = given.cross(normal).normalize();
                let up = normal.cross(across);
                Some(Self::Rectangle {
                    center: rectangle.center.into(),
                    across: across * rectangle.size[0],
                    up: up * rectangle.size[1],
                    normal,
                })
            }
            LightKind::Disk(disk) => {
                let normal = DVec3::from(disk.normal).normalize();
                Some(Self::Disk { center: disk.center.into(), radius: disk.radius, normal })
            }
            LightKind::Directional(sun) if sun.angle > 0.0 => Some(Self::Sun {
                towards: -DVec3::from(sun.direction).normalize(),
                radius: 0.5 * sun.angle.to_radians(),
            }),
            LightKind::Point(_)
            | LightKind::Directional(_)
            | LightKind::Spot(_)
            | LightKind::Environment(_) => None,
        }
    }

    fn area(&self) -> f64 {
        match self {
            Self::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Self::Rectangle { across, up, .. } => across.length() * up.length(),
            Self::Disk { radius, .. } => PI * radius * radius,
            Self::Sun { .. } => f64::INFINITY,
        }
    }

    /// Returns the radiance of a white lamp of intensity 1, if intensities are in the unit `unit`.
    pub fn radiance(&self, unit: LightUnit) -> f64 {
        if let Self::Sun { radius, .. } = self {
            // The irradiance of a surface that faces the sun is pi.
            return 1.0 / radius.sin().powi(2);
        }
        match unit {
            LightUnit::Radiance => 1.0,
            LightUnit::Power => 1.0 / (PI * self.area()),
        }
    }

    /// Returns the distance at which a ray hits the visible side of the lamp. Returns `None` for a
    /// miss.
    pub fn meet(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let plane = |center: DVec3, normal: DVec3| {
            let t = (center - origin).dot(normal) / direction.dot(normal);
            (direction.dot(normal) < 0.0 && t > 0.0).then(|| (t, origin + direction * t - center))
        };
        match self {
            Self::Sphere { center, radius } => {
                let b = (center - origin).dot(direction);
                let c = (center - origin).length_squared() - radius * radius;
                let root = (b * b - c).sqrt();
                [b - root, b + root].into_iter().find(|t| *t > 0.0)
            }
            Self::Rectangle { center, across, up, normal } => {
                let (t, place) = plane(*center, *normal)?;
                let inside = |side: &DVec3| place.dot(*side).abs() <= 0.5 * side.length_squared();
                (inside(across) && inside(up)).then_some(t)
            }
            Self::Disk { center, radius, normal } => {
                let (t, place) = plane(*center, *normal)?;
                (place.length() <= *radius).then_some(t)
            }
            Self::Sun { towards, radius } => {
                (direction.dot(*towards) >= radius.cos()).then_some(f64::MAX)
            }
        }
    }

    /// Samples a uniform random point of the lamp. Returns the light that arrives at `from` from
    /// this point if the lamp has unit radiance. Returns `None` if the front of the lamp at this
    /// point faces away from `from`.
    pub fn sample(
        &self,
        from: DVec3,
        mutation: Mutation,
        numbers: &mut Numbers,
    ) -> Option<Arrival> {
        let (point, normal) = match self {
            Self::Sun { towards, radius } => {
                // The height of a uniform point of a spherical cap is uniform.
                let z = numbers.between(radius.cos(), 1.0);
                let (sin, cos) = numbers.between(0.0, 2.0 * PI).sin_cos();
                let (across, up) = towards.any_orthonormal_pair();
                let aside = (across * cos + up * sin) * (1.0 - z * z).sqrt();
                let solid_angle = 2.0 * PI * (1.0 - radius.cos());
                return Some((*towards * z + aside, f64::INFINITY, solid_angle));
            }
            Self::Sphere { center, radius } => {
                let normal = numbers.direction();
                // A sphere lamp also emits inwards: from inside, every point of it is visible.
                let inside = from.distance(*center) < *radius;
                (center + normal * *radius, if inside { -normal } else { normal })
            }
            Self::Rectangle { center, across, up, normal } => {
                let (x, y) = (numbers.between(-0.5, 0.5), numbers.between(-0.5, 0.5));
                (center + across * x + up * y, *normal)
            }
            Self::Disk { center, radius, normal } => {
                let across = normal.any_orthonormal_vector();
                let up = normal.cross(across);
                let (sin, cos) = numbers.between(0.0, 2.0 * PI).sin_cos();
                let r = radius * numbers.unit().sqrt();
                (center + across * (r * cos) + up * (r * sin), *normal)
            }
        };
        let distance = point.distance(from);
        let towards = (point - from) / distance;
        let mut cos = -normal.dot(towards);
        if cos <= 0.0 {
            return None;
        }
        if mutation == Mutation::NoLampCosine {
            cos = 1.0;
        }
        Some((towards, distance, self.area() * cos / (distance * distance)))
    }
}
