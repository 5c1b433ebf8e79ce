//! Compiled lights, white and of unit strength. Colour and intensity of a light are applied to the
//! accumulated sums, so that new colours and intensities need no new samples.

use crate::lanes::{Float, SimdFloat, Vec3};
use crate::light::{Falloff, Light, Spot};
use crate::value::unit;
use glam::DVec3;
use std::f64::consts::PI;

/// A compiled delta light: a light without a size.
#[derive(Clone, Copy, Debug)]
pub enum DeltaLight<S> {
    /// Point light. Its irradiance at normal incidence is 1 / d^2 at the distance d.
    InverseSquare {
        /// Position of the light.
        position: [S; 3],
    },
    /// Point light. Its irradiance at normal incidence is pi at every distance.
    Constant {
        /// Position of the light.
        position: [S; 3],
    },
    /// Directional light with the irradiance pi at normal incidence.
    Directional {
        /// Unit vector towards the light.
        wi: [S; 3],
    },
    /// Light from one point into a cone.
    Spot {
        /// Position of the light.
        position: [S; 3],
        /// Cone that limits the light.
        cone: SpotCone<S>,
        /// Falloff: `true` if the irradiance inside the inner cone is 1 / d^2 at the distance d;
        /// `false` if it is pi.
        inverse_square: bool,
    },
}

/// Largest value of `SpotCone::scale`. It is finite in single precision.
const SHARP: f64 = 1e30;

/// Cone of a spot light: the factor of its intensity in each direction.
///
/// With s = 1 - cos of the angle to the axis, the factor is smoothstep(t) = t^2 (3 - 2t) for
/// t = (s_outer - s) / (s_outer - s_inner), clamped to [0, 1]: a smoothstep of the cosine, as in
/// pbrt. s is half the squared distance between the unit vectors, which keeps its precision in
/// narrow cones.
#[derive(Clone, Copy, Debug)]
pub struct SpotCone<S> {
    /// Unit vector from lit points on the cone's axis towards the light.
    axis: [S; 3],
    /// Value of s at the outer cone.
    outer: S,
    /// 1 / (s_outer - s_inner), at most [`SHARP`].
    scale: S,
}

impl<S: Float> SpotCone<S> {
    fn new(spot: &Spot) -> Option<Self> {
        let axis = -unit(spot.direction)?;
        let one_minus_cos = |degrees: f64| 2.0 * (0.5 * degrees).to_radians().sin().powi(2);
        let (inner, mut outer) = (one_minus_cos(spot.inner_angle), one_minus_cos(spot.outer_angle));
        if spot.inner_angle == 180.0 {
            // All directions, also those whose s is rounded to more than 2.
            outer = 3.0;
        }
        let scale = (outer - inner).max(0.0).recip().min(SHARP);
        Some(Self {
            axis: axis.to_array().map(S::from_f64),
            outer: S::from_f64(outer),
            scale: S::from_f64(scale),
        })
    }

    /// Returns the factor of the intensity, from 0 to 1, at points from which the light is in the
    /// direction of the unit vector `wi`.
    #[inline(always)]
    fn factor<L: SimdFloat<Scalar = S>>(&self, wi: Vec3<L>) -> L {
        let s = (wi - Vec3::splat(self.axis)).length_squared() * L::from_f64(0.5);
        let t = ((L::splat(self.outer) - s) * L::splat(self.scale)).max(L::zero()).min(L::one());
        t * t * (L::from_f64(3.0) - (t + t))
    }
}

/// Light that arrives at surface points from a light of unit strength, one point per lane.
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
    /// Compiles `light` for a scene translated by -`origin`. Returns `None` if `light` has a size
    /// or is an environment, or if its direction is zero.
    pub fn new(light: &Light, origin: DVec3) -> Option<Self> {
        if let Some(position) = light.apex() {
            let position = (DVec3::from(position) - origin).to_array().map(S::from_f64);
            let inverse_square = light.falloff == Falloff::InverseSquare;
            return match &light.spot {
                Some(spot) => {
                    let cone = SpotCone::new(spot)?;
                    Some(Self::Spot { position, cone, inverse_square })
                }
                None if inverse_square => Some(Self::InverseSquare { position }),
                None => Some(Self::Constant { position }),
            };
        }
        let wi = -unit(light.directional?.direction)?;
        Some(Self::Directional { wi: wi.to_array().map(S::from_f64) })
    }

    /// Position of the light in the translated scene; `None` for a directional light.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::InverseSquare { position }
            | Self::Constant { position }
            | Self::Spot { position, .. } => Some(DVec3::from(position.map(S::to_f64))),
            Self::Directional { .. } => None,
        }
    }

    /// Returns `true` if the irradiance decreases with the square of the distance.
    pub fn is_inverse_square(&self) -> bool {
        matches!(self, Self::InverseSquare { .. } | Self::Spot { inverse_square: true, .. })
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
            Self::InverseSquare { position }
            | Self::Constant { position }
            | Self::Spot { position, .. } => {
                let to_light = Vec3::splat(*position) - point;
                let distance = to_light.length_squared().sqrt();
                let inverse = L::one() / distance;
                let wi = to_light * inverse;
                let mut irradiance = match self {
                    Self::InverseSquare { .. } | Self::Spot { inverse_square: true, .. } => {
                        // The irradiance is kept finite, because infinity times black would be NaN.
                        (inverse * inverse).min(L::from_f64(L::MAX))
                    }
                    _ => L::from_f64(PI),
                };
                if let Self::Spot { cone, .. } = self {
                    irradiance *= cone.factor(wi);
                }
                LightSample { wi, distance, irradiance }
            }
        }
    }

    /// Returns the irradiance at normal incidence at the origin of the translated scene. If the
    /// light is nearer than `radius`, returns the irradiance at the distance `radius`.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{Double, Single};

    fn spot(inner_angle: f64, outer_angle: f64, falloff: Falloff) -> Light {
        let direction = [0.3, -2.0, 0.7];
        let spot = Spot { position: [0.5, 3.0, -1.0], direction, outer_angle, inner_angle };
        Light { spot: Some(spot), falloff, ..Light::default() }
    }

    /// Compares the irradiance around a spot light with the smoothstep of the angle's cosine.
    ///
    /// Tolerance: the direction has an error of about ten rounding errors, from coordinates below
    /// 8, divided by distances of at least 0.5, and from two unit vectors. The slope of the
    /// smoothstep, at most 1.5 times that of the cosine, multiplies it.
    fn check<L: SimdFloat>(epsilon: f64) {
        let origin = DVec3::new(0.25, 0.0, 0.5);
        for (inner, outer) in [(10.0, 30.0), (0.0, 90.0), (0.0, 0.5), (70.0, 160.0), (180.0, 180.0)]
        {
            for falloff in [Falloff::None, Falloff::InverseSquare] {
                let light = spot(inner, outer, falloff);
                let Spot { position, direction, .. } = light.spot.expect("a spot light");
                let compiled = DeltaLight::<L::Scalar>::new(&light, origin).expect("a light");
                let axis = DVec3::from(direction).normalize();
                let across = axis.any_orthonormal_vector();
                for step in 0..=40 {
                    let angle = (outer * f64::from(step) / 32.0).min(180.0).to_radians();
                    let distance = 0.5 + 0.2 * f64::from(step);
                    let along = axis * angle.cos() + across * angle.sin();
                    let point = DVec3::from(position) + along * distance - origin;
                    let sample = compiled.sample_li(Vec3::<L>::of(point.to_array()));
                    // 1 - cos without cancellation.
                    let drop = |a: f64| 2.0 * (0.5 * a).sin().powi(2);
                    let [low, high] = [outer, inner].map(|a: f64| drop(a.to_radians()));
                    let t = ((low - drop(angle)) / (low - high)).clamp(0.0, 1.0);
                    let factor = if low > high { t * t * (3.0 - 2.0 * t) } else { 1.0 };
                    let full = match falloff {
                        Falloff::None => PI,
                        Falloff::InverseSquare => distance.powi(-2),
                    };
                    let found = sample.irradiance.lane(0).to_f64();
                    let slope = if low > high { angle.sin() / (low - high) } else { 0.0 };
                    let error = 16.0 * epsilon * (1.0 + slope);
                    assert!(
                        (found / full - factor).abs() <= error,
                        "{inner} to {outer}, {falloff:?}, {angle}: {} for {factor}",
                        found / full
                    );
                }
            }
        }
    }

    #[test]
    fn spot_light_has_smoothstep_of_the_cosine() {
        check::<Double>(f64::EPSILON);
        check::<Single>(f64::from(f32::EPSILON));
    }

    #[test]
    fn spot_light_with_equal_angles_has_a_sharp_edge() {
        let light = spot(20.0, 20.0, Falloff::None);
        let compiled = DeltaLight::<f64>::new(&light, DVec3::ZERO).expect("a light");
        let Spot { position, direction, .. } = light.spot.expect("a spot light");
        let axis = DVec3::from(direction).normalize();
        for (degrees, expected) in [(0.0, PI), (19.999, PI), (20.001, 0.0), (180.0, 0.0)] {
            let angle = f64::to_radians(degrees);
            let along = axis * angle.cos() + axis.any_orthonormal_vector() * angle.sin();
            let point = DVec3::from(position) + along;
            let found = compiled.sample_li(Vec3::<f64>::of(point.to_array())).irradiance;
            assert_eq!(found, expected, "{degrees}");
        }
    }
}
