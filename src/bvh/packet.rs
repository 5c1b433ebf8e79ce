//! Packet BVH traversal with interval culling.
//!
//! A coherent packet is tested against a node's eight boxes at once by interval bounds: the
//! smallest and the largest of its rays' origins and inverse directions on each axis (Boulos, Wald
//! and Shirley 2006, *Geometric and Arithmetic Culling Methods for Entire Ray Packets*). The rays
//! themselves are tested against the remaining boxes only. The single-ray traversal (`single.rs`)
//! tests eight boxes by the same operations, as a packet whose bounds coincide.

use crate::bvh::Ray;
use crate::bvh::{BVH_WIDTH, Bvh8, Bvh8Node, LEAF_FLAG};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};

/// Ray packet prepared for slab tests.
#[derive(Clone, Copy)]
pub struct SlabPacket<L> {
    /// Origins, plus and minus the padding of the boxes.
    pub(crate) above: Vec3<L>,
    pub(crate) below: Vec3<L>,
    /// Reciprocals of the directions, always finite.
    pub(crate) inverse: Vec3<L>,
}

impl<L: SimdFloat> SlabPacket<L> {
    /// Prepares rays. Tests treat boxes as larger by `pad` on both sides of each axis; this covers
    /// the rounding of the primitives' own tests.
    #[inline(always)]
    pub fn new(ray: &Ray<L>, pad: Vec3<L>) -> Self {
        let safe = |d: L| L::one() / d.abs().max(L::from_f64(1e-30)).copysign(d);
        let d = ray.direction;
        let inverse = Vec3::new(safe(d.x), safe(d.y), safe(d.z));
        Self { above: ray.origin + pad, below: ray.origin - pad, inverse }
    }

    /// Mask of rays that enter box `i` of a node at a distance of at most `limit`.
    #[inline(always)]
    fn enters_child(&self, node: &Bvh8Node, i: usize, limit: L) -> L::Mask {
        let corner = |k: usize| {
            let axis = |a: usize| broadcast(node.bounds[k + a][i]);
            Vec3::new(axis(0), axis(1), axis(2))
        };
        self.enters(corner(0), corner(3), limit)
    }

    /// Mask of rays that enter the box between the corners `low` and `high` at a distance of at
    /// most `limit`.
    #[inline(always)]
    pub fn enters(&self, low: Vec3<L>, high: Vec3<L>, limit: L) -> L::Mask {
        let a = (low - self.above).component_mul(self.inverse);
        let b = (high - self.below).component_mul(self.inverse);
        let near = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z)).max(L::zero());
        let far = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)) * far_scale();
        near.le(far) & near.le(limit)
    }
}

/// Interval bounds of one or several rays whose directions have equal signs on each axis.
#[derive(Clone, Copy, Default)]
pub struct PacketBounds<S> {
    /// Index into [`Bvh8Node::bounds`] of the near and the far side of boxes, by axis.
    pub(crate) near: [usize; 3],
    pub(crate) far: [usize; 3],
    /// Origins subtracted from near and far sides.
    pub(crate) near_origin: [S; 3],
    pub(crate) far_origin: [S; 3],
    /// Smallest and largest reciprocals of the directions.
    pub(crate) inverse: [[S; 3]; 2],
}

impl<S: Float> PacketBounds<S> {
    /// Bounds the rays of `lanes`, at least one; `None` if the signs of their directions differ.
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
        let origin = |far: bool| {
            std::array::from_fn(|a| if negative[a] == far { above[a] } else { below[a] })
        };
        Some(Self {
            near: std::array::from_fn(|a| if negative[a] { a + 3 } else { a }),
            far: std::array::from_fn(|a| if negative[a] { a } else { a + 3 }),
            near_origin: origin(false),
            far_origin: origin(true),
            inverse: [low, high],
        })
    }

    /// Returns the smallest distance at which a ray may enter each box, and the mask of boxes that
    /// a ray may enter at a distance of at most `limit`. `side` returns the boxes' sides, numbered
    /// as in [`Bvh8Node::bounds`]. `ONE` is `true` for the bounds of a single ray.
    ///
    /// Rounded differences and products are monotonic, so that the bounds are conservative for
    /// [`SlabPacket::enters`].
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
            let (a, b) = (near.component_mul(high), far.component_mul(high));
            first = Vec3::new(first.x.min(a.x), first.y.min(a.y), first.z.min(a.z));
            last = Vec3::new(last.x.max(b.x), last.y.max(b.y), last.z.max(b.z));
        }
        let first = first.x.max(first.y).max(first.z).max(L::zero());
        let last = last.x.min(last.y).min(last.z) * far_scale();
        (first, first.le(last) & first.le(limit))
    }
}

/// Smallest and largest coordinates in the lanes of `mask`, of which `first` is one.
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

/// Factor of far distances that covers rounding, so that no hit is lost (Ize 2013, *Robust BVH Ray
/// Traversal*).
#[inline(always)]
fn far_scale<L: SimdFloat>() -> L {
    L::from_f64(1.0 + 8.0 * L::EPSILON)
}

/// The number `x` in all lanes.
#[inline(always)]
pub fn broadcast<L: SimdFloat>(x: f32) -> L {
    L::splat(L::Scalar::from_f64(f64::from(x)))
}

/// Loads part `part` of eight numbers. Lanes beyond the eight repeat them.
#[inline(always)]
pub fn load_wide<L: SimdFloat>(numbers: &[f32; BVH_WIDTH], part: usize) -> L {
    L::from_fn(|i| L::Scalar::from_f64(f64::from(numbers[(part * L::WIDTH + i) % BVH_WIDTH])))
}

/// Bits of the lanes that do not repeat numbers in [`load_wide`].
#[inline(always)]
pub const fn valid_lanes() -> u32 {
    (1 << BVH_WIDTH) - 1
}

/// Child that waits on the traversal stack, with its entry distance.
#[derive(Clone, Copy, Default)]
pub struct StackEntry<S> {
    child: u32,
    near: S,
}

/// Calls `traverse` with a stack of `per_level` entries for each level of the hierarchy. Up to
/// `LARGE` entries are on the call stack, more on the heap.
#[inline(always)]
pub fn with_stack<T: Copy + Default, R, const SMALL: usize, const LARGE: usize>(
    per_level: usize,
    bvh: &Bvh8,
    traverse: impl FnOnce(&mut [T]) -> R,
) -> R {
    let entries = per_level * bvh.depth();
    if entries <= SMALL {
        traverse(&mut [T::default(); SMALL])
    } else if entries <= LARGE {
        traverse(&mut [T::default(); LARGE])
    } else {
        traverse(&mut vec![T::default(); entries])
    }
}

/// Inserts an entry into the part of the stack from `base` on, which is sorted by descending
/// distance.
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

/// Traverses the hierarchy with a packet. Calls `leaf(index, limit)` for leaves whose boxes a ray
/// may enter at a distance of at most `limit`, in the order of their entry distances by `bounds`.
/// `leaf` returns the new limits. `bounds` are those of the lanes with a limit of at least zero;
/// `None` if these are incoherent.
#[inline(always)]
pub fn traverse_packet<L: SimdFloat>(
    bvh: &Bvh8,
    (packet, bounds): (&SlabPacket<L>, Option<&PacketBounds<L::Scalar>>),
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
            let node = &bvh.nodes()[child as usize];
            let base = top;
            for part in 0..BVH_WIDTH.div_ceil(L::WIDTH) {
                let side = |k: usize| load_wide(&node.bounds[k], part);
                let (near, candidates) = match bounds {
                    Some(bounds) => bounds.enters::<false, L>(side, L::splat(farthest)),
                    // Without bounds there is no order, but empty slots are excluded.
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
