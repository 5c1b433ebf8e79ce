//! BVH over the primitives of a scene. The rays of a coherent packet traverse it together, those of
//! other packets separately, but interleaved.

use crate::bvh::Ray;
use crate::bvh::packet::{PacketBounds, SlabPacket, traverse_packet, with_stack};
use crate::bvh::single::traverse_rays;
use crate::bvh::{BVH_WIDTH, BuildQuality, Bvh8, Bvh8Build};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::primitive_box::padded;
use glam::DVec3;

/// Coherence limit of the scene's BVH: it determines which packets of rays traverse the BVH as a
/// whole. The rays of other packets traverse it separately.
///
/// Every active ray of a packet is compared with the first active ray. The packet is coherent if
/// two numbers are at most a bound in every comparison. The first is the length of the difference
/// of the unit directions. The second is the largest coordinate of the difference of the origins,
/// divided by the largest extent of the primitives. The bound is this constant times the number of
/// lanes, divided by the square root of the number of primitives.
///
/// Measured with spheres inside a large ball and packets of eight rays. A packet is as fast as
/// single rays if its differences are 0.8 with 256 spheres, 0.4 with 1000 and 0.13 with 10,000.
/// With 100 spheres, even packets of random rays are as fast as single rays. For packets of four
/// rays, the differences at which both are equally fast are at most half as large.
const COHERENCE_LIMIT: f64 = 1.5;

/// BVH over the primitives of a scene, one primitive per leaf.
pub struct SceneBvh {
    boxes: Bvh8,
    /// Primitive in each leaf of the BVH, as its index in the list given to [`SceneBvh::new`].
    primitives: Vec<u32>,
    /// Bound for coherent packets, divided by the number of lanes: the largest length of the
    /// difference between the directions of a ray and of the packet's first active ray.
    turn: f64,
    /// Bound for coherent packets, divided by the number of lanes: the largest difference, along
    /// any axis, between the origins of a ray and of the packet's first active ray.
    shift: f64,
}

impl SceneBvh {
    /// Builds the BVH over `bounds`: the lowest and the highest corner of each primitive's bounding
    /// box. `bounds` must not be empty.
    pub fn new(bounds: &[(DVec3, DVec3)]) -> Self {
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

    /// Calls `leaf(primitive, limit)` for the primitives whose boxes a ray may enter at a distance up to
    /// its `limit`, approximately from near to far. `primitive` is the position of the primitive's box
    /// in the list given to [`SceneBvh::new`]. `leaf` returns the new limits. Boxes entered at
    /// exactly the limit are visited, too. Lanes whose limit is not positive are inactive.
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
        // miss the box of a primitive although the rounded test of the primitive itself finds a
        // hit.
        let pad = ray.origin.max_abs() * L::from_f64(4.0 * L::EPSILON);
        let packet = SlabPacket::new(ray, Vec3::new(pad, pad, pad));
        let boxes = &self.boxes;
        if self.is_coherent(ray, wanted) {
            let bounds = PacketBounds::around(&packet, wanted);
            let leaf = |number: usize, limit| leaf(self.primitives[number] as usize, limit);
            return with_stack::<_, _, 128, 512>(BVH_WIDTH, boxes, |stack| {
                traverse_packet(boxes, (&packet, bounds.as_ref()), limit, stack, leaf)
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
            traverse_rays(boxes, (&packet, limit), wanted, stack, |_| (), leaf)
        });
    }

    /// Returns `true` if the rays in the lanes `wanted` traverse the BVH as a packet, because they
    /// are coherent (see [`COHERENCE_LIMIT`]).
    #[inline(always)]
    fn is_coherent<L: SimdFloat>(&self, ray: &Ray<L>, wanted: u32) -> bool {
        if L::WIDTH == 1 || wanted.count_ones() < 2 {
            return false;
        }
        let width = L::WIDTH as f64;
        ray.is_coherent(wanted, width * self.turn, width * self.shift)
    }
}
