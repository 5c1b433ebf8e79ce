//! Ray packets and the nearest hits found along them.

use crate::lanes::{Mask, SimdFloat, Vec3};

/// Packet of rays, one per SIMD lane.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L> {
    /// Origins of the rays.
    pub origin: Vec3<L>,
    /// Directions of the rays, of unit length.
    pub direction: Vec3<L>,
}

impl<L: SimdFloat> Ray<L> {
    /// Returns the point at distance `t` along each ray.
    #[inline(always)]
    pub fn at(&self, t: L) -> Vec3<L> {
        self.direction.mul_add(t, self.origin)
    }

    /// Returns `true` if the rays in the bit mask `lanes` are coherent: a BVH traversal by the
    /// packet is then faster than one by each ray. Returns `false` for fewer than two rays. Each
    /// ray is compared with the first one. The difference of their unit directions may have a
    /// length of at most `WIDTH * turn`, and each coordinate of their origins may differ by at most
    /// `WIDTH * shift`.
    #[inline(always)]
    pub fn is_coherent(&self, lanes: u32, turn: f64, shift: f64) -> bool {
        if L::WIDTH == 1 || lanes.count_ones() < 2 {
            return false;
        }
        let [max_turn, max_shift] = [turn, shift].map(|bound| bound * L::WIDTH as f64);
        let lane = lanes.trailing_zeros() as usize;
        let turn = self.direction - Vec3::splat(self.direction.lane(lane));
        let shift = self.origin - Vec3::splat(self.origin.lane(lane));
        let near = turn.length_squared().le(L::from_f64(max_turn * max_turn))
            & shift.max_abs().le(L::from_f64(max_shift));
        near.bits() & lanes == lanes
    }
}

/// Closest hits that the rays of a packet have found so far.
#[derive(Clone, Copy, Debug)]
pub struct Hit<L> {
    /// Distance along the ray; `L::MAX` for a miss.
    pub t: L,
    /// Id of the primitive that the ray hits. Undefined for a miss.
    pub primitive: L,
    /// Id of the triangle that the ray hits. Undefined if `primitive` is not a mesh.
    pub triangle: L,
}

impl<L: SimdFloat> Hit<L> {
    /// Creates a packet without hits. [`Hit::keep_closer`] and [`Hit::merge`] then accept only hits
    /// closer than `t`. A negative `t` marks an inactive lane.
    #[inline(always)]
    pub fn with_t_max(t: L) -> Self {
        Self { t, primitive: L::from_id(0), triangle: L::from_id(0) }
    }

    /// Replaces the hits in `lanes` by the hits of `other`.
    #[inline(always)]
    pub fn replace(&mut self, lanes: L::Mask, other: &Self) {
        self.t = L::select(lanes, other.t, self.t);
        self.primitive = L::select(lanes, other.primitive, self.primitive);
        self.triangle = L::select(lanes, other.triangle, self.triangle);
    }

    /// Accepts a hit on `primitive` at distance `t` in the lanes of `mask` where `t` is positive
    /// and smaller than the distance in `self`.
    #[inline(always)]
    pub fn keep_closer(&mut self, mask: L::Mask, t: L, primitive: u32) {
        let nearer = mask & t.gt(L::zero()) & t.lt(self.t);
        self.t = L::select(nearer, t, self.t);
        self.primitive = L::select(nearer, L::from_id(primitive), self.primitive);
    }

    /// Accepts the hits of `other` that are closer than those of `self`, or equally close with a
    /// smaller primitive id.
    #[inline(always)]
    pub fn merge(&mut self, other: &Self) {
        let mut nearer = other.t.lt(self.t);
        let tie = (other.t.le(self.t) & other.t.lt(L::from_f64(L::MAX))).and_not(nearer);
        // The ids are compared only if there is a tie, which is rare. Ids are subnormal numbers if
        // read as floats, and some processors compare subnormal numbers slowly.
        if tie.any() {
            nearer = nearer | (tie & other.primitive.lt(self.primitive));
        }
        self.replace(nearer, other);
    }
}
