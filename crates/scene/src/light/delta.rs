//! Compiled lights without a size (delta lights), white and of unit strength. Colour and intensity
//! of a light are applied to the film's sums, so that new colours and intensities need no new
//! samples.

use crate::light::{Falloff, Light, Spot};
use crate::value::unit;
use glam::DVec3;
use std::f64::consts::PI;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};

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

/// Largest value of [`SpotCone::scale`], the reciprocal width of the cone's soft edge. A cone
/// without a soft edge gets this value, which is finite in single precision.
const SHARP: f64 = 1e30;

/// Cone of a spot light. It gives the factor, 0..=1, by which the light's intensity is multiplied
/// in each direction.
///
/// Let s = 1 - cos(angle to the axis), and let s_inner and s_outer be its values at the inner and
/// the outer cone. The factor is t^2 (3 - 2t) for t = (s_outer - s) / (s_outer - s_inner), clamped
/// to [0, 1]. It is a smoothstep of the cosine, as in pbrt. s is computed as half the squared
/// distance between the unit vectors of the direction and the axis, which is precise in narrow
/// cones.
#[derive(Clone, Copy, Debug)]
pub struct SpotCone<S> {
    /// Unit vector from lit points on the cone's axis towards the light.
    pub axis: [S; 3],
    /// Value of s = 1 - cos(angle to the axis) at the outer cone.
    pub outer: S,
    /// Reciprocal width of the cone's soft edge: 1 / (s_outer - s_inner), at most `SHARP`, where s
    /// = 1 - cos(angle to the axis).
    pub scale: S,
}

/// Value of [`SpotCone::outer`] for a cone that contains all directions. Rounding may give s =
/// 1 - cos(angle to the axis) a value above 2, its exact maximum, so the limit is larger.
const ALL_DIRECTIONS: f64 = 3.0;

impl<S: Float> SpotCone<S> {
    /// Returns the cone of a light that emits equally in all directions. The cone's factor of the
    /// intensity is exactly 1.
    pub fn of_all_directions() -> Self {
        let axis = [0.0, 1.0, 0.0].map(S::from_f64);
        Self { axis, outer: S::from_f64(ALL_DIRECTIONS), scale: S::from_f64(SHARP) }
    }

    fn new(spot: &Spot) -> Option<Self> {
        let axis = -unit(spot.direction)?;
        let one_minus_cos = |degrees: f64| 2.0 * (0.5 * degrees).to_radians().sin().powi(2);
        let (inner, mut outer) = (one_minus_cos(spot.inner_angle), one_minus_cos(spot.outer_angle));
        if spot.inner_angle == 180.0 {
            outer = ALL_DIRECTIONS;
        }
        let scale = (outer - inner).max(0.0).recip().min(SHARP);
        Some(Self {
            axis: axis.to_array().map(S::from_f64),
            outer: S::from_f64(outer),
            scale: S::from_f64(scale),
        })
    }

    /// Returns the factor of the spot's intensity, 0..=1, at surface points. `wi` is the unit
    /// vector from each point to the light.
    #[inline(always)]
    fn factor<L: SimdFloat<Scalar = S>>(&self, wi: Vec3<L>) -> L {
        let Self { axis, outer, scale } = *self;
        spot_factor(wi, Vec3::splat(axis), L::splat(outer), L::splat(scale))
    }
}

/// Returns the factor of a spot's intensity, 0..=1, at surface points. Each lane has a spot of its
/// own; `axis`, `outer` and `scale` are the fields of its [`SpotCone`]. `wi` is the unit vector
/// from each point to its light.
#[inline(always)]
pub fn spot_factor<L: SimdFloat>(wi: Vec3<L>, axis: Vec3<L>, outer: L, scale: L) -> L {
    let s = (wi - axis).length_squared() * L::from_f64(0.5);
    let t = ((outer - s) * scale).max(L::zero()).min(L::one());
    t * t * (L::from_f64(3.0) - (t + t))
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
    /// if `light` has a size or is an environment, or if its direction is zero.
    pub fn new(light: &Light, origin: DVec3) -> Option<Self> {
        if let Some(position) = light.apex() {
            let position = (DVec3::from(position) - origin).to_array().map(S::from_f64);
            let inverse_square = light.falloff == Falloff::InverseSquare;
            let cone = match &light.spot {
                Some(spot) => Some(SpotCone::new(spot)?),
                None => None,
            };
            return Some(Self::Point { position, inverse_square, cone });
        }
        let wi = -unit(light.directional?.direction)?;
        Some(Self::Directional { wi: wi.to_array().map(S::from_f64) })
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

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::lanes::{Double, Single};

    fn spot(inner_angle: f64, outer_angle: f64, falloff: Falloff) -> Light {
        let direction = [0.3, -2.0, 0.7];
        let spot = Spot { position: [0.5, 3.0, -1.0], direction, outer_angle, inner_angle };
        Light { spot: Some(spot), falloff, ..Light::default() }
    }

    /// Checks that the irradiance around a spot light follows the smoothstep of the cosine of the
    /// angle to its axis. `L` is the number type and `epsilon` its rounding error.
    ///
    /// The tolerance follows from the error of the direction to the light. This error is about ten
    /// times `epsilon`, because coordinates are below 8 and distances at least 0.5. The smoothstep
    /// multiplies the error by its slope, which is at most 1.5 times that of t (see [`SpotCone`]).
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
                    // Form of 1 - cos(a) without cancellation at small angles.
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
