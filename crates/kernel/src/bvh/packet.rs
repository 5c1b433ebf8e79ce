//! Packet BVH traversal with interval culling. A coherent packet is tested against all eight boxes
//! of a node at once, by interval bounds of its rays (Boulos, Wald and Shirley 2006, *Geometric and
//! Arithmetic Culling Methods for Entire Ray Packets*). Its rays are then tested only against boxes
//! that pass. Single-ray traversal uses the same test, with the bounds of one ray.

use crate::bvh::{BVH_WIDTH, Bvh8, Bvh8Node, LEAF_FLAG, Ray};
use crate::lanes::{Float, Mask, SimdFloat, Vec3, array_from_fn};

/// Ray packet with values precomputed for slab tests against bounding boxes.
#[derive(Clone, Copy)]
pub struct SlabPacket<L> {
    /// Ray origins plus the padding by which boxes are enlarged.
    pub above: Vec3<L>,
    /// Ray origins minus the padding.
    pub below: Vec3<L>,
    /// Reciprocals of the ray directions. They are finite even if a component is 0.
    pub inverse: Vec3<L>,
}

impl<L: SimdFloat> SlabPacket<L> {
    /// Prepares slab tests that enlarge boxes by `pad` on each side, to cover the rounding errors
    /// of the primitives' own intersection tests.
    #[inline(always)]
    pub fn new(ray: &Ray<L>, pad: Vec3<L>) -> Self {
        let safe = |d: L| L::one() / d.abs().max(L::from_f64(1e-30)).copysign(d);
        let d = ray.direction;
        let inverse = Vec3::new(safe(d.x), safe(d.y), safe(d.z));
        Self { above: ray.origin + pad, below: ray.origin - pad, inverse }
    }

    #[inline(always)]
    fn enters_child(&self, node: &Bvh8Node, i: usize, limit: L) -> L::Mask {
        let corner = |k: usize| {
            let axis = |a: usize| broadcast(node.bounds[k + a][i]);
            Vec3::new(axis(0), axis(1), axis(2))
        };
        self.enters(corner(0), corner(3), limit)
    }

    /// Returns the mask of rays that enter the box from `low` to `high` at a distance of at most
    /// `limit`.
    #[inline(always)]
    pub fn enters(&self, low: Vec3<L>, high: Vec3<L>, limit: L) -> L::Mask {
        let a = (low - self.above).component_mul(self.inverse);
        let b = (high - self.below).component_mul(self.inverse);
        let near = a.min(b).max_element().max(L::zero());
        let far = a.max(b);
        let far = far.x.min(far.y).min(far.z) * far_scale();
        near.le(far) & near.le(limit)
    }
}

/// Interval bounds of the origins and inverse directions of rays whose directions have equal signs
/// on each axis.
#[derive(Clone, Copy, Default)]
pub struct PacketBounds<S> {
    /// Rows of [`Bvh8Node::bounds`] with the box sides that the rays pass first, for each axis.
    pub near: [usize; 3],
    /// Rows of [`Bvh8Node::bounds`] with the box sides that the rays pass last, for each axis.
    pub far: [usize; 3],
    /// Numbers subtracted from the near sides, one per axis. For positive directions: largest ray
    /// origin plus the padding. For negative directions: smallest ray origin minus the padding.
    pub near_origin: [S; 3],
    /// Numbers subtracted from the far sides, one per axis. For positive directions: smallest ray
    /// origin minus the padding. For negative directions: largest ray origin plus the padding.
    pub far_origin: [S; 3],
    /// Smallest and largest reciprocals of the ray directions, one of each per axis.
    pub inverse: [[S; 3]; 2],
}

impl<S: Float> PacketBounds<S> {
    /// Computes the interval bounds of the rays in the lanes of the bit mask `lanes`, at least one.
    /// Returns `None` if the directions of two rays have different signs on an axis.
    #[inline(always)]
    pub fn around<L: SimdFloat<Scalar = S>>(packet: &SlabPacket<L>, lanes: u32) -> Option<Self> {
        let d = packet.inverse;
        for axis in [d.x, d.y, d.z] {
            let down = axis.lt(L::zero()).bits() & lanes;
            if down != 0 && down != lanes {
                return None;
            }
        }
        let first = lanes.trailing_zeros() as usize;
        let mask = L::from_fn(|i| L::Scalar::from_f64(f64::from(lanes >> i & 1))).gt(L::zero());
        let (_, above) = min_max(packet.above, mask, first);
        let (below, _) = min_max(packet.below, mask, first);
        let (low, high) = min_max(d, mask, first);
        let negative = low.map(|d| d < S::default());
        let origin =
            |far: bool| array_from_fn(|a| if negative[a] == far { above[a] } else { below[a] });
        Some(Self {
            near: array_from_fn(|a| if negative[a] { a + 3 } else { a }),
            far: array_from_fn(|a| if negative[a] { a } else { a + 3 }),
            near_origin: origin(false),
            far_origin: origin(true),
            inverse: [low, high],
        })
    }

    /// Tests one box per lane. Returns the smallest distance at which a ray may enter each box, and
    /// the lanes whose box a ray may enter within the distance `limit`. `side(k)` is row k of
    /// [`Bvh8Node::bounds`]. `ONE` is `true` if the bounds contain a single ray.
    ///
    /// If [`SlabPacket::enters`] accepts a box for a ray within the bounds, this function accepts
    /// the box, too, because rounded differences and products are monotonic in their operands.
    #[inline(always)]
    pub fn enters<const ONE: bool, L: SimdFloat<Scalar = S>>(
        &self,
        side: impl Fn(usize) -> L,
        limit: L,
    ) -> (L, L::Mask) {
        let sides = |[x, y, z]: [usize; 3]| Vec3::new(side(x), side(y), side(z));
        let [low, high] = self.inverse.map(Vec3::splat);
        let near = sides(self.near) - Vec3::splat(self.near_origin);
        let far = sides(self.far) - Vec3::splat(self.far_origin);
        let (mut first, mut last) = (near.component_mul(low), far.component_mul(low));
        if !ONE {
            first = first.min(near.component_mul(high));
            last = last.max(far.component_mul(high));
        }
        let first = first.max_element().max(L::zero());
        let last = last.x.min(last.y).min(last.z) * far_scale();
        (first, first.le(last) & first.le(limit))
    }
}

/// Returns the smallest and the largest coordinates of `v` in the lanes of `mask`, one of which is
/// `first`.
#[inline(always)]
fn min_max<L: SimdFloat>(
    v: Vec3<L>,
    mask: L::Mask,
    first: usize,
) -> ([L::Scalar; 3], [L::Scalar; 3]) {
    let v = Vec3::select(mask, v, Vec3::splat(v.lane(first)));
    let [x, y, z] = [v.x.min_max(), v.y.min_max(), v.z.min_max()];
    ([x.0, y.0, z.0], [x.1, y.1, z.1])
}

/// Returns the factor by which the slab test enlarges exit distances to cover rounding, so that no
/// hit is lost (Ize 2013, *Robust BVH Ray Traversal*).
#[inline(always)]
fn far_scale<L: SimdFloat>() -> L {
    L::from_f64(1.0 + 8.0 * L::EPSILON)
}

/// Returns `x` in every lane.
#[inline(always)]
pub fn broadcast<L: SimdFloat>(x: f32) -> L {
    L::splat(L::Scalar::from_f64(f64::from(x)))
}

/// Loads one number per lane, from index `part * WIDTH` on. If `WIDTH` is greater than 8, the eight
/// numbers are repeated.
#[inline(always)]
pub fn load_wide<L: SimdFloat>(numbers: &[f32; BVH_WIDTH], part: usize) -> L {
    L::from_fn(|i| L::Scalar::from_f64(f64::from(numbers[(part * L::WIDTH + i) % BVH_WIDTH])))
}

/// Returns the bit mask of the lanes that [`load_wide`] fills before it repeats numbers.
#[inline(always)]
pub const fn valid_lanes() -> u32 {
    (1 << BVH_WIDTH) - 1
}

/// Entry of the packet traversal stack: a child, and the smallest distance at which rays may enter
/// its box.
#[derive(Clone, Copy, Default)]
pub struct StackEntry<S> {
    child: u32,
    near: S,
}

/// Calls `traverse` with a stack of at least `per_level` entries for each level of the hierarchy.
/// The stack is an array of `SMALL` or `LARGE` entries, or on the heap if more are needed.
#[inline(always)]
pub fn with_stack<T: Copy + Default, R, const SMALL: usize, const LARGE: usize>(
    per_level: usize,
    bvh: &Bvh8,
    traverse: impl FnOnce(&mut [T]) -> R,
) -> R {
    let entries = per_level * bvh.depth;
    if entries <= SMALL {
        traverse(&mut [T::default(); SMALL])
    } else if entries <= LARGE {
        traverse(&mut [T::default(); LARGE])
    } else {
        traverse(&mut vec![T::default(); entries])
    }
}

/// Pushes `entry` onto the stack, which has `top` entries. The entries from index `base` on are
/// children of one node. They stay sorted by descending distance, so that the nearest child is
/// visited first.
#[inline(always)]
fn push_sorted<S: Float>(
    stack: &mut [StackEntry<S>],
    base: usize,
    top: &mut usize,
    entry: StackEntry<S>,
) {
    let mut position = *top;
    while position > base && stack[position - 1].near < entry.near {
        stack[position] = stack[position - 1];
        position -= 1;
    }
    stack[position] = entry;
    *top += 1;
}

/// Traverses the hierarchy with a ray packet. Calls `leaf(index, limit)` for each leaf whose box a
/// ray may enter within its limit. `leaf` returns the new limits. A ray with a negative limit is
/// inactive. `bounds` are the interval bounds of the active rays. If they are given, the children
/// of a node are visited in the order of their smallest possible entry distances.
#[inline(always)]
pub fn traverse_packet<L: SimdFloat>(
    bvh: &Bvh8,
    packet: &SlabPacket<L>,
    bounds: Option<&PacketBounds<L::Scalar>>,
    mut limit: L,
    stack: &mut [StackEntry<L::Scalar>],
    mut leaf: impl FnMut(usize, L) -> L,
) {
    let mut farthest = limit.min_max().1;
    let (mut top, mut child) = (0, 0);
    loop {
        if child & LEAF_FLAG != 0 {
            limit = leaf((child & !LEAF_FLAG) as usize, limit);
            farthest = limit.min_max().1;
        } else {
            let node = &bvh.nodes[child as usize];
            let base = top;
            for part in 0..BVH_WIDTH.div_ceil(L::WIDTH) {
                let side = |k: usize| load_wide(&node.bounds[k], part);
                let (near, candidates) = match bounds {
                    Some(bounds) => bounds.enters::<false, L>(side, L::splat(farthest)),
                    // Without bounds the children are not ordered by distance, and this test only
                    // excludes empty slots.
                    None => (L::zero(), side(0).le(side(3))),
                };
                let mut bits = candidates.bits() & valid_lanes() & ((1 << L::WIDTH) - 1);
                while bits != 0 {
                    let i = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let slot = part * L::WIDTH + i;
                    if packet.enters_child(node, slot, limit).any() {
                        let child = node.child[slot];
                        push_sorted(
                            stack,
                            base,
                            &mut top,
                            StackEntry { child, near: near.lane(i) },
                        );
                    }
                }
            }
        }
        loop {
            if top == 0 {
                return;
            }
            top -= 1;
            if stack[top].near <= farthest {
                break;
            }
        }
        child = stack[top].child;
    }
}
