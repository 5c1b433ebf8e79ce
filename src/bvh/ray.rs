//! Ray packets and the nearest hits found along them.

use crate::lanes::{Mask, SimdFloat, Vec3};

/// A packet of half-lines.
#[derive(Clone, Copy, Debug)]
pub struct Ray<L> {
    /// Origins.
    pub origin: Vec3<L>,
    /// Directions, of unit length.
    pub direction: Vec3<L>,
}

impl<L: SimdFloat> Ray<L> {
    /// The point at distance `t`.
    #[inline(always)]
    pub fn at(&self, t: L) -> Vec3<L> {
        self.direction.mul_add(t, self.origin)
    }

    /// Whether the rays of some lanes, at least one, differ by no more than `turn` in direction (length
    /// of the difference of unit vectors) and `shift` in any coordinate of the origin.
    #[inline(always)]
    pub(crate) fn spread(&self, lanes: u32, turn: f64, shift: f64) -> bool {
        let lane = lanes.trailing_zeros() as usize;
        let turned = self.direction - Vec3::splat(self.direction.lane(lane));
        let shifted = self.origin - Vec3::splat(self.origin.lane(lane));
        let near = turned.length_squared().le(L::from_f64(turn * turn))
            & shifted.max_abs().le(L::from_f64(shift));
        near.bits() & lanes == lanes
    }
}

/// The nearest crossing found so far.
#[derive(Clone, Copy, Debug)]
pub struct Hit<L> {
    /// Distance along the ray; `L::MAX`: nothing met.
    pub t: L,
    /// Tag of the item met; meaningless where nothing was.
    pub item: L,
    /// Tag of the triangle of a mesh met; meaningless elsewhere.
    pub triangle: L,
}

impl<L: SimdFloat> Hit<L> {
    /// Nothing met.
    #[inline(always)]
    pub fn none() -> Self {
        Self::with_t_max(L::from_f64(L::MAX))
    }

    /// Nothing met yet, and nothing to be met at `t` or beyond.
    #[inline(always)]
    pub(crate) fn with_t_max(t: L) -> Self {
        Self { t, item: L::from_id(0), triangle: L::from_id(0) }
    }

    /// Takes a distance and the tags of an item and a triangle in `lanes`, whatever is known there.
    #[inline(always)]
    pub fn take_in(&mut self, lanes: L::Mask, t: L, (item, facet): (L, L)) {
        self.t = L::select(lanes, t, self.t);
        self.item = L::select(lanes, item, self.item);
        self.triangle = L::select(lanes, facet, self.triangle);
    }

    /// Takes `t` and `item` where `t` is positive, nearer than what is known, and `mask` is true.
    #[inline(always)]
    pub(crate) fn keep_closer(&mut self, mask: L::Mask, t: L, item: u32) {
        let nearer = mask & t.gt(L::zero()) & t.lt(self.t);
        self.t = L::select(nearer, t, self.t);
        self.item = L::select(nearer, L::from_id(item), self.item);
    }

    /// Takes `other` where it is nearer, or as near with a lower tag.
    #[inline(always)]
    pub(crate) fn merge(&mut self, other: &Self) {
        let mut nearer = other.t.lt(self.t);
        let tie = (other.t.le(self.t) & other.t.lt(L::from_f64(L::MAX))).and_not(nearer);
        // Rare; and tags are subnormal as floats, which some processors compare slowly.
        if tie.any() {
            nearer = nearer | (tie & other.item.lt(self.item));
        }
        self.t = L::select(nearer, other.t, self.t);
        self.item = L::select(nearer, other.item, self.item);
        self.triangle = L::select(nearer, other.triangle, self.triangle);
    }
}
