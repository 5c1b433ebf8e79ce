//! A light, compiled: of unit strength and white. Colour and intensity are applied to the finished
//! sums, so that changing them needs no new samples.

use crate::lanes::{Float, SimdFloat, Vec3};
use crate::light::{Falloff, Light};
use crate::value::unit;
use glam::DVec3;
use std::f64::consts::PI;

/// A light, compiled.
#[derive(Clone, Copy, Debug)]
pub enum DeltaLight<S> {
    /// A point whose irradiance falls with the square of the distance: 1 / d^2.
    InverseSquare {
        /// Where it stands.
        position: [S; 3],
    },
    /// A point with the same normal irradiance, pi, everywhere.
    Constant {
        /// Where it stands.
        position: [S; 3],
    },
    /// Light along one direction with normal irradiance pi.
    Directional {
        /// Unit vector towards the light.
        wi: [S; 3],
    },
}

/// Unit light arriving at points.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<L> {
    /// Unit vector towards the light.
    pub wi: Vec3<L>,
    /// Distance to the light; the largest number for light from infinity.
    pub distance: L,
    /// Irradiance of a surface that faces the light.
    pub irradiance: L,
}

impl<S: Float> DeltaLight<S> {
    /// Compiles `light` for a scene shifted so that `origin` becomes zero. `None`: it has no kind
    /// or no direction.
    pub fn new(light: &Light, origin: DVec3) -> Option<Self> {
        if let Some(point) = &light.point {
            let position = (DVec3::from(point.position) - origin).to_array().map(S::from_f64);
            return Some(match light.falloff {
                Falloff::InverseSquare => Self::InverseSquare { position },
                Falloff::None => Self::Constant { position },
            });
        }
        let towards = -unit(light.directional?.direction)?;
        Some(Self::Directional { wi: towards.to_array().map(S::from_f64) })
    }

    /// The light that arrives at `point`, if nothing is in the way.
    #[inline(always)]
    pub fn sample_li<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>) -> LightSample<L> {
        match self {
            Self::Directional { wi: towards } => LightSample {
                wi: Vec3::splat(*towards),
                distance: L::from_f64(L::MAX),
                irradiance: L::from_f64(PI),
            },
            Self::InverseSquare { position } | Self::Constant { position } => {
                let to = Vec3::splat(*position) - point;
                let distance = to.length_squared().sqrt();
                let inverse = L::one() / distance;
                let irradiance = match self {
                    // Infinity times black would be no number.
                    Self::InverseSquare { .. } => (inverse * inverse).min(L::from_f64(L::MAX)),
                    _ => L::from_f64(PI),
                };
                LightSample { wi: to * inverse, distance, irradiance }
            }
        }
    }

    /// Normal irradiance at a typical place: at the origin, but not nearer than `radius`.
    pub fn typical_irradiance(&self, radius: f64) -> f64 {
        match self {
            Self::InverseSquare { position } => {
                let d = DVec3::from(position.map(S::to_f64)).length().max(radius);
                if d > 0.0 { 1.0 / (d * d) } else { 1.0 }
            }
            _ => PI,
        }
    }
}
