//! Rays through the triangles of one mesh, in the mesh's own space.
//!
//! Packets whose rays stay together go through the tree together; others ray by ray, eight boxes or
//! triangles at a time. Both compute each triangle by the same operations, so that a ray meets the
//! same triangle at the same distance either way.

use super::batch::Ray;
use crate::asset::{Branch, Leaf, Mesh, WIDE};
use crate::lanes::{Frame, Lanes, Mask, Real, V3};

/// Packets whose directions differ by no more than this (length of the difference of unit vectors),
/// and whose origins differ by no more than this share of the mesh's size, go together. Measured by
/// `benches/mesh.rs`, group `together or apart`.
const TOGETHER: f64 = 0.05;

/// Entries of the stack for trees of usual depth: seven a level, and the root.
const STACK: usize = 96;

/// Entries of the stack for any tree. A mesh has at most 2^26 triangles, but nothing bounds how far
/// a tree leans; its depth decides.
const DEEP_STACK: usize = 1024;

/// What waits on the stack: a child, whether it is a leaf, where it is entered.
type Entry = (u32, bool, f32);

/// The nearest triangle of each lane.
#[derive(Clone, Copy, Debug)]
pub struct Facet<L> {
    /// Distance, in lengths of the ray's direction; the limit where nothing nearer was met.
    pub t: L,
    /// Tag of the triangle's number; meaningless where nothing was met.
    pub triangle: L,
}

/// Rays as boxes and triangles want them: a packet, or one ray in every lane.
#[derive(Clone, Copy)]
struct Beam<L> {
    origin: V3<L>,
    /// Origins, moved up and down by what the triangles' test rounds off.
    above: V3<L>,
    below: V3<L>,
    frame: Frame<L>,
    inverse: V3<L>,
}

impl<L: Lanes> Beam<L> {
    #[inline(always)]
    fn new(ray: &Ray<L>, mesh: &Mesh) -> Self {
        let safe = |d: L| L::one() / d.abs().max(L::of(1e-30)).copysign(d);
        let d = ray.direction;
        let inverse = V3::new(safe(d.x), safe(d.y), safe(d.z));
        // A ray that passes a box's edge within the rounding of the frame and of the corners'
        // distances may still meet a triangle there.
        let [low, high] = mesh.mesh().bounds;
        let reach = low.iter().chain(&high).fold(0.0f32, |m, x| m.max(x.abs()));
        let pad = (ray.origin.max_abs() + all(reach)) * L::of(8.0 * L::EPSILON);
        let pad = V3::new(pad, pad, pad);
        Self {
            origin: ray.origin,
            above: ray.origin + pad,
            below: ray.origin - pad,
            frame: Frame::around(d),
            inverse,
        }
    }

    /// The ray of one lane in every lane.
    #[inline(always)]
    fn only(&self, lane: usize) -> Self {
        let all = |v: V3<L>| V3::splat(v.lane(lane));
        Self {
            origin: all(self.origin),
            above: all(self.above),
            below: all(self.below),
            frame: Frame { t: all(self.frame.t), b: all(self.frame.b), n: all(self.frame.n) },
            inverse: all(self.inverse),
        }
    }

    /// Where the ray meets a triangle, at a positive distance, on either side.
    ///
    /// The corners are projected along the ray onto the plane through its origin. A corner has one
    /// projection, whichever triangle it belongs to, and the sign of each edge's area is that of the
    /// exact value or zero: so no ray slips between two triangles that share an edge or a corner
    /// (after Woop, Benthin and Wald 2013, *Watertight Ray/Triangle Intersection*, with an orthonormal
    /// frame for the shear).
    #[inline(always)]
    fn meet(&self, corners: [V3<L>; 3]) -> (L, L::Mask) {
        let p = corners.map(|c| self.frame.to_local(c - self.origin));
        // Not fused: products rounded alike cannot change places.
        let area = |a: V3<L>, b: V3<L>| a.x * b.y - a.y * b.x;
        let (u, v, w) = (area(p[1], p[2]), area(p[2], p[0]), area(p[0], p[1]));
        let zero = L::zero();
        let left = u.ge(zero) & v.ge(zero) & w.ge(zero);
        let right = u.le(zero) & v.le(zero) & w.le(zero);
        // Seen edge on, the triangle is a line: 0 / 0 is met nowhere.
        let t = (u * p[0].z + v * p[1].z + w * p[2].z) / (u + v + w);
        (t, (left | right) & t.gt(zero))
    }

    /// The eight corners `k` of a leaf's triangles, a part of them in lanes.
    #[inline(always)]
    fn corners(leaf: &Leaf, part: usize) -> [V3<L>; 3] {
        leaf.corners.each_ref().map(|c| {
            let axis = |a: usize| lanes_of(&c[a], part);
            V3::new(axis(0), axis(1), axis(2))
        })
    }
}

/// Part `part` of eight numbers, in lanes; lanes beyond them repeat.
#[inline(always)]
fn lanes_of<L: Lanes>(numbers: &[f32; WIDE], part: usize) -> L {
    L::from_fn(|i| L::Scalar::of(f64::from(numbers[(part * L::WIDTH + i) % WIDE])))
}

/// One number in all lanes.
#[inline(always)]
fn all<L: Lanes>(x: f32) -> L {
    L::splat(L::Scalar::of(f64::from(x)))
}

/// Puts a child on the stack, above those that are entered later, of the ones from `base` on.
#[inline(always)]
fn push(stack: &mut [Entry], base: usize, top: &mut usize, entry: Entry) {
    let mut at = *top;
    while at > base && stack[at - 1].2 < entry.2 {
        stack[at] = stack[at - 1];
        at -= 1;
    }
    stack[at] = entry;
    *top += 1;
}

/// The far side of a box moves out by some roundings, so that no hit is lost (Ize 2013, *Robust BVH
/// Ray Traversal*).
fn grown<L: Lanes>() -> L {
    L::of(1.0 + 8.0 * L::EPSILON)
}

/// A walk of some rays through a mesh. `ANY`: the first triangle ends the walk of a ray.
struct Walk<'a, const ANY: bool> {
    mesh: &'a Mesh,
}

impl<const ANY: bool> Walk<'_, ANY> {
    /// All lanes together.
    #[inline(always)]
    fn together<L: Lanes>(&self, beam: &Beam<L>, limit: L, stack: &mut [Entry]) -> Facet<L> {
        let mut found = Facet { t: limit, triangle: L::tag(0) };
        let mut top = 1;
        stack[0] = (0, false, 0.0);
        while top > 0 {
            top -= 1;
            let (child, is_leaf, near) = stack[top];
            if found.t.lt(all(near)).all() {
                continue;
            }
            if is_leaf {
                let leaf = &self.mesh.leaves()[child as usize];
                for i in 0..leaf.count {
                    let one = |c: &[[f32; WIDE]; 3]| {
                        V3::new(all(c[0][i as usize]), all(c[1][i as usize]), all(c[2][i as usize]))
                    };
                    let (t, met) = beam.meet(leaf.corners.each_ref().map(one));
                    let number = L::tag(leaf.first + i);
                    let tie = met & t.le(found.t);
                    if tie.none() {
                        continue;
                    }
                    let nearer = tie & (t.lt(found.t) | number.lt(found.triangle));
                    let t = if ANY { L::of(-1.0) } else { t };
                    found.t = L::select(nearer, t, found.t);
                    found.triangle = L::select(nearer, number, found.triangle);
                }
                continue;
            }
            let branch: &Branch = &self.mesh.branches()[child as usize];
            let base = top;
            for i in 0..usize::from(branch.count) {
                let corner =
                    |c: &[[f32; WIDE]; 3]| V3::new(all(c[0][i]), all(c[1][i]), all(c[2][i]));
                let a = (corner(&branch.low) - beam.above).times(beam.inverse);
                let b = (corner(&branch.high) - beam.below).times(beam.inverse);
                let near = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z)).max(L::zero());
                let far = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z)) * grown::<L>();
                let bits = (near.le(far) & near.le(found.t)).bits();
                if bits != 0 {
                    // The order and the cut take the nearest of all lanes.
                    let mut first = f64::INFINITY;
                    let mut left = bits;
                    while left != 0 {
                        first = first.min(near.lane(left.trailing_zeros() as usize).to_f64());
                        left &= left - 1;
                    }
                    let leaf = branch.leaves >> i & 1 != 0;
                    push(stack, base, &mut top, (branch.child[i], leaf, below(first)));
                }
            }
        }
        found
    }

    /// One ray, which is in every lane: distance (the limit: nothing met) and triangle.
    #[inline(always)]
    fn alone<L: Lanes>(
        &self,
        beam: &Beam<L>,
        limit: L::Scalar,
        stack: &mut [Entry],
    ) -> (L::Scalar, u32) {
        let (mut best, mut triangle) = (limit, 0);
        let mut top = 1;
        stack[0] = (0, false, 0.0);
        let d = beam.inverse;
        let back = [d.x, d.y, d.z].map(|d| d.lane(0).to_f64() < 0.0);
        let (up, down) = (beam.above, beam.below);
        let origin = |far| {
            let axis = |axis: usize, up, down| if back[axis] == far { up } else { down };
            V3::new(axis(0, up.x, down.x), axis(1, up.y, down.y), axis(2, up.z, down.z))
        };
        let (near_origin, far_origin) = (origin(false), origin(true));
        while top > 0 {
            top -= 1;
            let (child, is_leaf, near) = stack[top];
            if best.to_f64() < f64::from(near) {
                continue;
            }
            if is_leaf {
                let leaf = &self.mesh.leaves()[child as usize];
                for part in 0..(leaf.count as usize).div_ceil(L::WIDTH) {
                    let (t, met) = beam.meet(Beam::corners(leaf, part));
                    let mut bits = (met & t.le(L::splat(best))).bits();
                    while bits != 0 {
                        let lane = bits.trailing_zeros();
                        bits &= bits - 1;
                        let t = t.lane(lane as usize);
                        let number = leaf.first + (part * L::WIDTH) as u32 + lane;
                        if t < best || t == best && number < triangle {
                            (best, triangle) = (t, number);
                        }
                    }
                    if ANY && best < limit {
                        return (best, triangle);
                    }
                }
                continue;
            }
            let branch = &self.mesh.branches()[child as usize];
            let side = |axis: usize, far: bool| {
                if back[axis] == far { &branch.low[axis] } else { &branch.high[axis] }
            };
            let base = top;
            for part in 0..usize::from(branch.count).div_ceil(L::WIDTH) {
                let corner = |far| {
                    let axis = |a| lanes_of(side(a, far), part);
                    V3::new(axis(0), axis(1), axis(2))
                };
                let near = (corner(false) - near_origin).times(d);
                let far = (corner(true) - far_origin).times(d);
                let near = near.x.max(near.y).max(near.z).max(L::zero());
                let far = far.x.min(far.y).min(far.z) * grown::<L>();
                let mut bits = (near.le(far) & near.le(L::splat(best))).bits();
                // Wider vectors repeat the boxes.
                bits &= (1 << WIDE) - 1;
                while bits != 0 {
                    let lane = bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let i = part * L::WIDTH + lane;
                    let entry = below(near.lane(lane).to_f64());
                    push(
                        stack,
                        base,
                        &mut top,
                        (branch.child[i], branch.leaves >> i & 1 != 0, entry),
                    );
                }
            }
        }
        (best, triangle)
    }

    #[inline(always)]
    fn go<L: Lanes>(&self, ray: &Ray<L>, limit: L, stack: &mut [Entry]) -> Facet<L> {
        let beam = Beam::new(ray, self.mesh);
        let wanted = limit.gt(L::zero()).bits();
        if is_together(ray, wanted, self.mesh) {
            return self.together(&beam, limit, stack);
        }
        self.apart(&beam, limit, wanted, stack)
    }

    /// Each lane by itself.
    #[inline(always)]
    fn apart<L: Lanes>(
        &self,
        beam: &Beam<L>,
        limit: L,
        wanted: u32,
        stack: &mut [Entry],
    ) -> Facet<L> {
        let mut found = [(L::Scalar::default(), 0u32); crate::lanes::MAX_WIDTH];
        for (lane, found) in found.iter_mut().enumerate().take(L::WIDTH) {
            *found = (limit.lane(lane), 0);
            if wanted >> lane & 1 != 0 {
                *found = self.alone(&beam.only(lane), limit.lane(lane), stack);
            }
        }
        let t = L::from_fn(|i| found[i].0);
        let t = if ANY { L::select(t.lt(limit), L::of(-1.0), limit) } else { t };
        let mut triangle = L::tag(0);
        let lanes = L::from_fn(|i| L::Scalar::of(i as f64));
        for (lane, (_, number)) in found.iter().enumerate().take(L::WIDTH) {
            let here = lanes.le(L::of(lane as f64)) & lanes.ge(L::of(lane as f64));
            triangle = L::select(here, L::tag(*number), triangle);
        }
        Facet { t, triangle }
    }
}

/// A distance in single precision, rounded towards zero: what is entered there is not cut off.
#[inline(always)]
fn below(near: f64) -> f32 {
    (near * (1.0 - f64::from(f32::EPSILON))) as f32
}

/// Whether the wanted rays of a packet are worth going together.
#[inline(always)]
fn is_together<L: Lanes>(ray: &Ray<L>, wanted: u32, mesh: &Mesh) -> bool {
    if L::WIDTH == 1 || wanted.count_ones() < 2 {
        return false;
    }
    let lane = wanted.trailing_zeros() as usize;
    let [low, high] = mesh.mesh().bounds;
    let size = (0..3).map(|i| f64::from(high[i]) - f64::from(low[i])).fold(0.0, f64::max);
    let turn = ray.direction - V3::splat(ray.direction.lane(lane));
    let shift = ray.origin - V3::splat(ray.origin.lane(lane));
    let near =
        turn.length2().le(L::of(TOGETHER * TOGETHER)) & shift.max_abs().le(L::of(TOGETHER * size));
    near.bits() & wanted == wanted
}

/// Room on the stack for a tree, usually on the processor's own.
macro_rules! with_stack {
    ($mesh:expr, $stack:ident => $walk:expr) => {
        if 7 * $mesh.depth() < STACK {
            let $stack = &mut [(0, false, 0.0); STACK];
            $walk
        } else if 7 * $mesh.depth() < DEEP_STACK {
            let $stack = &mut [(0, false, 0.0); DEEP_STACK];
            $walk
        } else {
            let $stack = &mut vec![(0, false, 0.0); 7 * $mesh.depth() + 1][..];
            $walk
        }
    };
}

/// The nearest triangle nearer than `limit`; of several at the same distance the one with the lowest
/// number. Directions have unit length. Lanes whose limit is not positive are left out.
#[inline(never)]
pub fn closest<L: Lanes>(mesh: &Mesh, ray: &Ray<L>, limit: L) -> Facet<L> {
    with_stack!(mesh, stack => Walk::<false> { mesh }.go(ray, limit, stack))
}

/// Which lanes meet a triangle nearer than `limit`.
#[inline(never)]
pub fn blocked<L: Lanes>(mesh: &Mesh, ray: &Ray<L>, limit: L) -> L::Mask {
    let found = with_stack!(mesh, stack => Walk::<true> { mesh }.go(ray, limit, stack));
    found.t.lt(limit)
}

/// As [`closest`], all lanes together or each by itself: for tests and benches.
#[inline(never)]
pub fn closest_by<L: Lanes>(mesh: &Mesh, ray: &Ray<L>, limit: L, together: bool) -> Facet<L> {
    let beam = Beam::new(ray, mesh);
    let wanted = limit.gt(L::zero()).bits();
    with_stack!(mesh, stack => if together {
        Walk::<false> { mesh }.together(&beam, limit, stack)
    } else {
        Walk::<false> { mesh }.apart(&beam, limit, wanted, stack)
    })
}
