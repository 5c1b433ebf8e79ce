//! A bounding volume hierarchy for scenes with many items: packets that stay together walk it together,
//! others ray by ray.

use crate::bvh::Ray;
use crate::bvh::packet::{PacketBounds, SlabPacket, traverse_packet, with_stack};
use crate::bvh::single::traverse_rays;
use crate::bvh::{BVH_WIDTH, Bvh8, Bvh8Build};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::item_box::padded;
use glam::DVec3;
use obvhs::BvhBuildParams;

/// Packets go together whose directions differ by no more than this for each lane over the root of the
/// number of items (length of the difference of unit vectors), and whose origins by no more than that share
/// of the items' extent. Measured with spheres in a ball: of 100 even random rays go together as fast as
/// apart, of 256 such packets of eight that differ by 0.8, of 1000 by 0.4, of 10,000 by 0.13; packets of
/// four up to half of that.
const COHERENCE_LIMIT: f64 = 1.5;

/// A tree of boxes over items, one item a leaf.
pub struct SceneBvh {
    boxes: Bvh8,
    /// For each leaf its item.
    items: Vec<u32>,
    /// Largest difference for each lane between the rays of a packet that goes together, in direction and in
    /// origin.
    turn: f64,
    shift: f64,
}

impl SceneBvh {
    /// Over the boxes of all items, at least one, in item order.
    pub fn new(bounds: &[(DVec3, DVec3)]) -> Self {
        // The boxes of the builder are single precision.
        let corners = |i: usize| {
            let [low, high] = padded(bounds[i], f64::from(f32::EPSILON));
            [low.as_vec3().to_array(), high.as_vec3().to_array()]
        };
        let Bvh8Build { bvh: boxes, order, leaves } =
            Bvh8::build(bounds.len(), corners, 1, BvhBuildParams::medium_build());
        let items = leaves.iter().map(|(first, _)| order[*first as usize]).collect();
        let low = bounds.iter().map(|b| b.0).fold(DVec3::INFINITY, DVec3::min);
        let high = bounds.iter().map(|b| b.1).fold(DVec3::NEG_INFINITY, DVec3::max);
        let turn = COHERENCE_LIMIT / (bounds.len() as f64).sqrt();
        Self { boxes, items, turn, shift: turn * (high - low).max_element() }
    }

    /// Calls `leaf(item, limit)` for the items whose boxes rays may enter no farther than `limit`, nearer
    /// ones first as far as the tree knows; lanes whose limit is negative are of no interest. `leaf`
    /// returns the distances beyond which nothing matters any more. Items at that very distance are
    /// still called for.
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
        // What an item's own test rounds off of a distant origin must not be cut off by its box: the
        // boxes grow by a few roundings of the origin.
        let pad = ray.origin.max_abs() * L::from_f64(4.0 * L::EPSILON);
        let beam = SlabPacket::new(ray, Vec3::new(pad, pad, pad));
        let boxes = &self.boxes;
        if self.is_together(ray, wanted) {
            let bounds = PacketBounds::around(&beam, wanted);
            let leaf = |number: usize, limit| leaf(self.items[number] as usize, limit);
            return with_stack::<_, _, 128, 512>(BVH_WIDTH, boxes, |stack| {
                traverse_packet(boxes, (&beam, bounds.as_ref()), limit, stack, leaf)
            });
        }
        let numbers = L::from_fn(|lane| L::Scalar::from_f64(lane as f64));
        let leaf = |lane: usize, number: usize, limit: L::Scalar| {
            let number_of = L::from_f64(lane as f64);
            let here = numbers.le(number_of) & numbers.ge(number_of);
            let limit = L::select(here, L::splat(limit), L::from_f64(-1.0));
            leaf(self.items[number] as usize, limit).lane(lane)
        };
        with_stack::<_, _, 64, 128>(L::WIDTH, boxes, |stack| {
            traverse_rays(boxes, (&beam, limit), wanted, stack, |_| (), leaf)
        });
    }

    /// Returns `true` if the wanted rays of a packet are worth going together.
    #[inline(always)]
    fn is_together<L: SimdFloat>(&self, ray: &Ray<L>, wanted: u32) -> bool {
        if L::WIDTH == 1 || wanted.count_ones() < 2 {
            return false;
        }
        let width = L::WIDTH as f64;
        ray.is_coherent(wanted, width * self.turn, width * self.shift)
    }
}
