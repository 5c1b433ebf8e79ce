//! Compounds (constructive solid geometry): unions, intersections and differences of solids, by
//! intervals along lines (Roth 1982, *Ray Casting for Modeling Solids*).
//!
//! Each part returns the spans in which a line is inside it. The sorted ends of all spans divide
//! the line into pieces. Each piece is either inside or outside any given part, and therefore
//! either inside or outside the compound. The line crosses the surface of the compound where an
//! inner and an outer piece meet.
//!
//! Two ends coincide if the distance between them, measured perpendicular to the surface, is at
//! most [`TIE`] rounding errors. There is no piece between them. A cut flush with a face therefore
//! leaves no skin, and parts in contact leave no crack, although rounding errors put equal faces
//! into a random order. Parts thinner than this distance disappear.

mod interval;
mod solid;
mod tree;

pub use solid::{Solid, SolidPrimitive, Span};
pub use tree::{CsgSolid, CsgTree};

use crate::bvh::packet::SlabPacket;
use crate::bvh::{Hit, Ray};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::aggregate::primitive_box::{GIVEN, padded};
use crate::primitive::canonical::{Bounds, CanonicalShape, UNBOUNDED};
use crate::primitive::compiled::{Primitive, SurfacePoint, TexCoord};
use crate::primitive::csg::interval::{Event, Interval, Transition, insert, with_scratch};
use crate::primitive::csg::solid::CompiledSolid;
use std::ops::Range;
use std::sync::Arc;

/// Distance within which surfaces of a compound's parts count as coincident. The unit is the
/// rounding error of the largest coordinate. Two faces whose coordinates differ by four units in
/// the last place are within this distance, although each is hit with a few rounding errors.
const TIE: f64 = 16.0;

/// Smallest number of parts of a compound whose bounding boxes are tested before the parts, and
/// whose lines are tested for points inside before the ends of the spans are sorted.
const MIN_BOXED: usize = 3;

/// Instruction of a stack machine that computes whether a point is inside a compound. An entry of
/// the stack is a mask of lanes.
#[derive(Clone, Copy, Debug)]
enum Op {
    /// Pushes the lanes whose point is inside the part with this number.
    Part(u32),
    /// Replaces the top two entries by their union.
    Or,
    /// Replaces the top two entries by their intersection.
    And,
    /// Subtracts the top entry from the one below.
    Minus,
}

/// Bounding box of a compound or of one of its parts; infinite if a part has no finite bounds.
struct Extent<S> {
    low: [S; 3],
    high: [S; 3],
}

impl<S: Float> Extent<S> {
    fn new(bounds: Option<Bounds>) -> Self {
        let bounds = bounds.unwrap_or(UNBOUNDED);
        let [low, high] =
            padded(bounds, S::EPSILON.max(GIVEN)).map(|v| v.to_array().map(S::from_f64));
        Self { low, high }
    }
}

struct Part<S> {
    solid: CompiledSolid<S>,
    extent: Extent<S>,
    /// `true` if the part is subtracted: the inside of its solid is outside the compound.
    reversed: bool,
    /// Range of the part's spans in the list of the spans of the compound.
    spans: Range<usize>,
}

/// Compound compiled for ray intersection.
struct Compound<S> {
    /// Centre of the bounding sphere.
    center: [S; 3],
    /// Squared radius of the bounding sphere.
    radius2: S,
    extent: Extent<S>,
    reach: S,
    parts: Vec<Part<S>>,
    ops: Vec<Op>,
    /// Largest number of spans of one line, summed over all parts.
    spans: usize,
    /// Largest number of entries on the stack of the instructions.
    depth: usize,
}

/// Part of a compound. Every part counts as a primitive, so that a hit identifies the part. Rays
/// are intersected with the first part only, which stands for the whole compound.
pub struct CompoundPart<S> {
    compound: Arc<Compound<S>>,
    part: usize,
}

impl<S: Float> CompoundPart<S> {
    /// Compiles the parts of a compound.
    pub fn of(form: &CsgSolid) -> Vec<Self> {
        let compound = Arc::new(Compound::new(form));
        let part = |part| Self { compound: Arc::clone(&compound), part };
        (0..form.parts.len()).map(part).collect()
    }
}

impl<S: Float> Compound<S> {
    fn new(form: &CsgSolid) -> Self {
        let mut spans = 0;
        let part = |part| {
            let solid = CompiledSolid::new(part);
            let first = spans;
            spans += solid.max_spans();
            let extent = Extent::new(part.bounds());
            Part { solid, extent, reversed: false, spans: first..spans }
        };
        let parts = form.parts.iter().map(part).collect();
        let bounds = form.bounds().unwrap_or_default();
        let radius = 0.5 * bounds.0.distance(bounds.1) * (1.0 + 8.0 * S::EPSILON);
        let bounded = form.parts.iter().filter(|part| part.bounds().is_some());
        let mut compound = Self {
            center: (0.5 * (bounds.0 + bounds.1)).to_array().map(S::from_f64),
            radius2: S::from_f64(radius * radius),
            extent: Extent::new(Some(bounds)),
            reach: S::from_f64(bounded.map(|part| part.max_coordinate()).fold(0.0, f64::max)),
            parts,
            ops: Vec::new(),
            spans,
            depth: 0,
        };
        compound.depth = compound.build(&form.tree, false);
        compound
    }

    /// Appends the instructions that evaluate `tree` and returns the depth of the stack that they
    /// need. `reversed` is `true` if the tree is subtracted from the compound.
    fn build(&mut self, tree: &CsgTree, reversed: bool) -> usize {
        let (list, op) = match tree {
            CsgTree::Part(i) => {
                self.parts[*i].reversed = reversed;
                self.ops.push(Op::Part(*i as u32));
                return 1;
            }
            CsgTree::Union(list) => (list, Op::Or),
            CsgTree::Intersection(list) => (list, Op::And),
            CsgTree::Difference(list) => (list, Op::Minus),
        };
        let mut depth = 1;
        for (n, inner) in list.iter().enumerate() {
            let cuts = matches!(op, Op::Minus) && n > 0;
            let above = self.build(inner, reversed ^ cuts);
            depth = depth.max(above + usize::from(n > 0));
            if n > 0 {
                self.ops.push(op);
            }
        }
        depth
    }

    /// Replaces `hit` in the lanes of `wanted` whose ray hits the compound nearer than `hit`. The
    /// first part of the compound has the id `first_id`; the other parts follow.
    #[inline(never)]
    fn intersect<L: SimdFloat<Scalar = S>>(
        &self,
        first_id: u32,
        ray: &Ray<L>,
        wanted: L::Mask,
        hit: &mut Hit<L>,
    ) {
        let from_center = ray.origin - Vec3::splat(self.center);
        let along = from_center.dot(ray.direction);
        let across = ray.direction.mul_add(-along, from_center);
        let radius2 = L::splat(self.radius2);
        // The bounding sphere is in front of the origin of the ray or contains it.
        let ahead = along.le(L::zero()) | from_center.length_squared().le(radius2);
        let near = wanted & across.length_squared().le(radius2) & ahead;
        if near.none() {
            return;
        }
        let packet = (self.parts.len() >= MIN_BOXED).then(|| {
            let rounding = ray.origin.max_abs() * L::from_f64(4.0 * L::EPSILON);
            SlabPacket::new(ray, Vec3::gray(rounding))
        });
        let boxed = |extent: &Extent<S>, lanes: L::Mask, limit: L| match &packet {
            Some(packet) => {
                lanes & packet.enters(Vec3::splat(extent.low), Vec3::splat(extent.high), limit)
            }
            None => lanes,
        };
        let near = boxed(&self.extent, near, hit.t);
        if near.none() {
            return;
        }
        let (never, always) = (L::from_f64(L::MAX), L::from_f64(-L::MAX));
        let outside = Interval { enter: never, leave: always };
        with_scratch::<6, 16, _, _>(self.spans, outside, |spans| {
            with_scratch::<6, 16, _, _>(self.spans, [L::zero(); 2], |cosines| {
                for part in &self.parts {
                    let wanted = boxed(&part.extent, near, never);
                    if wanted.none() {
                        continue;
                    }
                    let mut slot = part.spans.start;
                    part.solid.for_each_span(ray, wanted, |found| {
                        let meets = found.meets & wanted;
                        spans[slot] = Interval {
                            enter: L::select(meets, found.enter, never),
                            leave: L::select(meets, found.leave, always),
                        };
                        cosines[slot] = [found.enter_cosine, found.leave_cosine];
                        slot += 1;
                    });
                }
                let tie =
                    ray.origin.max_abs().max(L::splat(self.reach)) * L::from_f64(TIE * L::EPSILON);
                Lines { compound: self, first_id, spans }.find(cosines, tie, near, hit);
            });
        });
    }
}

impl<L: SimdFloat> Primitive<L> for CompoundPart<L::Scalar> {
    #[inline(always)]
    fn closest(&self, id: u32, ray: &Ray<L>, hit: &mut Hit<L>) {
        if self.part == 0 {
            self.compound.intersect(id, ray, L::mask(true), hit);
        }
    }

    #[inline(always)]
    fn occluded(&self, ray: &Ray<L>, limit: L, wanted: L::Mask) -> Option<L::Mask> {
        if self.part > 0 || wanted.none() {
            return None;
        }
        let mut hit = Hit::with_t_max(limit);
        self.compound.intersect(0, ray, wanted, &mut hit);
        Some(hit.t.lt(limit))
    }

    /// Returns the projection of `point` onto this part. The normal points out of the compound.
    #[inline(never)]
    fn surface(&self, _triangle: L, point: Vec3<L>) -> SurfacePoint<L> {
        let part = &self.compound.parts[self.part];
        let surface = part.solid.surface(point);
        let normal = if part.reversed { -surface.normal } else { surface.normal };
        SurfacePoint { normal, ..surface }
    }

    fn uv(&self, _triangle: L, point: Vec3<L>) -> Option<TexCoord<L>> {
        self.compound.parts[self.part].solid.uv(point)
    }
}

/// Lines of a ray packet, cut by the parts of one compound.
struct Lines<'a, L: SimdFloat> {
    compound: &'a Compound<L::Scalar>,
    /// Id of the compound's first part.
    first_id: u32,
    /// Spans of all parts.
    spans: &'a [Interval<L>],
}

impl<L: SimdFloat> Lines<'_, L> {
    #[inline(always)]
    fn spans_of(&self, part: u32) -> &[Interval<L>] {
        &self.spans[self.compound.parts[part as usize].spans.clone()]
    }

    /// Executes the instructions of the compound on a stack of values. `part` returns the value of
    /// a part, and `join` combines two values.
    #[inline(always)]
    fn evaluate<T: Copy>(
        &self,
        empty: T,
        part: impl Fn(u32) -> T,
        join: impl Fn(Op, T, T) -> T,
    ) -> T {
        with_scratch::<3, 8, _, _>(self.compound.depth, empty, |stack| {
            let mut top = 0;
            for op in &self.compound.ops {
                if let Op::Part(i) = op {
                    stack[top] = part(*i);
                    top += 1;
                } else {
                    top -= 1;
                    stack[top - 1] = join(*op, stack[top - 1], stack[top]);
                }
            }
            stack[0]
        })
    }

    /// Returns the lanes in which the line may have points inside the compound.
    #[inline(always)]
    fn reached(&self) -> L::Mask {
        let meets = |i| {
            let spans = self.spans_of(i).iter();
            spans.fold(L::mask(false), |meets, span| meets | span.meets())
        };
        self.evaluate(L::mask(false), meets, |op, a, b| match op {
            Op::Or => a | b,
            Op::And => a & b,
            Op::Part(_) | Op::Minus => a,
        })
    }

    /// Returns the lanes in which the point at the distance `t` is inside the compound.
    #[inline(always)]
    fn inside(&self, t: L) -> L::Mask {
        let part = |i| inside_any(self.spans_of(i), t);
        self.evaluate(L::mask(false), part, |op, a, b| match op {
            Op::Or => a | b,
            Op::And => a & b,
            Op::Part(_) | Op::Minus => a.and_not(b),
        })
    }

    /// Returns the transition of each line through the compound's surface between the points at the
    /// distances `before` and `after`.
    fn change(&self, before: L, after: L) -> Transition<L> {
        let no = L::mask(false);
        let nothing = Transition { before: no, after: no, t: L::zero(), tag: L::from_id(0) };
        let part = |i| {
            let spans = self.spans_of(i);
            let (was, is) = (inside_any(spans, before), inside_any(spans, after));
            let mut t = spans[0].leave;
            for span in spans {
                t = L::select(span.at(before).and_not(is), span.leave, t);
                t = L::select(span.at(after), span.enter, t);
            }
            Transition { before: was, after: is, t, tag: L::from_id(self.first_id + i) }
        };
        self.evaluate(nothing, part, |op, a, b| match op {
            Op::Or => a.or(b),
            Op::And => a.and(b),
            Op::Part(_) | Op::Minus => a.and(b.inverted()),
        })
    }

    /// Replaces `hit` by the first surface of the compound in the lanes of `near` in which this
    /// surface is nearer than `hit`. `cosines` are those of the angles between line and surface at
    /// the ends of the spans. `tie` is the tolerance for a line perpendicular to a surface.
    #[inline(always)]
    fn find(&self, cosines: &[[L; 2]], tie: L, near: L::Mask, hit: &mut Hit<L>) {
        let is_small = self.compound.parts.len() < MIN_BOXED;
        let near = if is_small { near } else { near & self.reached() };
        if near.none() {
            return;
        }
        let spans = || self.spans.iter().zip(cosines);
        let met = || spans().filter(|(span, _)| (near & span.meets()).any());
        let end = Event { t: L::from_f64(L::MAX), tie: L::zero() };
        with_scratch::<8, 32, _, _>(2 * met().count(), end, |ends| {
            let events = met().flat_map(|(span, cosines)| span.events(*cosines, tie));
            for (count, end) in events.enumerate() {
                insert(end, ends, count);
            }
            self.sweep(ends, near, hit);
        });
    }

    /// Replaces `hit` by the first surface of the compound in the lanes of `open` in which this
    /// surface is nearer than `hit`. Steps along each line through `ends`, the sorted ends of the
    /// parts' spans.
    ///
    /// Two ends coincide only if the distance between them is at most the tolerance (`tie`) of each
    /// end. The tolerance along the line is large at a face that the line grazes. If the tolerance
    /// of one end were enough, the grazed face would absorb other faces. Coincident faces have
    /// equal tolerances, because their angles to the line are equal.
    #[inline(always)]
    fn sweep(&self, ends: &[Event<L>], mut open: L::Mask, hit: &mut Hit<L>) {
        let last = Event { t: L::from_f64(L::MAX), tie: L::zero() };
        let mut state = L::mask(false);
        let mut before = L::from_f64(-L::MAX);
        for (i, end) in ends.iter().enumerate() {
            let next = ends.get(i + 1).unwrap_or(&last);
            let gap = open & (next.t - end.t).gt(end.tie.min(next.tie));
            if gap.none() {
                continue;
            }
            let middle = L::from_f64(0.5) * end.t + L::from_f64(0.5) * next.t;
            let inside = self.inside(middle);
            let changed = gap & (inside.and_not(state) | state.and_not(inside));
            if changed.any() {
                let seen = self.change(before, middle);
                let ahead = changed & seen.t.gt(L::zero());
                let nearer = ahead & seen.t.lt(hit.t);
                hit.t = L::select(nearer, seen.t, hit.t);
                hit.primitive = L::select(nearer, seen.tag, hit.primitive);
                open = open.and_not(ahead);
            }
            // In these lanes all further surfaces are farther than the hit.
            open = open.and_not(gap & next.t.gt(hit.t));
            if open.none() {
                return;
            }
            state = (inside & gap) | state.and_not(gap);
            before = L::select(gap, middle, before);
        }
    }
}

/// Returns the lanes in which the distance `t` is inside at least one of `spans`.
#[inline(always)]
fn inside_any<L: SimdFloat>(spans: &[Interval<L>], t: L) -> L::Mask {
    let [first, others @ ..] = spans else { return L::mask(false) };
    others.iter().fold(first.at(t), |inside, span| inside | span.at(t))
}
