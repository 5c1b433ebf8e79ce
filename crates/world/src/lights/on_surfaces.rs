//! End points of shadow rays to point lights that are located on a surface, such as ceiling lights.
//!
//! Shadow rays start a small offset above the surface that they leave. Shadow rays to a light on a
//! surface end at a similar small offset before that surface, on the side from which they arrive.
//! The shadows are the limit of those of a light that approaches the surface from that side. With
//! an end point at the light itself, rounding would decide whether the surface occludes it. With an
//! end point a fixed length before the light, a ray at a grazing angle would be occluded by the
//! surface.

use glam::DVec3;
use zerkalo_kernel::lanes::{Float, SimdFloat, Vec3};
use zerkalo_kernel::primitive::Form;

/// Largest distance at which a point light counts as on a surface, in rounding errors of the
/// largest coordinate.
const ON: f64 = 8.0;

/// Rounding error of coordinates that people write, as a fraction of the largest coordinate. A light
/// that is on a surface but for this error counts as on it in either precision.
pub(crate) const WRITTEN: f64 = 1e-7;

/// Height above a light's surface at which shadow rays to the light end, in rounding errors of the
/// largest coordinate.
const LIFT: f64 = 16.0;

/// Largest distance by which one solid moves the end point of shadow rays away from a light on its
/// surface, as a multiple of the height above the surface ([`LIFT`]). At a sharp edge this distance
/// must exceed the height, so that the end point clears both sides of the edge.
const SHARPEST: f64 = 4.0;

/// Surfaces on which a point light is located.
pub(crate) struct OnSurface<S> {
    position: [S; 3],
    /// Unit normals at the light, one list for each convex solid, flat shape or mesh.
    solids: Vec<Vec<[S; 3]>>,
    lift: S,
}

impl<S: Float> OnSurface<S> {
    /// Finds the surfaces that contain the position of a light. `forms` and `position` are relative
    /// to `origin`; `epsilon` is the relative rounding error of coordinates. Returns `None` if the
    /// light is on no surface.
    pub fn new(forms: &[Form], position: DVec3, origin: DVec3, epsilon: f64) -> Option<Self> {
        let mut solids = Vec::new();
        let mut largest = 0.0f64;
        // Rounding error of the coordinates in the scene file, which are in double precision.
        let given = f64::EPSILON * origin.abs().max_element();
        for form in forms {
            let reach = form.max_coordinate();
            let size = reach.max(position.abs().max_element());
            let mut rounding = (epsilon * size).max(given);
            let mut normals = form.normals_at(position, ON * rounding);
            if normals.is_empty() && ON * rounding < WRITTEN * size {
                rounding = WRITTEN * size / ON;
                normals = form.normals_at(position, ON * rounding);
            }
            if !normals.is_empty() {
                largest = largest.max(rounding);
            }
            let rounded = |normal: DVec3| normal.to_array().map(S::from_f64);
            solids.extend(normals.into_iter().map(|list| list.into_iter().map(rounded).collect()));
        }
        let lift = S::from_f64(LIFT * largest);
        let position = position.to_array().map(S::from_f64);
        (!solids.is_empty()).then_some(Self { position, solids, lift })
    }

    /// Returns an upper bound of the distance between the light and an end point of its shadow
    /// rays.
    pub fn farthest(&self) -> f64 {
        SHARPEST * self.lift.to_f64() * self.solids.len() as f64
    }

    /// Returns the unit direction and the distance from `start` to the end point of the light's
    /// shadow ray, a little above the light's surface.
    #[inline(never)]
    pub fn end<L: SimdFloat<Scalar = S>>(&self, start: Vec3<L>) -> (Vec3<L>, L) {
        let to = Vec3::splat(self.position) - start;
        let mut end = to;
        for normals in &self.solids {
            let mut outside = L::mask(false);
            let (mut out, mut inward) = (Vec3::zero(), Vec3::zero());
            for normal in normals.iter().map(|n| Vec3::splat(*n)) {
                let before = to.dot(normal).lt(L::zero());
                outside = outside | before;
                out = Vec3::select(before, out + normal, out);
                inward = inward - normal;
            }
            let lift = Vec3::select(outside, out, inward);
            // Height of the point that is displaced from the light by `lift`: the smallest height
            // above any of the surfaces in front of which the ray ends.
            let mut least = L::from_f64(L::MAX);
            for normal in normals.iter().map(|n| Vec3::splat(*n)) {
                let before = to.dot(normal).lt(L::zero()) | !outside;
                least = L::select(before, least.min(normal.dot(lift).abs()), least);
            }
            let longest = lift.length_squared().sqrt() * L::from_f64(1.0 / SHARPEST);
            let scale = L::splat(self.lift) / least.max(longest);
            end = lift.mul_add(scale, end);
        }
        let distance = end.length_squared().sqrt();
        (end * (L::one() / distance), distance)
    }
}
