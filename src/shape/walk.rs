//! Rays through a tree of boxes: a packet together, or one ray by itself.
//!
//! A packet that stays together meets a branch's eight boxes at once by what bounds its rays: the
//! smallest and the largest of their origins and inverse directions on each axis (Boulos, Wald and
//! Shirley 2006, *Geometric and Arithmetic Culling Methods for Entire Ray Packets*). Each ray by itself
//! meets only the few boxes that are left. A single ray meets eight boxes by the same operations, as a
//! packet whose bounds coincide.

use super::batch::Ray;
use crate::asset::{Boxes, Branch, LEAF, WIDE};
use crate::lanes::{Lanes, MAX_WIDTH, Mask, Real, V3, prefetch};

/// A packet as boxes want it.
#[derive(Clone, Copy)]
pub struct Beam<L> {
    /// Origins, moved up and down by what the things' own tests round off.
    above: V3<L>,
    below: V3<L>,
    /// One over the directions, never infinite.
    inverse: V3<L>,
}

impl<L: Lanes> Beam<L> {
    /// Rays that meet boxes as if these were larger by `pad` on both sides of each axis.
    #[inline(always)]
    pub fn new(ray: &Ray<L>, pad: V3<L>) -> Self {
        let safe = |d: L| L::one() / d.abs().max(L::of(1e-30)).copysign(d);
        let d = ray.direction;
        let inverse = V3::new(safe(d.x), safe(d.y), safe(d.z));
        Self { above: ray.origin + pad, below: ray.origin - pad, inverse }
    }

    /// Which rays enter box `i` of a branch no farther than `limit`.
    #[inline(always)]
    fn meets(&self, branch: &Branch, i: usize, limit: L) -> L::Mask {
        let corner = |k: usize| {
            let axis = |a: usize| all(branch.sides[k + a][i]);
            V3::new(axis(0), axis(1), axis(2))
        };
        self.enters(corner(0), corner(3), limit)
    }

    /// Which rays enter the box between the corners `low` and `high` no farther than `limit`.
    #[inline(always)]
    pub fn enters(&self, low: V3<L>, high: V3<L>, limit: L) -> L::Mask {
        let a = (low - self.above).times(self.inverse);
        let b = (high - self.below).times(self.inverse);
        let near = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z)).max(L::zero());
        let far = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)) * grown();
        near.le(far) & near.le(limit)
    }
}

/// Bounds of rays that run the same way along each axis: of one ray, or of several.
#[derive(Clone, Copy, Default)]
pub struct Sheaf<S> {
    /// By axis, which side of a box they meet first, and which last: as in [`Branch::sides`].
    near: [usize; 3],
    far: [usize; 3],
    /// What is taken from the near sides, and from the far ones.
    near_origin: [S; 3],
    far_origin: [S; 3],
    /// The smallest and the largest inverse direction.
    inverse: [[S; 3]; 2],
}

impl<S: Real> Sheaf<S> {
    /// Of the rays of some lanes, at least one; `None`: they do not run the same way.
    #[inline(always)]
    pub fn around<L: Lanes<Scalar = S>>(beam: &Beam<L>, lanes: u32) -> Option<Self> {
        let d = beam.inverse;
        for axis in [d.x, d.y, d.z] {
            let down = axis.lt(L::zero()).bits() & lanes;
            if down != 0 && down != lanes {
                return None;
            }
        }
        let first = lanes.trailing_zeros() as usize;
        let here = L::from_fn(|i| L::Scalar::of(f64::from(lanes >> i & 1))).gt(L::zero());
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
    /// [`Branch::sides`], and which of them one may enter no farther than `limit`. `ONE`: it is one ray.
    ///
    /// Differences and products are monotonic even when rounded, so that the bounds hold for whatever
    /// [`Beam::meets`] finds.
    #[inline(always)]
    pub fn meets<const ONE: bool, L: Lanes<Scalar = S>>(
        &self,
        side: impl Fn(usize) -> L,
        limit: L,
    ) -> (L, L::Mask) {
        let of = |[x, y, z]: [usize; 3]| V3::new(side(x), side(y), side(z));
        let [low, high] = self.inverse.map(V3::splat);
        let near = of(self.near) - V3::splat(self.near_origin);
        let far = of(self.far) - V3::splat(self.far_origin);
        let (mut first, mut last) = (near.times(low), far.times(low));
        if !ONE {
            let (a, b) = (near.times(high), far.times(high));
            first = V3::new(first.x.min(a.x), first.y.min(a.y), first.z.min(a.z));
            last = V3::new(last.x.max(b.x), last.y.max(b.y), last.z.max(b.z));
        }
        let first = first.x.max(first.y).max(first.z).max(L::zero());
        let last = last.x.min(last.y).min(last.z) * grown();
        (first, first.le(last) & first.le(limit))
    }
}

/// The smallest and the largest coordinates in the lanes `here`, of which `first` is one.
#[inline(always)]
fn ends<L: Lanes>(v: V3<L>, here: L::Mask, first: usize) -> ([L::Scalar; 3], [L::Scalar; 3]) {
    let v = V3::select(here, v, V3::splat(v.lane(first)));
    let [x, y, z] = [extremes(v.x), extremes(v.y), extremes(v.z)];
    ([x.0, y.0, z.0], [x.1, y.1, z.1])
}

/// The smallest and the largest lane; lanes that are no number do not count.
#[inline(always)]
fn extremes<L: Lanes>(x: L) -> (L::Scalar, L::Scalar) {
    let mut out = (L::Scalar::of(L::MAX), L::Scalar::of(-L::MAX));
    for i in 0..L::WIDTH {
        let x = x.lane(i);
        out.0 = if x < out.0 { x } else { out.0 };
        out.1 = if x > out.1 { x } else { out.1 };
    }
    out
}

/// The far side of a box moves out by some roundings, so that no hit is lost (Ize 2013, *Robust BVH
/// Ray Traversal*).
#[inline(always)]
fn grown<L: Lanes>() -> L {
    L::of(1.0 + 8.0 * L::EPSILON)
}

/// One number in all lanes.
#[inline(always)]
pub fn all<L: Lanes>(x: f32) -> L {
    L::splat(L::Scalar::of(f64::from(x)))
}

/// Part `part` of eight numbers, in lanes; lanes beyond them repeat.
#[inline(always)]
pub fn lanes_of<L: Lanes>(numbers: &[f32; WIDE], part: usize) -> L {
    L::from_fn(|i| L::Scalar::of(f64::from(numbers[(part * L::WIDTH + i) % WIDE])))
}

/// The lanes of a part that do not repeat.
#[inline(always)]
pub const fn fresh() -> u32 {
    (1 << WIDE) - 1
}

/// What waits to be visited: a child of a branch, and where it is entered.
#[derive(Clone, Copy, Default)]
pub struct Entry<S> {
    child: u32,
    near: S,
}

/// Calls `walk` with so many `things` for each branch on a way through a tree, usually on the processor's
/// own stack.
#[inline(always)]
pub fn with_stack<T: Copy + Default, R, const SMALL: usize, const LARGE: usize>(
    things: usize,
    boxes: &Boxes,
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
fn push<S: Real>(stack: &mut [Entry<S>], base: usize, top: &mut usize, entry: Entry<S>) {
    let mut at = *top;
    while at > base && stack[at - 1].near < entry.near {
        stack[at] = stack[at - 1];
        at -= 1;
    }
    stack[at] = entry;
    *top += 1;
}

/// The boxes of a branch that a ray enters and that it has not visited.
#[derive(Clone, Copy, Default)]
pub struct Frame {
    /// By place, where the box is entered: the bits of a float, rounded down, the last three of them the
    /// place, so that the least key is the nearest box. [`NO_KEY`] and above: none.
    keys: [u32; WIDE],
    branch: u32,
    /// How many there are.
    left: u32,
}

/// The bits of infinity.
const NO_KEY: u32 = 0x7f80_0000;

/// The bits of a key that tell the place.
const PLACE: u32 = WIDE as u32 - 1;

/// One of the rays that take turns.
#[derive(Clone, Copy, Default)]
struct Walker<S> {
    ray: Sheaf<S>,
    limit: S,
    /// Where it goes next.
    child: u32,
    /// The number of its frames.
    frames: usize,
}

/// Calls `leaf(lane, leaf, limit)` for the leaves whose boxes the ray of a lane enters no farther than its
/// limit, nearer ones first; `leaf` returns the distance beyond which nothing matters to that ray any
/// more. `lanes`: those that go. `soon(leaf)` is called before a leaf is needed. `frames`: as many for each
/// lane as the tree is deep.
///
/// The rays take turns: while one waits for its next branch or leaf to come from memory, others go on.
#[inline(never)]
pub fn apart<L: Lanes>(
    boxes: &Boxes,
    (beam, limit): (&Beam<L>, L),
    lanes: u32,
    frames: &mut [Frame],
    soon: impl Fn(usize),
    mut leaf: impl FnMut(usize, usize, L::Scalar) -> L::Scalar,
) {
    let room = boxes.depth();
    let mut walkers = Walker::each(beam, limit);
    // Those whose next is a branch, and those whose next is a leaf.
    let (mut at_branch, mut at_leaf) = (lanes, 0u32);
    while at_branch | at_leaf != 0 {
        let (mut branches, mut leaves) = (at_branch, at_leaf);
        (at_branch, at_leaf) = (0, 0);
        let mut go = |lane: usize, child: u32| {
            if child & LEAF != 0 {
                at_leaf |= 1 << lane;
                soon((child & !LEAF) as usize);
            } else {
                at_branch |= 1 << lane;
                fetch(&boxes.branches()[child as usize]);
            }
        };
        while branches != 0 {
            let lane = branches.trailing_zeros() as usize % L::WIDTH;
            branches &= branches - 1;
            let (walker, frames) = (&mut walkers[lane], &mut frames[lane * room..][..room]);
            if walker.open::<L>(boxes, frames) || walker.next(boxes, frames) {
                go(lane, walker.child);
            }
        }
        while leaves != 0 {
            let lane = leaves.trailing_zeros() as usize % L::WIDTH;
            leaves &= leaves - 1;
            let (walker, frames) = (&mut walkers[lane], &mut frames[lane * room..][..room]);
            walker.limit = leaf(lane, (walker.child & !LEAF) as usize, walker.limit);
            if walker.next(boxes, frames) {
                go(lane, walker.child);
            }
        }
    }
}

/// Begins to bring a branch from memory.
#[inline(always)]
fn fetch(branch: &Branch) {
    let [a, _, b, _, c, _] = &branch.sides;
    prefetch(a);
    prefetch(b);
    prefetch(c);
    prefetch(&branch.child);
}

/// Takes the least key; the others stay.
#[inline(always)]
fn take(keys: &mut [u32; WIDE]) -> u32 {
    let least = keys.iter().fold(u32::MAX, |least, key| least.min(*key));
    *keys = keys.map(|key| if key == least { NO_KEY } else { key });
    least
}

impl<S: Real> Walker<S> {
    /// Each lane's, at the root.
    #[inline(always)]
    fn each<L: Lanes<Scalar = S>>(beam: &Beam<L>, limit: L) -> [Self; MAX_WIDTH] {
        let d = beam.inverse;
        let back = [d.x, d.y, d.z].map(|d| d.lt(L::zero()).bits() as usize);
        let select = |yes: V3<L>, no: V3<L>| {
            let axis = |d: L, yes, no| L::select(d.lt(L::zero()), yes, no);
            V3::new(axis(d.x, yes.x, no.x), axis(d.y, yes.y, no.y), axis(d.z, yes.z, no.z))
        };
        let near_origin = select(beam.below, beam.above);
        let far_origin = select(beam.above, beam.below);
        let mut each = [Self::default(); MAX_WIDTH];
        for (lane, walker) in each.iter_mut().enumerate().take(L::WIDTH) {
            let back = back.map(|back| back >> lane & 1);
            walker.limit = limit.lane(lane);
            walker.ray = Sheaf {
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
    fn open<L: Lanes<Scalar = S>>(&mut self, boxes: &Boxes, frames: &mut [Frame]) -> bool {
        let branch = &boxes.branches()[self.child as usize];
        let (mut keys, mut met) = ([NO_KEY; WIDE], 0);
        for part in 0..WIDE.div_ceil(L::WIDTH) {
            let side = |k: usize| lanes_of::<L>(&branch.sides[k], part);
            let (near, enters) = self.ray.meets::<true, L>(side, L::splat(self.limit));
            let first = part * L::WIDTH;
            met |= (enters.bits() & fresh()) << first;
            // Less than half of what the key leaves out, but more than rounding to single precision.
            let near = L::select(enters, near * L::of(1.0 - 2e-7), L::of(f64::INFINITY));
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
        frames[self.frames] = Frame { keys, branch: self.child, left };
        self.frames += usize::from(left != 0);
        self.child = branch.child[place as usize];
        true
    }

    /// Goes to the nearest box of the last frame that still matters; false: there is none.
    #[inline(always)]
    fn next(&mut self, boxes: &Boxes, frames: &mut [Frame]) -> bool {
        while self.frames > 0 {
            let frame = &mut frames[self.frames - 1];
            let least = take(&mut frame.keys);
            if S::of(f64::from(f32::from_bits(least & !PLACE))) <= self.limit {
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

/// Calls `leaf(leaf, limit)` for the leaves whose boxes a packet may enter no farther than `limit`, those
/// first that are nearer as far as `bounds` knows; `leaf` returns the distances beyond which nothing
/// matters any more. `bounds`: of the lanes whose limit is not negative, if they have any.
#[inline(always)]
pub fn together<L: Lanes>(
    boxes: &Boxes,
    (beam, bounds): (&Beam<L>, Option<&Sheaf<L::Scalar>>),
    mut limit: L,
    stack: &mut [Entry<L::Scalar>],
    mut leaf: impl FnMut(usize, L) -> L,
) {
    let mut farthest = extremes(limit).1;
    let (mut top, mut child) = (0, 0);
    loop {
        if child & LEAF != 0 {
            limit = leaf((child & !LEAF) as usize, limit);
            farthest = extremes(limit).1;
        } else {
            let branch = &boxes.branches()[child as usize];
            let base = top;
            for part in 0..WIDE.div_ceil(L::WIDTH) {
                let side = |k: usize| lanes_of(&branch.sides[k], part);
                let (near, met) = match bounds {
                    Some(bounds) => bounds.meets::<false, L>(side, L::splat(farthest)),
                    // Of no use to order them; but empty places are known.
                    None => (L::zero(), side(0).le(side(3))),
                };
                let mut bits = met.bits() & fresh() & ((1 << L::WIDTH) - 1);
                while bits != 0 {
                    let i = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let place = part * L::WIDTH + i;
                    if beam.meets(branch, place, limit).any() {
                        let child = branch.child[place];
                        push(stack, base, &mut top, Entry { child, near: near.lane(i) });
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
