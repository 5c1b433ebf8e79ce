//! BVH over the primitives of a scene.

use crate::bvh::packet::{PacketBounds, SlabPacket, traverse_packet, with_stack};
use crate::bvh::single::traverse_rays;
use crate::bvh::{BVH_WIDTH, BuildQuality, Bvh8, Bvh8Build, Ray};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::aggregate::primitive_box::padded;
use crate::primitive::canonical::Bounds;
use glam::DVec3;

/// Coherence limit of a BVH with one primitive. With n primitives, the argument `turn` of
/// [`Ray::is_coherent`] is this limit divided by sqrt(n), and `shift` is `turn` times the extent of
/// the primitives.
///
/// Measured with spheres inside a large ball and packets of eight rays. A packet is as fast as
/// single rays if its directions differ by 0.8 with 256 spheres, 0.4 with 1000 and 0.13 with
/// 10,000. With 100 spheres, even packets of random rays are as fast as single rays. For packets of
/// four rays, these differences are at most half as large.
const COHERENCE_LIMIT: f64 = 1.5;

/// BVH over the primitives of a scene, one primitive per leaf.
pub struct SceneBvh {
    boxes: Bvh8,
    /// Primitive in each leaf of the BVH, as its index in the list given to [`SceneBvh::new`].
    primitives: Vec<u32>,
    /// Largest difference of unit directions divided by `WIDTH`: `turn` of [`Ray::is_coherent`].
    turn: f64,
    /// Largest difference of origins divided by `WIDTH`: `shift` of [`Ray::is_coherent`].
    shift: f64,
}

impl SceneBvh {
    /// Builds the BVH over the bounding boxes of the primitives, at least one.
    pub fn new(bounds: &[Bounds]) -> Self {
        // The builder takes boxes in single precision.
        let corners = |i: usize| {
            let [low, high] = padded(bounds[i], f64::from(f32::EPSILON));
            [low.as_vec3().to_array(), high.as_vec3().to_array()]
        };
        let Bvh8Build { bvh: boxes, order, leaves } =
            Bvh8::build(bounds.len(), corners, 1, BuildQuality::MEDIUM);
        let primitives = leaves.iter().map(|(first, _)| order[*first as usize]).collect();
        let low = bounds.iter().map(|b| b.0).fold(DVec3::INFINITY, DVec3::min);
        let high = bounds.iter().map(|b| b.1).fold(DVec3::NEG_INFINITY, DVec3::max);
        let turn = COHERENCE_LIMIT / (bounds.len() as f64).sqrt();
        Self { boxes, primitives, turn, shift: turn * (high - low).max_element() }
    }

    /// Calls `leaf(primitive, limit)` for the primitives whose boxes a ray may enter at a distance
    /// up to its `limit`, approximately from near to far. `primitive` is the index of the box in
    /// the list given to [`SceneBvh::new`]. `leaf` returns the new limits. Lanes whose limit is not
    /// positive are inactive.
    #[inline(always)]
    pub fn traverse<L: SimdFloat>(
        &self,
        ray: &Ray<L>,
        limit: L,
        mut leaf: impl FnMut(usize, L) -> L,
    ) {
        let wanted = limit.gt(L::zero()).bits();
        if wanted == 0 {
            return;
        }
        // Boxes are enlarged by a few rounding errors of the ray's origin. Otherwise a ray could
        // miss the box of a primitive that it hits.
        let pad = ray.origin.max_abs() * L::from_f64(4.0 * L::EPSILON);
        let packet = SlabPacket::new(ray, Vec3::new(pad, pad, pad));
        let boxes = &self.boxes;
        if ray.is_coherent(wanted, self.turn, self.shift) {
            let bounds = PacketBounds::around(&packet, wanted);
            let leaf = |number: usize, limit| leaf(self.primitives[number] as usize, limit);
            return with_stack::<_, _, 128, 512>(BVH_WIDTH, boxes, |stack| {
                traverse_packet(boxes, &packet, bounds.as_ref(), limit, stack, leaf)
            });
        }
        let numbers = L::from_fn(|lane| L::Scalar::from_f64(lane as f64));
        let leaf = |lane: usize, number: usize, limit: L::Scalar| {
            let number_of = L::from_f64(lane as f64);
            let lane_mask = numbers.le(number_of) & numbers.ge(number_of);
            let limit = L::select(lane_mask, L::splat(limit), L::from_f64(-1.0));
            leaf(self.primitives[number] as usize, limit).lane(lane)
        };
        with_stack::<_, _, 64, 128>(L::WIDTH, boxes, |stack| {
            traverse_rays(boxes, &packet, limit, stack, |_| (), leaf)
        });
    }
}
