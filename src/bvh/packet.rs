//! Packets of rays through a tree of boxes, together.
//!
//! A packet that stays together meets a branch's eight boxes at once by what bounds its rays: the
//! smallest and the largest of their origins and inverse directions on each axis (Boulos, Wald and
//! Shirley 2006, *Geometric and Arithmetic Culling Methods for Entire Ray Packets*). Each ray by itself
//! meets only the few boxes that are left. A single ray (`apart.rs`) meets eight boxes by the same
//! operations, as a packet whose bounds coincide.

use crate::bvh::Ray;
use crate::bvh::{BVH_WIDTH, Bvh8, Bvh8Node, LEAF_FLAG};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};

/// A packet as boxes want it.
#[derive(Clone, Copy)]
pub struct SlabPacket<L> {
    /// Origins, moved up and down by what the things' own tests round off.
    pub(crate) above: Vec3<L>,
    pub(crate) below: Vec3<L>,
    /// One over the directions, never infinite.
    pub(crate) inverse: Vec3<L>,
}

impl<L: SimdFloat> SlabPacket<L> {
    /// Rays that meet boxes as if these were larger by `pad` on both sides of each axis.
    #[inline(always)]
    pub fn new(ray: &Ray<L>, pad: Vec3<L>) -> Self {
        let safe = |d: L| L::one() / d.abs().max(L::from_f64(1e-30)).copysign(d);
        let d = ray.direction;
        let inverse = Vec3::new(safe(d.x), safe(d.y), safe(d.z));
        Self { above: ray.origin + pad, below: ray.origin - pad, inverse }
    }

    /// Which rays enter box `i` of a branch no farther than `limit`.
    #[inline(always)]
    fn meets(&self, branch: &Bvh8Node, i: usize, limit: L) -> L::Mask {
        let corner = |k: usize| {
            let axis = |a: usize| broadcast(branch.bounds[k + a][i]);
            Vec3::new(axis(0), axis(1), axis(2))
        };
        self.enters(corner(0), corner(3), limit)
    }

    /// Which rays enter the box between the corners `low` and `high` no farther than `limit`.
    #[inline(always)]
    pub fn enters(&self, low: Vec3<L>, high: Vec3<L>, limit: L) -> L::Mask {
        let a = (low - self.above).component_mul(self.inverse);
        let b = (high - self.below).component_mul(self.inverse);
        let near = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z)).max(L::zero());
        let far = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)) * far_scale();
        near.le(far) & near.le(limit)
    }
}

/// Bounds of rays that run the same way along each axis: of one ray, or of several.
#[derive(Clone, Copy, Default)]
pub struct PacketBounds<S> {
    /// By axis, which side of a box they meet first, and which last: as in [`Bvh8Node::sides`].
    pub(crate) near: [usize; 3],
    pub(crate) far: [usize; 3],
    /// What is taken from the near sides, and from the far ones.
    pub(crate) near_origin: [S; 3],
    pub(crate) far_origin: [S; 3],
    /// The smallest and the largest inverse direction.
    pub(crate) inverse: [[S; 3]; 2],
}

impl<S: Float> PacketBounds<S> {
    /// Of the rays of some lanes, at least one; `None`: they do not run the same way.
    #[inline(always)]
    pub fn around<L: SimdFloat<Scalar = S>>(beam: &SlabPacket<L>, lanes: u32) -> Option<Self> {
        let d = beam.inverse;
        for axis in [d.x, d.y, d.z] {
            let down = axis.lt(L::zero()).bits() & lanes;
            if down != 0 && down != lanes {
                return None;
            }
        }
        let first = lanes.trailing_zeros() as usize;
        let here = L::from_fn(|i| L::Scalar::from_f64(f64::from(lanes >> i & 1))).gt(L::zero());
        let (_, above) = ends(beam.above, here, first);
        let (below, _) = ends(beam.below, here, first);
        let (low, high) = ends(d, here, first);
        let back = low.map(|d| d < S::default());
        let origin =
            |far: bool| std::array::from_fn(|a| if back[a] == far { above[a] } else { below[a] });
        Some(Self {
            near: std::array::from_fn(|a| if back[a] { a + 3 } else { a }),
            far: std::array::from_fn(|a| if back[a] { a } else { a + 3 }),
            near_origin: origin(false),
            far_origin: origin(true),
            inverse: [low, high],
        })
    }

    /// Where at the earliest one of the rays enters boxes whose `side`s are given, as in
    /// [`Bvh8Node::sides`], and which of them one may enter no farther than `limit`. `ONE`: it is one ray.
    ///
    /// Differences and products are monotonic even when rounded, so that the bounds hold for whatever
    /// [`SlabPacket::meets`] finds.
    #[inline(always)]
    pub fn meets<const ONE: bool, L: SimdFloat<Scalar = S>>(
        &self,
        side: impl Fn(usize) -> L,
        limit: L,
    ) -> (L, L::Mask) {
        let of = |[x, y, z]: [usize; 3]| Vec3::new(side(x), side(y), side(z));
        let [low, high] = self.inverse.map(Vec3::splat);
        let near = of(self.near) - Vec3::splat(self.near_origin);
        let far = of(self.far) - Vec3::splat(self.far_origin);
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

/// The smallest and the largest coordinates in the lanes `here`, of which `first` is one.
#[inline(always)]
fn ends<L: SimdFloat>(v: Vec3<L>, here: L::Mask, first: usize) -> ([L::Scalar; 3], [L::Scalar; 3]) {
    let v = Vec3::select(here, v, Vec3::splat(v.lane(first)));
    let [x, y, z] = [v.x.min_max(), v.y.min_max(), v.z.min_max()];
    ([x.0, y.0, z.0], [x.1, y.1, z.1])
}

/// The far side of a box moves out by some roundings, so that no hit is lost (Ize 2013, *Robust BVH
/// Ray Traversal*).
#[inline(always)]
fn far_scale<L: SimdFloat>() -> L {
    L::from_f64(1.0 + 8.0 * L::EPSILON)
}

/// One number in all lanes.
#[inline(always)]
pub fn broadcast<L: SimdFloat>(x: f32) -> L {
    L::splat(L::Scalar::from_f64(f64::from(x)))
}

/// Part `part` of eight numbers, in lanes; lanes beyond them repeat.
#[inline(always)]
pub fn load_wide<L: SimdFloat>(numbers: &[f32; BVH_WIDTH], part: usize) -> L {
    L::from_fn(|i| L::Scalar::from_f64(f64::from(numbers[(part * L::WIDTH + i) % BVH_WIDTH])))
}

/// The lanes of a part that do not repeat.
#[inline(always)]
pub const fn valid_lanes() -> u32 {
    (1 << BVH_WIDTH) - 1
}

/// What waits to be visited: a child of a branch, and where it is entered.
#[derive(Clone, Copy, Default)]
pub struct StackEntry<S> {
    child: u32,
    near: S,
}

/// Calls `walk` with so many `things` for each branch on a way through a tree, usually on the processor's
/// own stack.
#[inline(always)]
pub fn with_stack<T: Copy + Default, R, const SMALL: usize, const LARGE: usize>(
    things: usize,
    boxes: &Bvh8,
    walk: impl FnOnce(&mut [T]) -> R,
) -> R {
    let room = things * boxes.depth();
    if room <= SMALL {
        walk(&mut [T::default(); SMALL])
    } else if room <= LARGE {
        walk(&mut [T::default(); LARGE])
    } else {
        walk(&mut vec![T::default(); room])
    }
}

/// Puts an entry on the stack, above those that are entered later, of the ones from `base` on.
#[inline(always)]
fn push_sorted<S: Float>(
    stack: &mut [StackEntry<S>],
    base: usize,
    top: &mut usize,
    entry: StackEntry<S>,
) {
    let mut at = *top;
    while at > base && stack[at - 1].near < entry.near {
        stack[at] = stack[at - 1];
        at -= 1;
    }
    stack[at] = entry;
    *top += 1;
}

/// Calls `leaf(leaf, limit)` for the leaves whose boxes a packet may enter no farther than `limit`, those
/// first that are nearer as far as `bounds` knows; `leaf` returns the distances beyond which nothing
/// matters any more. `bounds`: of the lanes whose limit is not negative, if they have any.
#[inline(always)]
pub fn traverse_packet<L: SimdFloat>(
    boxes: &Bvh8,
    (beam, bounds): (&SlabPacket<L>, Option<&PacketBounds<L::Scalar>>),
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
            let branch = &boxes.branches()[child as usize];
            let base = top;
            for part in 0..BVH_WIDTH.div_ceil(L::WIDTH) {
                let side = |k: usize| load_wide(&branch.bounds[k], part);
                let (near, met) = match bounds {
                    Some(bounds) => bounds.meets::<false, L>(side, L::splat(farthest)),
                    // Of no use to order them; but empty places are known.
                    None => (L::zero(), side(0).le(side(3))),
                };
                let mut bits = met.bits() & valid_lanes() & ((1 << L::WIDTH) - 1);
                while bits != 0 {
                    let i = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let place = part * L::WIDTH + i;
                    if beam.meets(branch, place, limit).any() {
                        let child = branch.child[place];
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
