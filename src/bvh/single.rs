//! The rays of a packet through a tree of boxes, each by itself, in turns: while one waits for its next
//! branch or leaf to come from memory, the others go on.
//!
//! A ray meets the eight boxes of a branch at once and goes to the nearest. The others wait in a frame,
//! not in order: the nearest of them is looked for when it is needed, without a jump. For what costs time
//! with random rays, but for memory, is jumps that the processor foretells wrongly.

use crate::bvh::packet::{PacketBounds, SlabPacket, load_wide, valid_lanes};
use crate::bvh::{BVH_WIDTH, Bvh8, Bvh8Node, LEAF_FLAG};
use crate::lanes::{Float, MAX_WIDTH, Mask, SimdFloat, Vec3, prefetch};

/// The boxes of a branch that a ray enters and that it has not visited.
#[derive(Clone, Copy, Default)]
pub struct StackFrame {
    /// By place, where the box is entered: the bits of a float, rounded down, the last three of them the
    /// place, so that the least key is the nearest box. [`NO_KEY`] and above: none.
    keys: [u32; BVH_WIDTH],
    branch: u32,
    /// How many there are.
    left: u32,
}

/// The bits of infinity.
const NO_KEY: u32 = 0x7f80_0000;

/// The bits of a key that tell the place.
const PLACE: u32 = BVH_WIDTH as u32 - 1;

/// One of the rays that take turns.
#[derive(Clone, Copy, Default)]
struct RayTraversal<S> {
    ray: PacketBounds<S>,
    limit: S,
    /// Where it goes next.
    child: u32,
    /// The number of its frames.
    frames: usize,
}

/// Calls `leaf(lane, leaf, limit)` for the leaves whose boxes the ray of a lane enters no farther than its
/// limit, nearer ones first; `leaf` returns the distance beyond which nothing matters to that ray any
/// more. `lanes`: those that go. `prefetch_leaf(leaf)` is called before a leaf is needed. `frames`: as many for each
/// lane as the tree is deep.
#[inline(never)]
pub fn traverse_rays<L: SimdFloat>(
    boxes: &Bvh8,
    (beam, limit): (&SlabPacket<L>, L),
    lanes: u32,
    frames: &mut [StackFrame],
    prefetch_leaf: impl Fn(usize),
    mut leaf: impl FnMut(usize, usize, L::Scalar) -> L::Scalar,
) {
    let room = boxes.depth();
    let mut walkers = RayTraversal::each(beam, limit);
    // Those whose next is a branch, and those whose next is a leaf.
    let (mut at_branch, mut at_leaf) = (lanes, 0u32);
    while at_branch | at_leaf != 0 {
        let (mut branches, mut leaves) = (at_branch, at_leaf);
        (at_branch, at_leaf) = (0, 0);
        let mut go = |lane: usize, child: u32| {
            if child & LEAF_FLAG != 0 {
                at_leaf |= 1 << lane;
                prefetch_leaf((child & !LEAF_FLAG) as usize);
            } else {
                at_branch |= 1 << lane;
                fetch(&boxes.branches()[child as usize]);
            }
        };
        while branches != 0 {
            let lane = branches.trailing_zeros() as usize % L::WIDTH;
            branches &= branches - 1;
            let (walker, frames) = (&mut walkers[lane], &mut frames[lane * room..][..room]);
            if walker.expand::<L>(boxes, frames) || walker.next(boxes, frames) {
                go(lane, walker.child);
            }
        }
        while leaves != 0 {
            let lane = leaves.trailing_zeros() as usize % L::WIDTH;
            leaves &= leaves - 1;
            let (walker, frames) = (&mut walkers[lane], &mut frames[lane * room..][..room]);
            walker.limit = leaf(lane, (walker.child & !LEAF_FLAG) as usize, walker.limit);
            if walker.next(boxes, frames) {
                go(lane, walker.child);
            }
        }
    }
}

/// Begins to bring a branch from memory.
#[inline(always)]
fn fetch(branch: &Bvh8Node) {
    let [a, _, b, _, c, _] = &branch.bounds;
    prefetch(a);
    prefetch(b);
    prefetch(c);
    prefetch(&branch.child);
}

/// Takes the least key; the others stay.
#[inline(always)]
fn take(keys: &mut [u32; BVH_WIDTH]) -> u32 {
    let least = keys.iter().fold(u32::MAX, |least, key| least.min(*key));
    *keys = keys.map(|key| if key == least { NO_KEY } else { key });
    least
}

impl<S: Float> RayTraversal<S> {
    /// Each lane's, at the root.
    #[inline(always)]
    fn each<L: SimdFloat<Scalar = S>>(beam: &SlabPacket<L>, limit: L) -> [Self; MAX_WIDTH] {
        let d = beam.inverse;
        let back = [d.x, d.y, d.z].map(|d| d.lt(L::zero()).bits() as usize);
        let select = |yes: Vec3<L>, no: Vec3<L>| {
            let axis = |d: L, yes, no| L::select(d.lt(L::zero()), yes, no);
            Vec3::new(axis(d.x, yes.x, no.x), axis(d.y, yes.y, no.y), axis(d.z, yes.z, no.z))
        };
        let near_origin = select(beam.below, beam.above);
        let far_origin = select(beam.above, beam.below);
        let mut each = [Self::default(); MAX_WIDTH];
        for (lane, walker) in each.iter_mut().enumerate().take(L::WIDTH) {
            let back = back.map(|back| back >> lane & 1);
            walker.limit = limit.lane(lane);
            walker.ray = PacketBounds {
                near: std::array::from_fn(|a| a + 3 * back[a]),
                far: std::array::from_fn(|a| a + 3 - 3 * back[a]),
                near_origin: near_origin.lane(lane),
                far_origin: far_origin.lane(lane),
                inverse: [d.lane(lane); 2],
            };
        }
        each
    }

    /// Goes to the nearest of the boxes of the branch at hand that the ray enters and makes a frame of the
    /// others; false: it enters none.
    #[inline(always)]
    fn expand<L: SimdFloat<Scalar = S>>(
        &mut self,
        boxes: &Bvh8,
        frames: &mut [StackFrame],
    ) -> bool {
        let branch = &boxes.branches()[self.child as usize];
        let (mut keys, mut met) = ([NO_KEY; BVH_WIDTH], 0);
        for part in 0..BVH_WIDTH.div_ceil(L::WIDTH) {
            let side = |k: usize| load_wide::<L>(&branch.bounds[k], part);
            let (near, enters) = self.ray.meets::<true, L>(side, L::splat(self.limit));
            let first = part * L::WIDTH;
            met |= (enters.bits() & valid_lanes()) << first;
            // Less by more than rounding to single precision may add: no key is beyond its box.
            let near =
                L::select(enters, near * L::from_f64(1.0 - 2e-7), L::from_f64(f64::INFINITY));
            for (i, key) in keys[first..].iter_mut().enumerate().take(L::WIDTH) {
                let bits = (near.lane(i).to_f64() as f32).to_bits();
                *key = bits & !(PLACE | 1 << 31) | (first + i) as u32;
            }
        }
        if met == 0 {
            return false;
        }
        let place = take(&mut keys) & PLACE;
        // Written even if nothing is left: a branch less to foretell.
        let left = met.count_ones() - 1;
        frames[self.frames] = StackFrame { keys, branch: self.child, left };
        self.frames += usize::from(left != 0);
        self.child = branch.child[place as usize];
        true
    }

    /// Goes to the nearest box of the last frame that still matters; false: there is none.
    #[inline(always)]
    fn next(&mut self, boxes: &Bvh8, frames: &mut [StackFrame]) -> bool {
        while self.frames > 0 {
            let frame = &mut frames[self.frames - 1];
            let least = take(&mut frame.keys);
            if S::from_f64(f64::from(f32::from_bits(least & !PLACE))) <= self.limit {
                frame.left -= 1;
                self.frames -= usize::from(frame.left == 0);
                let branch = &boxes.branches()[frame.branch as usize];
                self.child = branch.child[(least & PLACE) as usize];
                return true;
            }
            self.frames -= 1;
        }
        false
    }
}
