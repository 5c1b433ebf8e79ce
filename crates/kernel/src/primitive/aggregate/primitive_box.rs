//! Bounding boxes of single primitives, axis-aligned or oriented. A ray is tested against the box
//! before the primitive.

use crate::bvh::Ray;
use crate::bvh::packet::SlabPacket;
use crate::lanes::{Float, SimdFloat, Vec3};
use crate::primitive::canonical::{Bounds, CanonicalShape, rows};
use crate::primitive::unit_space::UnitSpace;
use glam::DVec3;

/// Bounding box of one primitive.
pub struct PrimitiveBox<S> {
    low: [S; 3],
    high: [S; 3],
    /// Object space of an oriented box; `None` if the box is axis-aligned in the scene.
    space: Option<BoxFrame<S>>,
}

/// Object space of an oriented bounding box, whose origin is the centre of the box.
struct BoxFrame<S> {
    unit_space: UnitSpace<S>,
    /// Largest factor by which the map to object space enlarges rounding errors along each axis:
    /// the sum of the magnitudes in the matrix row of this axis.
    growth: [S; 3],
    /// Largest magnitude of a coordinate of the primitive in the scene.
    reach: S,
}

/// Returns the corners of a bounding box, moved outward by 4 `epsilon` times the largest
/// coordinate. `epsilon` is the relative rounding error. The margin covers the errors of the box
/// and of the primitive's own intersection test.
pub fn padded((low, high): Bounds, epsilon: f64) -> [DVec3; 2] {
    let reach = low.abs().max(high.abs()).max_element();
    let pad = DVec3::splat(reach * 4.0 * epsilon);
    [low - pad, high + pad]
}

/// Rounding error of a bounding box in double precision, as a fraction of the largest coordinate.
/// Far from the scene file's origin, a solid may extend beyond its box by this error, because box
/// and solid are rounded separately.
pub const GIVEN: f64 = 1.0 / 4_294_967_296.0;

impl<S: Float> PrimitiveBox<S> {
    /// Returns the bounding box of a canonical form; `None` without finite bounds. If `oriented` is
    /// `true` and the form has an object space, the box is in that space.
    pub fn new(form: &dyn CanonicalShape, oriented: bool) -> Option<Self> {
        let bounds = form.bounds()?;
        let vector = |v: DVec3| v.to_array().map(S::from_f64);
        let made = |bounds, space| {
            let [low, high] = padded(bounds, S::EPSILON.max(GIVEN)).map(vector);
            Self { low, high, space }
        };
        let Some((scene_from_own, (low, high))) = form.oriented_box().filter(|_| oriented) else {
            return Some(made(bounds, None));
        };
        let middle = 0.5 * (low + high);
        let center = scene_from_own.transform_point3(middle);
        let space = BoxFrame {
            unit_space: UnitSpace::new(center, scene_from_own.matrix3),
            growth: rows(&scene_from_own.matrix3.inverse())
                .map(|r| S::from_f64(r.abs().element_sum())),
            reach: S::from_f64(bounds.0.abs().max(bounds.1.abs()).max_element()),
        };
        Some(made((low - middle, high - middle), Some(space)))
    }

    /// Returns the lanes whose ray may hit the primitive in this box at a distance up to `limit`.
    #[inline(always)]
    pub fn meets<L: SimdFloat<Scalar = S>>(&self, ray: &Ray<L>, limit: L) -> L::Mask {
        let far = ray.origin.max_abs();
        let packet = match &self.space {
            None => {
                let pad = far * L::from_f64(4.0 * L::EPSILON);
                SlabPacket::new(ray, Vec3::new(pad, pad, pad))
            }
            Some(space) => {
                // Upper bound, in scene units, of the rounding errors of the ray's origin and
                // direction, and of the box's centre.
                let lost = (far + L::splat(space.reach)) * L::from_f64(64.0 * L::EPSILON);
                SlabPacket::new(&space.unit_space.ray(ray), Vec3::splat(space.growth) * lost)
            }
        };
        packet.enters(Vec3::splat(self.low), Vec3::splat(self.high), limit)
    }
}
