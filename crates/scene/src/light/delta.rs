//! Compiled lights without a size, white and of unit strength.

use crate::light::{LightSample, SpotCone};
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};

#[derive(Clone, Copy, Debug)]
pub enum DeltaLight<S> {
    /// Point or spot light.
    Point {
        /// Position relative to the scene's centre.
        position: [S; 3],
        /// `true` if the irradiance at normal incidence is 1 / d^2 at the distance d; `false` if it
        /// is pi at every distance, so that a white diffuse surface has the radiance 1.
        inverse_square: bool,
        /// Cone of a spot light; `None` for a point light.
        cone: Option<SpotCone<S>>,
    },
    /// Directional light, whose irradiance at normal incidence is pi.
    Directional {
        /// Unit vector towards the distant light.
        wi: [S; 3],
    },
}

impl<S: Float> DeltaLight<S> {
    /// Returns the position of a point or spot light; `None` for a directional light.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Point { position, .. } => Some(DVec3::from(position.map(S::to_f64))),
            Self::Directional { .. } => None,
        }
    }

    pub fn is_inverse_square(&self) -> bool {
        matches!(self, Self::Point { inverse_square: true, .. })
    }

    /// Returns the light that arrives at `point` if nothing occludes it.
    #[inline(always)]
    pub fn sample_li<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>) -> LightSample<L> {
        let (wi, distance, irradiance) = match self {
            Self::Directional { wi } => (Vec3::splat(*wi), L::from_f64(L::MAX), L::from_f64(PI)),
            Self::Point { position, inverse_square, cone } => {
                let to_light = Vec3::splat(*position) - point;
                let distance = to_light.length_squared().sqrt();
                let inverse = L::one() / distance;
                let wi = to_light * inverse;
                let mut irradiance = if *inverse_square {
                    // The irradiance is kept finite, because infinity times black would be NaN.
                    (inverse * inverse).min(L::from_f64(L::MAX))
                } else {
                    L::from_f64(PI)
                };
                if let Some(cone) = cone {
                    irradiance *= cone.factor(wi);
                }
                (wi, distance, irradiance)
            }
        };
        let irradiance = Vec3::gray(irradiance);
        LightSample { wi, distance, irradiance, density: L::from_f64(L::MAX) }
    }

    /// Returns the irradiance at normal incidence at the scene's centre. If the irradiance is in
    /// inverse proportion to the squared distance, this distance counts as at least `radius`.
    pub fn typical_irradiance(&self, radius: f64) -> f64 {
        match self.position().filter(|_| self.is_inverse_square()) {
            Some(position) => {
                let d = position.length().max(radius);
                if d > 0.0 { 1.0 / (d * d) } else { 1.0 }
            }
            None => PI,
        }
    }
}
