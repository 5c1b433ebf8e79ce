//! Spot light: its description, and the cone that limits its light. Between the inner and the outer
//! cone the light decreases smoothly to zero.

use crate::light::{Handles, LightDesc, LightForm, Placement};
use crate::value::{KeyNode, ValidationError, description, unit};
use glam::DVec3;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};

description! {
    /// Light from one point into a cone, such as a spotlight.
    pub struct Spot: Copy {
        /// Position of the light: the apex of the cone.
        position: [f64; 3], in COORDINATE "scene units";
        /// Direction of the cone's axis, in which the light travels.
        direction: [f64; 3], as Direction;
        /// Angle between the axis and the edge of the cone, outside of which there is no light.
        outer_angle: f64, in above(0.0, 180.0) "degrees";
        /// Angle between the axis and the edge of the inner cone, inside of which the light has
        /// its full intensity; at most `outer_angle`.
        inner_angle: f64 = 0.0, in closed(0.0, 180.0) "degrees";
    }
}

/// Outer angle of a spot light that is created \[degrees\]. The inner angle is half of it.
const CREATED_ANGLE: f64 = 30.0;

impl LightDesc for Spot {
    fn form(&self) -> LightForm<'_> {
        LightForm::Point { position: DVec3::from(self.position), cone: Some(self) }
    }

    fn faults(&self) -> Vec<ValidationError> {
        let Self { inner_angle, outer_angle, .. } = self;
        let is_wider = inner_angle > outer_angle;
        let fault = is_wider.then(|| {
            ValidationError::new(
                "inner_angle",
                format!("inner_angle is {inner_angle}, but outer_angle is only {outer_angle}"),
                "an inner_angle of at most outer_angle; both are measured from the axis",
            )
        });
        self.validator().and(fault).errors()
    }

    fn usual_name(&self) -> &'static str {
        "spot"
    }

    fn handles(&mut self) -> Handles<'_> {
        Handles {
            position: Some(&mut self.position),
            direction: Some(&mut self.direction),
            ..Handles::default()
        }
    }

    fn place(&mut self, placement: &Placement) {
        let Placement { position, direction, .. } = *placement;
        let (outer_angle, inner_angle) = (CREATED_ANGLE, 0.5 * CREATED_ANGLE);
        *self = Self { position, direction, outer_angle, inner_angle };
    }
}

/// Largest value of [`SpotCone::scale`]: that of a cone without a soft edge; finite as an `f32`.
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
    /// Value of s at the outer cone.
    pub outer: S,
    /// Reciprocal width of the soft edge: 1 / (s_outer - s_inner), at most `SHARP`.
    pub scale: S,
}

/// Value of [`SpotCone::outer`] that includes all directions. It exceeds 2, the largest value of s,
/// to allow for rounding.
const ALL_DIRECTIONS: f64 = 3.0;

impl<S: Float> SpotCone<S> {
    /// Returns the cone of all directions, whose factor is exactly 1.
    pub fn of_all_directions() -> Self {
        let axis = [0.0, 1.0, 0.0].map(S::from_f64);
        Self { axis, outer: S::from_f64(ALL_DIRECTIONS), scale: S::from_f64(SHARP) }
    }

    pub(super) fn new(spot: &Spot) -> Self {
        let axis = -unit(spot.direction).unwrap_or(DVec3::NEG_Y);
        let one_minus_cos = |degrees: f64| 2.0 * (0.5 * degrees).to_radians().sin().powi(2);
        let (inner, mut outer) = (one_minus_cos(spot.inner_angle), one_minus_cos(spot.outer_angle));
        if spot.inner_angle == 180.0 {
            outer = ALL_DIRECTIONS;
        }
        let scale = (outer - inner).max(0.0).recip().min(SHARP);
        Self {
            axis: axis.to_array().map(S::from_f64),
            outer: S::from_f64(outer),
            scale: S::from_f64(scale),
        }
    }

    #[inline(always)]
    pub(super) fn factor<L: SimdFloat<Scalar = S>>(&self, wi: Vec3<L>) -> L {
        let Self { axis, outer, scale } = *self;
        spot_factor(wi, Vec3::splat(axis), L::splat(outer), L::splat(scale))
    }
}

/// Returns the factor of a spot's intensity, 0..=1, at surface points. `axis`, `outer` and `scale`
/// are the fields of each lane's [`SpotCone`]. `wi` is the unit vector from the point to the light.
#[inline(always)]
pub fn spot_factor<L: SimdFloat>(wi: Vec3<L>, axis: Vec3<L>, outer: L, scale: L) -> L {
    let s = (wi - axis).length_squared() * L::from_f64(0.5);
    let t = ((outer - s) * scale).max(L::zero()).min(L::one());
    t * t * (L::from_f64(3.0) - (t + t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{CompiledLight, DeltaLight, Falloff, Light};
    use std::f64::consts::PI;
    use zerkalo_kernel::lanes::{Double, Single};

    fn spot(inner_angle: f64, outer_angle: f64, falloff: Falloff) -> (Spot, Light) {
        let direction = [0.3, -2.0, 0.7];
        let spot = Spot { position: [0.5, 3.0, -1.0], direction, outer_angle, inner_angle };
        (spot, Light { falloff, ..Light::new(spot) })
    }

    fn compiled<L: SimdFloat>(light: &Light, origin: DVec3) -> DeltaLight<L::Scalar> {
        match light.compile(origin, |_| 0.0) {
            Some(CompiledLight::Delta(delta)) => delta,
            _ => panic!("a spot light has no size"),
        }
    }

    /// Checks that the irradiance around a spot light follows the smoothstep of the cosine of the
    /// angle to its axis. `L` is the number type and `epsilon` its rounding error.
    ///
    /// The tolerance follows from the rounding of the direction to the light: coordinates below 8
    /// and distances of at least 0.5 make it about ten times `epsilon`. The smoothstep multiplies
    /// this error by its slope, which is at most 1.5 times that of t, the variable of [`SpotCone`].
    fn check<L: SimdFloat>(epsilon: f64) {
        let origin = DVec3::new(0.25, 0.0, 0.5);
        for (inner, outer) in [(10.0, 30.0), (0.0, 90.0), (0.0, 0.5), (70.0, 160.0), (180.0, 180.0)]
        {
            for falloff in [Falloff::None, Falloff::InverseSquare] {
                let (Spot { position, direction, .. }, light) = spot(inner, outer, falloff);
                let compiled = compiled::<L>(&light, origin);
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
                    let found = sample.irradiance.x.lane(0).to_f64();
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
        let (Spot { position, direction, .. }, light) = spot(20.0, 20.0, Falloff::None);
        let compiled = compiled::<f64>(&light, DVec3::ZERO);
        let axis = DVec3::from(direction).normalize();
        for (degrees, expected) in [(0.0, PI), (19.999, PI), (20.001, 0.0), (180.0, 0.0)] {
            let angle = f64::to_radians(degrees);
            let along = axis * angle.cos() + axis.any_orthonormal_vector() * angle.sin();
            let point = DVec3::from(position) + along;
            let found = compiled.sample_li(Vec3::<f64>::of(point.to_array())).irradiance.x;
            assert_eq!(found, expected, "{degrees}");
        }
    }
}
