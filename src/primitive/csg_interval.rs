//! Interval algebra of compounds: spans' ends in order, parts of lines inside, and what changes
//! from one to the next.

use crate::lanes::SimdFloat;
use crate::primitive::solid::Span;

/// Least cosine that a tie is widened for: surfaces that a line hits flatter than that are not distinguished.
const FLATTEST: f64 = 1e-9;

/// The end of a span: its distance, and how near another end must be to happen at once.
#[derive(Clone, Copy)]
pub struct Event<L> {
    pub t: L,
    pub tie: L,
}

/// The span of a part as far as "inside" needs it.
#[derive(Clone, Copy)]
pub struct Interval<L> {
    pub enter: L,
    pub leave: L,
}

impl<L: SimdFloat> Interval<L> {
    #[inline(always)]
    pub fn at(&self, t: L) -> L::Mask {
        self.enter.le(t) & self.leave.ge(t)
    }
}

/// Change of a part of the tree at a surface.
#[derive(Clone, Copy)]
pub struct Transition<L: SimdFloat> {
    pub before: L::Mask,
    pub after: L::Mask,
    /// Distance and part that is visible there; meaningless if nothing changes.
    pub t: L,
    pub tag: L,
}

impl<L: SimdFloat> Transition<L> {
    pub fn inverted(self) -> Self {
        Self { before: !self.before, after: !self.after, ..self }
    }

    /// Both joined; of two that change in the right sense the first is to be seen.
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

/// Room for `n` values while `use_it` runs: on the stack if they are few.
#[inline(always)]
pub fn with_scratch<T: Copy, R>(n: usize, fill: T, use_it: impl FnOnce(&mut [T]) -> R) -> R {
    const FEW: usize = 8;
    if n <= FEW { use_it(&mut [fill; FEW][..n]) } else { use_it(&mut vec![fill; n]) }
}

/// The ends of a span; those of lines that do not meet the solid stand behind all others.
#[inline(always)]
pub fn events<L: SimdFloat>(span: &Span<L>, tie: L) -> [Event<L>; 2] {
    let never = L::from_f64(L::MAX);
    let end = |t: L, cosine: L| {
        let real = span.meets & t.abs().lt(never);
        Event {
            t: L::select(span.meets, t, never),
            tie: (tie / cosine.max(L::from_f64(FLATTEST))).masked(real),
        }
    };
    [end(span.enter, span.enter_cosine), end(span.leave, span.leave_cosine)]
}

/// Puts `end` into the first `count` of `ends`, which are sorted in every lane.
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
