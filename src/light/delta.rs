//! Compiled lights without a size (delta lights), white and of unit strength. Colour and intensity
//! of a light are applied to the film's sums, so that new colours and intensities need no new
//! samples.

use crate::lanes::{Float, SimdFloat, Vec3};
use crate::light::{Falloff, Light, LightForm, SpotCone};
use glam::DVec3;
use std::f64::consts::PI;

/// Delta light: a light without a size, compiled for the kernels.
#[derive(Clone, Copy, Debug)]
pub enum DeltaLight<S> {
    /// Point or spot light: light from one point.
    Point {
        /// Position of the light, relative to the scene's centre.
        position: [S; 3],
        /// Falloff: `true` if the irradiance at normal incidence is 1 / d^2 at the distance d;
        /// `false` if it is pi at every distance, so that a white diffuse surface has the radiance
        /// 1.
        inverse_square: bool,
        /// Cone that limits the light of a spot; `None` for a point light.
        cone: Option<SpotCone<S>>,
    },
    /// Directional light. The irradiance at normal incidence is pi, so that a white diffuse surface
    /// has the radiance 1.
    Directional {
        /// Unit vector towards the distant light.
        wi: [S; 3],
    },
}

/// Light that arrives at surface points from a light of unit strength, one point per lane.
#[derive(Clone, Copy, Debug)]
pub struct LightSample<L> {
    /// Unit vector from the surface point towards the light.
    pub wi: Vec3<L>,
    /// Distance from the surface point to the light; the largest finite number for a directional
    /// light.
    pub distance: L,
    /// Irradiance that the light, with unit strength, causes on a surface that faces it.
    pub irradiance: L,
}

impl<S: Float> DeltaLight<S> {
    /// Compiles `light`. Positions become relative to `origin`, the scene's centre. Returns `None`
    /// if `light` has a size or is an environment.
    pub fn new(light: &Light, origin: DVec3) -> Option<Self> {
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        match light.form() {
            LightForm::Point { position, cone } => Some(Self::Point {
                position: vector(position - origin),
                inverse_square: light.falloff == Falloff::InverseSquare,
                cone: cone.map(SpotCone::new),
            }),
            LightForm::Distant { wi } => Some(Self::Directional { wi: vector(wi) }),
            LightForm::Surface(_) | LightForm::Environment(_) => None,
        }
    }

    /// Returns the position of the light relative to the scene's centre; `None` for a directional
    /// light.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Point { position, .. } => Some(DVec3::from(position.map(S::to_f64))),
            Self::Directional { .. } => None,
        }
    }

    /// Returns `true` if the irradiance decreases with the square of the distance.
    pub fn is_inverse_square(&self) -> bool {
        matches!(self, Self::Point { inverse_square: true, .. })
    }

    /// Returns the light that arrives at `point` if nothing occludes it.
    #[inline(always)]
    pub fn sample_li<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>) -> LightSample<L> {
        match self {
            Self::Directional { wi } => LightSample {
                wi: Vec3::splat(*wi),
                distance: L::from_f64(L::MAX),
                irradiance: L::from_f64(PI),
            },
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
                LightSample { wi, distance, irradiance }
            }
        }
    }

    /// Returns the irradiance that the light, with unit strength, causes at normal incidence at the
    /// scene's centre. If the irradiance falls with the square of the distance and the light is
    /// nearer to the centre than `radius`, returns the irradiance at the distance `radius` from the
    /// light.
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
