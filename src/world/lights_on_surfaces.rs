//! Lamps that lie on surfaces, such as ceiling lamps: where the shadow rays to them end.
//!
//! Shadow rays begin a little off the surface that they leave. To such a lamp they end as far off the
//! surfaces that it lies on, on the side that they come from: each of them goes to the limit of lamps that
//! come to the surface from there. A ray that ended at the lamp would be blocked or not by rounding, and
//! one that ended before it by a fixed length would be blocked by surfaces that it meets flatly.

use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::Form;
use glam::DVec3;

/// A lamp that is no farther from a surface than so many roundings of the largest coordinate lies on it.
const ON: f64 = 8.0;

/// Shadow rays end so many roundings of the largest coordinate off the surface.
const LIFT: f64 = 16.0;

/// At sharp edges shadow rays end farther off, to be clear of both sides; at most so many times.
const SHARPEST: f64 = 4.0;

/// A lamp and the surfaces that it lies on.
pub(super) struct OnSurface<S> {
    position: [S; 3],
    /// By convex solid, flat shape or mesh the unit normals there.
    solids: Vec<Vec<[S; 3]>>,
    lift: S,
}

impl<S: Float> OnSurface<S> {
    /// Creates the record of a lamp at `position` among `forms`, both around `origin`, where coordinates are rounded to
    /// `epsilon`; `None`: it lies on none.
    pub fn new(forms: &[Form], position: DVec3, origin: DVec3, epsilon: f64) -> Option<Self> {
        let mut solids = Vec::new();
        let mut largest = 0.0f64;
        // What the scene's own coordinates, in double precision, round off.
        let given = f64::EPSILON * origin.abs().max_element();
        for form in forms {
            let reach = form.max_coordinate();
            let rounding = (epsilon * reach.max(position.abs().max_element())).max(given);
            let normals = form.normals_at(position, ON * rounding);
            if !normals.is_empty() {
                largest = largest.max(rounding);
            }
            let rounded = |normal: DVec3| normal.to_array().map(S::from_f64);
            solids.extend(normals.into_iter().map(|of| of.into_iter().map(rounded).collect()));
        }
        let lift = S::from_f64(LIFT * largest);
        let position = position.to_array().map(S::from_f64);
        (!solids.is_empty()).then_some(Self { position, solids, lift })
    }

    /// Largest distance from the lamp at which shadow rays end.
    pub fn farthest(&self) -> f64 {
        SHARPEST * self.lift.to_f64() * self.solids.len() as f64
    }

    /// Unit directions from `start` to where shadow rays end, and how far that is.
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
            // The least height over the surfaces that the ray ends before.
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
