//! Intervals in which a line is inside the parts of a compound: their sorted ends, and the
//! transitions of the line between inside and outside.

use crate::lanes::SimdFloat;

/// Lower limit of the cosine by which the tolerance of coincident faces is divided. It keeps the
/// tolerance finite for lines parallel to the surface.
const FLATTEST: f64 = 1e-9;

/// End of an interval in which a line is inside a solid.
#[derive(Clone, Copy)]
pub struct Event<L> {
    /// Distance along the line.
    pub t: L,
    /// Tolerance. Two ends coincide if the distance between them is at most the smaller one of
    /// their tolerances.
    pub tie: L,
}

/// Interval of distances in which a line is inside a part of a compound. In lanes whose line misses
/// the part, `enter` is `L::MAX` and `leave` is `-L::MAX`.
#[derive(Clone, Copy)]
pub struct Interval<L> {
    pub enter: L,
    pub leave: L,
}

impl<L: SimdFloat> Interval<L> {
    /// Returns the lanes whose line meets the part.
    #[inline(always)]
    pub fn meets(&self) -> L::Mask {
        self.enter.le(self.leave)
    }

    /// Returns the lanes in which `t` is in the interval.
    #[inline(always)]
    pub fn at(&self, t: L) -> L::Mask {
        self.enter.le(t) & self.leave.ge(t)
    }

    /// Returns start and end of the interval; both are `L::MAX` in lanes whose line misses the part.
    /// `cosines` are those of the angles between line and surface normal. `tie` is the tolerance for
    /// a line perpendicular to the face.
    #[inline(always)]
    pub fn events(&self, cosines: [L; 2], tie: L) -> [Event<L>; 2] {
        let never = L::from_f64(L::MAX);
        let end = |t: L, cosine: L| Event {
            t,
            tie: (tie / cosine.max(L::from_f64(FLATTEST))).masked(t.abs().lt(never)),
        };
        let leave = L::select(self.meets(), self.leave, never);
        [end(self.enter, cosines[0]), end(leave, cosines[1])]
    }
}

/// Transition of the line of each lane through the surface of a compound, or of an operand of its
/// set operations.
#[derive(Clone, Copy)]
pub struct Transition<L: SimdFloat> {
    /// Lanes in which the line is inside the solid before the surface.
    pub before: L::Mask,
    /// Lanes in which the line is inside the solid after the surface.
    pub after: L::Mask,
    /// Distance along the line to the surface; undefined in lanes without a transition.
    pub t: L,
    /// Id of the part to which the surface belongs.
    pub tag: L,
}

impl<L: SimdFloat> Transition<L> {
    pub fn inverted(self) -> Self {
        Self { before: !self.before, after: !self.after, ..self }
    }

    /// Combines the transitions of two operands into the transition of the result, whose sides are
    /// `before` and `after`. The surface is that of `self` in lanes in which `self` changes sides
    /// and ends on the same side as the result. In other lanes it is that of `other`.
    fn joined(self, other: Self, before: L::Mask, after: L::Mask) -> Self {
        let same = (self.after & after) | (!self.after & !after);
        let first = same & ((self.before & !self.after) | (!self.before & self.after));
        Self {
            before,
            after,
            t: L::select(first, self.t, other.t),
            tag: L::select(first, self.tag, other.tag),
        }
    }

    pub fn or(self, other: Self) -> Self {
        self.joined(other, self.before | other.before, self.after | other.after)
    }

    pub fn and(self, other: Self) -> Self {
        self.joined(other, self.before & other.before, self.after & other.after)
    }
}

/// Calls `use_it` with a slice of `n` elements that equal `fill`. The slice is on the stack if `n`
/// is at most `SOME`, otherwise on the heap.
#[inline(always)]
pub fn with_scratch<const FEW: usize, const SOME: usize, T: Copy, R>(
    n: usize,
    fill: T,
    use_it: impl FnOnce(&mut [T]) -> R,
) -> R {
    // Only the array that is used is filled.
    let (mut few, mut some, mut many);
    // A single call, so that the compiler inlines `use_it`.
    use_it(if n <= FEW {
        few = [fill; FEW];
        &mut few[..n]
    } else if n <= SOME {
        some = [fill; SOME];
        &mut some[..n]
    } else {
        many = vec![fill; n];
        &mut many
    })
}

/// Inserts `end` into `ends`. The first `count` elements must be sorted by distance in each lane.
/// The first `count + 1` elements are then sorted.
#[inline(always)]
pub fn insert<L: SimdFloat>(mut end: Event<L>, ends: &mut [Event<L>], count: usize) {
    for slot in &mut ends[..count] {
        let sooner = end.t.lt(slot.t);
        let old = *slot;
        slot.t = L::select(sooner, end.t, old.t);
        slot.tie = L::select(sooner, end.tie, old.tie);
        end.t = L::select(sooner, old.t, end.t);
        end.tie = L::select(sooner, old.tie, end.tie);
    }
    ends[count] = end;
}
