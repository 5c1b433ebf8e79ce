//! Compiled lights, white and of unit strength. Colour and intensity of a light are applied to the
//! accumulated sums, so that new colours and intensities need no new samples.

use crate::lanes::{Float, SimdFloat, Vec3};
use crate::light::{Falloff, Light};
use crate::value::unit;
use glam::DVec3;
use std::f64::consts::PI;

/// A compiled delta light.
#[derive(Clone, Copy, Debug)]
pub enum DeltaLight<S> {
    /// Point light with irradiance 1 / d^2 at the distance d.
    InverseSquare {
        /// Position of the light.
        position: [S; 3],
    },
    /// Point light with the irradiance pi, at normal incidence, at every distance.
    Constant {
        /// Position of the light.
        position: [S; 3],
    },
    /// Directional light with the irradiance pi at normal incidence.
    Directional {
        /// Unit vector towards the light.
        wi: [S; 3],
    },
}

/// Light incident at surface points from a light of unit strength.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<L> {
    /// Unit vector towards the light.
    pub wi: Vec3<L>,
    /// Distance to the light; the largest finite number for a directional light.
    pub distance: L,
    /// Irradiance on a surface that faces the light.
    pub irradiance: L,
}

impl<S: Float> DeltaLight<S> {
    /// Compiles `light` for a scene translated by -`origin`. Returns `None` if `light` has neither
    /// `point` nor `directional`, or if its direction is zero.
    pub fn new(light: &Light, origin: DVec3) -> Option<Self> {
        if let Some(point) = &light.point {
            let position = (DVec3::from(point.position) - origin).to_array().map(S::from_f64);
            return Some(match light.falloff {
                Falloff::InverseSquare => Self::InverseSquare { position },
                Falloff::None => Self::Constant { position },
            });
        }
        let wi = -unit(light.directional?.direction)?;
        Some(Self::Directional { wi: wi.to_array().map(S::from_f64) })
    }

    /// Returns the light incident at `point` without occluders.
    #[inline(always)]
    pub fn sample_li<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>) -> LightSample<L> {
        match self {
            Self::Directional { wi } => LightSample {
                wi: Vec3::splat(*wi),
                distance: L::from_f64(L::MAX),
                irradiance: L::from_f64(PI),
            },
            Self::InverseSquare { position } | Self::Constant { position } => {
                let to_light = Vec3::splat(*position) - point;
                let distance = to_light.length_squared().sqrt();
                let inverse = L::one() / distance;
                let irradiance = match self {
                    // The irradiance is kept finite, because infinity times black would be NaN.
                    Self::InverseSquare { .. } => (inverse * inverse).min(L::from_f64(L::MAX)),
                    _ => L::from_f64(PI),
                };
                LightSample { wi: to_light * inverse, distance, irradiance }
            }
        }
    }

    /// Returns the irradiance, at normal incidence, at a typical point: the origin of the
    /// translated scene. A distance to the light that is less than `radius` counts as `radius`.
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
