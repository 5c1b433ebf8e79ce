//! Single-ray BVH traversal of all rays of a packet, interleaved: while one ray waits for a node or
//! leaf from memory, the others advance.
//!
//! A ray is tested against the eight boxes of a node at once and continues with the nearest child.
//! The other children wait in a stack frame, unsorted. When the ray returns to the frame, it
//! selects the nearest of them without branches. Besides memory latency, mispredicted branches are
//! the main cost of incoherent rays.

use crate::bvh::packet::{PacketBounds, SlabPacket, load_wide, valid_lanes};
use crate::bvh::{BVH_WIDTH, Bvh8, Bvh8Node, LEAF_FLAG};
use crate::lanes::{Float, MAX_WIDTH, Mask, SimdFloat, Vec3, array_from_fn, prefetch};

/// Node on a ray's stack, with the children that the ray enters and has not visited yet.
#[derive(Clone, Copy, Default)]
pub struct StackFrame {
    /// Sort key of each slot: the bits of the distance at which the ray enters the child, with the
    /// slot number in the last three bits. A slot without a child to visit has [`NO_KEY`] or a
    /// larger key.
    keys: [u32; BVH_WIDTH],
    node: u32,
    /// Number of children that the ray has still to visit.
    remaining: u32,
}

/// Sort key of a slot without a child to visit: the bits of infinity in single precision.
const NO_KEY: u32 = 0x7f80_0000;

/// Mask of the low bits of a sort key, which hold the slot number of the child.
const SLOT_MASK: u32 = BVH_WIDTH as u32 - 1;

/// State of the traversal by one ray.
#[derive(Clone, Copy, Default)]
struct RayTraversal<S> {
    bounds: PacketBounds<S>,
    limit: S,
    /// Index of the node or leaf to visit next, as in [`Bvh8Node::child`].
    child: u32,
    /// Number of frames on the ray's stack.
    frames: usize,
}

/// Traverses the hierarchy with each ray separately, from near to far. For each leaf whose box the
/// ray of a lane enters within its limit, calls `leaf(lane, index, limit)`, which returns the new
/// limit. Before that, calls `prefetch_leaf(index)`; other rays advance in between. Rays whose
/// limit is not positive are inactive. `frames` has one stack frame for each lane and level.
#[inline(never)]
pub fn traverse_rays<L: SimdFloat>(
    bvh: &Bvh8,
    packet: &SlabPacket<L>,
    limit: L,
    frames: &mut [StackFrame],
    prefetch_leaf: impl Fn(usize),
    mut leaf: impl FnMut(usize, usize, L::Scalar) -> L::Scalar,
) {
    let levels = bvh.depth;
    let mut rays = RayTraversal::each(packet, limit);
    // Bits of the lanes whose next child is a node (`at_node`) or a leaf (`at_leaf`).
    let (mut at_node, mut at_leaf) = (limit.gt(L::zero()).bits(), 0u32);
    while at_node | at_leaf != 0 {
        let (mut node_lanes, mut leaf_lanes) = (at_node, at_leaf);
        (at_node, at_leaf) = (0, 0);
        let mut enqueue = |lane: usize, child: u32| {
            if child & LEAF_FLAG != 0 {
                at_leaf |= 1 << lane;
                prefetch_leaf((child & !LEAF_FLAG) as usize);
            } else {
                at_node |= 1 << lane;
                prefetch_node(&bvh.nodes[child as usize]);
            }
        };
        while node_lanes != 0 {
            let lane = node_lanes.trailing_zeros() as usize % L::WIDTH;
            node_lanes &= node_lanes - 1;
            let (ray, frames) = (&mut rays[lane], &mut frames[lane * levels..][..levels]);
            if ray.expand::<L>(bvh, frames) || ray.next(bvh, frames) {
                enqueue(lane, ray.child);
            }
        }
        while leaf_lanes != 0 {
            let lane = leaf_lanes.trailing_zeros() as usize % L::WIDTH;
            leaf_lanes &= leaf_lanes - 1;
            let (ray, frames) = (&mut rays[lane], &mut frames[lane * levels..][..levels]);
            ray.limit = leaf(lane, (ray.child & !LEAF_FLAG) as usize, ray.limit);
            if ray.next(bvh, frames) {
                enqueue(lane, ray.child);
            }
        }
    }
}

/// Prefetches the bounds of a BVH node, one address for every 64 bytes.
#[inline(always)]
fn prefetch_node(node: &Bvh8Node) {
    let [a, _, b, _, c, _] = &node.bounds;
    prefetch(a);
    prefetch(b);
    prefetch(c);
    prefetch(&node.child);
}

/// Removes and returns the smallest sort key.
#[inline(always)]
fn pop_least(keys: &mut [u32; BVH_WIDTH]) -> u32 {
    let least = keys.iter().fold(u32::MAX, |least, key| least.min(*key));
    *keys = keys.map(|key| if key == least { NO_KEY } else { key });
    least
}

impl<S: Float> RayTraversal<S> {
    /// Returns the initial state of each lane's ray, at the root.
    #[inline(always)]
    fn each<L: SimdFloat<Scalar = S>>(packet: &SlabPacket<L>, limit: L) -> [Self; MAX_WIDTH] {
        let d = packet.inverse;
        let negative = [d.x, d.y, d.z].map(|d| d.lt(L::zero()).bits() as usize);
        let select = |yes: Vec3<L>, no: Vec3<L>| {
            let axis = |d: L, yes, no| L::select(d.lt(L::zero()), yes, no);
            Vec3::new(axis(d.x, yes.x, no.x), axis(d.y, yes.y, no.y), axis(d.z, yes.z, no.z))
        };
        let near_origin = select(packet.below, packet.above);
        let far_origin = select(packet.above, packet.below);
        let mut each = [Self::default(); MAX_WIDTH];
        for (lane, ray) in each.iter_mut().enumerate().take(L::WIDTH) {
            let negative = negative.map(|bits| bits >> lane & 1);
            ray.limit = limit.lane(lane);
            ray.bounds = PacketBounds {
                near: array_from_fn(|a| a + 3 * negative[a]),
                far: array_from_fn(|a| a + 3 - 3 * negative[a]),
                near_origin: near_origin.lane(lane),
                far_origin: far_origin.lane(lane),
                inverse: [d.lane(lane); 2],
            };
        }
        each
    }

    /// Visits the current node: continues with the nearest child that the ray enters, and pushes a
    /// frame with the others. Returns `false` if the ray enters no child.
    #[inline(always)]
    fn expand<L: SimdFloat<Scalar = S>>(&mut self, bvh: &Bvh8, frames: &mut [StackFrame]) -> bool {
        let node = &bvh.nodes[self.child as usize];
        let (mut keys, mut entered) = ([NO_KEY; BVH_WIDTH], 0);
        for part in 0..BVH_WIDTH.div_ceil(L::WIDTH) {
            let side = |k: usize| load_wide::<L>(&node.bounds[k], part);
            let (near, enters) = self.bounds.enters::<true, L>(side, L::splat(self.limit));
            let first = part * L::WIDTH;
            entered |= (enters.bits() & valid_lanes()) << first;
            // The distance is reduced by more than the error of its rounding to single precision,
            // so that no child within the limit is skipped.
            let near =
                L::select(enters, near * L::from_f64(1.0 - 2e-7), L::from_f64(f64::INFINITY));
            for (i, key) in keys[first..].iter_mut().enumerate().take(L::WIDTH) {
                let bits = (near.lane(i).to_f64() as f32).to_bits();
                *key = bits & !(SLOT_MASK | 1 << 31) | (first + i) as u32;
            }
        }
        if entered == 0 {
            return false;
        }
        let slot = pop_least(&mut keys) & SLOT_MASK;
        // The frame is always written, which saves a branch. If no child remains, the next frame
        // overwrites this one.
        let remaining = entered.count_ones() - 1;
        frames[self.frames] = StackFrame { keys, node: self.child, remaining };
        self.frames += usize::from(remaining != 0);
        self.child = node.child[slot as usize];
        true
    }

    /// Continues with the nearest unvisited child within the limit, in the topmost frame with such
    /// a child. Returns `false` if there is none.
    #[inline(always)]
    fn next(&mut self, bvh: &Bvh8, frames: &mut [StackFrame]) -> bool {
        while self.frames > 0 {
            let frame = &mut frames[self.frames - 1];
            let least = pop_least(&mut frame.keys);
            if S::from_f64(f64::from(f32::from_bits(least & !SLOT_MASK))) <= self.limit {
                frame.remaining -= 1;
                self.frames -= usize::from(frame.remaining == 0);
                let node = &bvh.nodes[frame.node as usize];
                self.child = node.child[(least & SLOT_MASK) as usize];
                return true;
            }
            self.frames -= 1;
        }
        false
    }
}
