//! Compounds (constructive solid geometry): unions, intersections and differences of solids, by
//! intervals along lines (Roth 1982, *Ray Casting for Modeling Solids*).
//!
//! Each part returns the spans in which a line is inside of it. The sorted ends of all spans divide
//! the line into pieces. Each piece is either inside or outside of any given part, and therefore of
//! the compound. The line crosses the surface of the compound where an inner and an outer piece
//! meet.
//!
//! Two ends coincide if the distance between them, measured perpendicular to the surface, is at
//! most [`TIE`] rounding errors. There is no piece between them. A cut flush with a face therefore
//! leaves no skin, and parts in contact leave no crack, although rounding errors put equal faces
//! into a random order. Parts thinner than this distance disappear.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::batch::{Primitive, SurfacePoint, UvGradients};
use crate::primitive::canonical::CanonicalShape;
use crate::primitive::conical_frustum::ConicalFrustum;
use crate::primitive::convex_polyhedron::ConvexPolyhedron;
use crate::primitive::csg_interval::{Event, Interval, Transition, events, insert, with_scratch};
use crate::primitive::csg_tree::{CsgSolid, CsgTree};
use crate::primitive::ellipsoid::Ellipsoid;
use crate::primitive::form::Form;
use crate::primitive::plane::Plane;
use crate::primitive::solid::SolidPrimitive;
use crate::primitive::sphere::Sphere;
use crate::primitive::torus::Torus;
use std::ops::Range;

/// Distance within which surfaces of a compound's parts count as coincident. The unit is the
/// rounding error of the largest coordinate. The distance covers two faces whose coordinates differ
/// by four units in the last place, each hit with a few rounding errors.
const TIE: f64 = 16.0;

/// Instruction of a stack machine. The machine computes whether a point is inside of a compound
/// solid. Its input is one mask for each part: the lanes whose point is inside of this part.
#[derive(Clone, Copy, Debug)]
enum Op {
    /// Pushes the mask of the lanes whose point is inside of the part with this number.
    Part(u32),
    /// Replaces the top two stack entries by their union.
    Or,
    /// Replaces the top two stack entries by their intersection.
    And,
    /// Replaces the top two stack entries by the difference: the lower one minus the upper one.
    Minus,
}

macro_rules! leaves {
    ($($kind:ident($spans:literal)),+ $(,)?) => {
        /// Solid of one part of a compound, compiled for ray intersection.
        enum CsgLeaf<S> {
            $($kind($kind<S>),)+
        }

        /// Evaluates one expression for the solid in any variant of [`CsgLeaf`].
        macro_rules! each {
            ($solid:expr, $primitive:ident => $value:expr) => {
                match $solid {
                    $(CsgLeaf::$kind($primitive) => $value,)+
                }
            };
        }

        impl<S: Float> CsgLeaf<S> {
            /// Compiles the canonical form of a part; `None` if compounds cannot contain it.
            fn new(form: &Form) -> Option<Self> {
                None$(.or_else(|| $kind::new(form).map(Self::$kind)))+
            }

            /// Returns the largest number of spans of one line in this solid. A span is an interval
            /// in which the line is inside of the solid.
            fn max_spans(&self) -> usize {
                match self {
                    $(Self::$kind(_) => $spans,)+
                }
            }
        }
    };
}

// Solids that can be parts of compounds, each with the largest number of spans of one line in it. A
// new solid needs a line here.
leaves! {
    Sphere(1),
    Ellipsoid(1),
    ConvexPolyhedron(1),
    ConicalFrustum(1),
    Torus(2),
    // A plane stands for the half-space behind it.
    Plane(1),
}

/// Part of a compound: one of the solids that the compound's set operations combine.
struct Part<S> {
    solid: CsgLeaf<S>,
    /// `true` if the part is subtracted: the inside of its solid is outside of the compound.
    reversed: bool,
    /// Range of the part's spans (intervals in which a line is inside of the part) in the list of
    /// the spans of all parts of the compound.
    spans: Range<usize>,
}

/// Compound compiled for ray intersection: a bounding sphere, and the ranges of its parts and
/// instructions in the lists of [`Compounds`].
struct SolidOperand<S> {
    center: [S; 3],
    radius2: S,
    reach: S,
    parts: Range<usize>,
    ops: Range<usize>,
    /// Largest total number of spans of all parts of the compound. A span is an interval in which a
    /// line is inside of a part.
    spans: usize,
    /// Largest number of entries on the stack while the compound's instructions are executed.
    depth: usize,
}

/// All compounds of a scene, compiled for ray intersection. Every part counts as a primitive, so
/// that a hit identifies the part. In lists of primitives the first part stands for the whole
/// compound.
pub struct Compounds<S> {
    compounds: Vec<SolidOperand<S>>,
    parts: Vec<Part<S>>,
    ops: Vec<Op>,
    /// For each part of all compounds: the number of its compound if it is the first part,
    /// otherwise `None`.
    first: Vec<Option<u32>>,
}

impl<S: Float> Compounds<S> {
    /// Compiles the compounds among the canonical forms `forms`, in order.
    pub fn new(forms: &[Form]) -> Self {
        let mut out =
            Self { compounds: Vec::new(), parts: Vec::new(), ops: Vec::new(), first: Vec::new() };
        for form in forms {
            if let Form::Csg(compound) = form {
                out.add(compound);
            }
        }
        out
    }

    fn add(&mut self, compound: &CsgSolid) {
        let (first_part, first_op) = (self.parts.len(), self.ops.len());
        let mut spans = 0;
        for (i, part) in compound.parts.iter().enumerate() {
            let solid = CsgLeaf::new(part).expect("parts are solids that compounds are made of");
            let first = spans;
            spans += solid.max_spans();
            self.parts.push(Part { solid, reversed: false, spans: first..spans });
            self.first.push((i == 0).then_some(self.compounds.len() as u32));
        }
        let depth = self.build(&compound.tree, first_part, false);
        let (low, high) = compound.bounds().unwrap_or_default();
        let radius = 0.5 * low.distance(high) * (1.0 + 8.0 * S::EPSILON);
        let bounded = compound.parts.iter().filter(|part| part.bounds().is_some());
        self.compounds.push(SolidOperand {
            center: (0.5 * (low + high)).to_array().map(S::from_f64),
            radius2: S::from_f64(radius * radius),
            reach: S::from_f64(bounded.map(|part| part.max_coordinate()).fold(0.0, f64::max)),
            parts: first_part..self.parts.len(),
            ops: first_op..self.ops.len(),
            spans,
            depth,
        });
    }

    /// Appends the instructions that evaluate `tree` and returns the depth of the stack that they
    /// need. `reversed` is `true` if the tree is subtracted from the compound.
    fn build(&mut self, tree: &CsgTree, first_part: usize, reversed: bool) -> usize {
        let (list, op) = match tree {
            CsgTree::Part(i) => {
                self.parts[first_part + i].reversed = reversed;
                self.ops.push(Op::Part(*i as u32));
                return 1;
            }
            CsgTree::Union(list) => (list, Op::Or),
            CsgTree::Intersection(list) => (list, Op::And),
            CsgTree::Difference(list) => (list, Op::Minus),
        };
        let mut depth = 0;
        for (n, inner) in list.iter().enumerate() {
            let cuts = matches!(op, Op::Minus) && n > 0;
            let above = self.build(inner, first_part, reversed ^ cuts);
            depth = depth.max(above + usize::from(n > 0));
            if n > 0 {
                self.ops.push(op);
            }
        }
        depth
    }

    /// Returns the spans of part number `i` of a compound: the intervals in which each line is
    /// inside of the part. `spans` has the spans of all parts of the compound.
    #[inline(always)]
    fn spans_of<'a, L>(
        &self,
        compound: &SolidOperand<S>,
        spans: &'a [Interval<L>],
        i: u32,
    ) -> &'a [Interval<L>] {
        &spans[self.parts[compound.parts.start + i as usize].spans.clone()]
    }

    /// Returns the lanes in which the point at the distance `t` along the ray is inside of the
    /// compound. `spans` has the intervals in which the ray is inside of each part of the compound.
    #[inline(always)]
    fn inside<L: SimdFloat<Scalar = S>>(
        &self,
        compound: &SolidOperand<S>,
        spans: &[Interval<L>],
        t: L,
    ) -> L::Mask {
        with_scratch::<8, _, _>(compound.depth, L::mask(false), |stack| {
            let mut top = 0;
            for op in &self.ops[compound.ops.clone()] {
                if let Op::Part(i) = op {
                    stack[top] = inside_any(self.spans_of(compound, spans, *i), t);
                    top += 1;
                    continue;
                }
                top -= 1;
                let (a, b) = (stack[top - 1], stack[top]);
                stack[top - 1] = match op {
                    Op::Or => a | b,
                    Op::And => a & b,
                    Op::Part(_) | Op::Minus => a.and_not(b),
                };
            }
            stack[0]
        })
    }

    /// Returns the transition of each line through the compound's surface between the points at the
    /// distances `before` and `after`: whether each point is inside of the compound, and the
    /// surface between the two. `spans` has the intervals in which each line is inside of each part
    /// of the compound. The id of a part is `base` plus its number.
    fn change<L: SimdFloat<Scalar = S>>(
        &self,
        compound: &SolidOperand<S>,
        spans: &[Interval<L>],
        base: u32,
        before: L,
        after: L,
    ) -> Transition<L> {
        let nothing = Transition {
            before: L::mask(false),
            after: L::mask(false),
            t: L::zero(),
            tag: L::from_id(0),
        };
        with_scratch::<8, _, _>(compound.depth, nothing, |stack| {
            let mut top = 0;
            for op in &self.ops[compound.ops.clone()] {
                if let Op::Part(i) = op {
                    let spans = self.spans_of(compound, spans, *i);
                    let (was, is) = (inside_any(spans, before), inside_any(spans, after));
                    let mut t = spans[0].leave;
                    for span in spans {
                        t = L::select(span.at(before).and_not(is), span.leave, t);
                        t = L::select(span.at(after), span.enter, t);
                    }
                    let tag = L::from_id(base + compound.parts.start as u32 + i);
                    stack[top] = Transition { before: was, after: is, t, tag };
                    top += 1;
                    continue;
                }
                top -= 1;
                let (a, b) = (stack[top - 1], stack[top]);
                stack[top - 1] = match op {
                    Op::Or => a.or(b),
                    Op::And => a.and(b),
                    Op::Part(_) | Op::Minus => a.and(b.inverted()),
                };
            }
            stack[0]
        })
    }

    /// Replaces `hit` in the lanes of `wanted` whose ray hits `compound` nearer than `hit`. The id
    /// of a part in `hit` is `base` plus the number of the part.
    fn intersect_item<L: SimdFloat<Scalar = S>>(
        &self,
        compound: &SolidOperand<S>,
        base: u32,
        ray: &Ray<L>,
        wanted: L::Mask,
        hit: &mut Hit<L>,
    ) {
        let from_center = ray.origin - Vec3::splat(compound.center);
        let along = from_center.dot(ray.direction);
        let across = ray.direction.mul_add(-along, from_center);
        let radius2 = L::splat(compound.radius2);
        // The bounding sphere is in front of the origin of the ray or contains it.
        let ahead = along.le(L::zero()) | from_center.length_squared().le(radius2);
        let near = wanted & across.length_squared().le(radius2) & ahead;
        if near.none() {
            return;
        }
        let (never, always) = (L::from_f64(L::MAX), L::from_f64(-L::MAX));
        let parts = &self.parts[compound.parts.clone()];
        let outside = Interval { enter: never, leave: always };
        let end = Event { t: never, tie: L::zero() };
        with_scratch::<8, _, _>(compound.spans, outside, |spans| {
            with_scratch::<16, _, _>(2 * compound.spans, end, |ends| {
                let tie = ray.origin.max_abs().max(L::splat(compound.reach))
                    * L::from_f64(TIE * L::EPSILON);
                let mut count = 0;
                for part in parts {
                    let slots = &mut spans[part.spans.clone()];
                    each!(&part.solid, solid => for (span, found) in slots.iter_mut().zip(solid.spans(ray)) {
                        *span = Interval {
                            enter: L::select(found.meets, found.enter, never),
                            leave: L::select(found.meets, found.leave, always),
                        };
                        for end in events(&found, tie) {
                            insert(end, ends, count);
                            count += 1;
                        }
                    });
                }
                self.sweep_events(compound, (&*spans, &ends[..count]), base, near, hit);
            });
        });
    }

    /// Replaces `hit` by the first surface of the compound in the lanes of `open` in which this
    /// surface is nearer than `hit`. The function steps along each line through `ends`, the sorted
    /// ends of the parts' spans.
    ///
    /// Two ends coincide only if the distance between them is at most the tolerance (`tie`) of each
    /// end. The tolerance along the line is large at a face that the line grazes. If the tolerance
    /// of one end were enough, the grazed face would absorb other faces. Coincident faces have
    /// equal tolerances, because their angles to the line are equal.
    #[inline(always)]
    fn sweep_events<L: SimdFloat<Scalar = S>>(
        &self,
        compound: &SolidOperand<S>,
        (spans, ends): (&[Interval<L>], &[Event<L>]),
        base: u32,
        mut open: L::Mask,
        hit: &mut Hit<L>,
    ) {
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
            let inside = self.inside(compound, spans, middle);
            let changed = gap & (inside.and_not(state) | state.and_not(inside));
            if changed.any() {
                let seen = self.change(compound, spans, base, before, middle);
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

impl<S: Float> Compounds<S> {
    /// Replaces `hit` in the lanes whose ray hits a compound nearer than `hit`. Only compounds
    /// whose first part is in `range` are tested. The id of a part is `base` plus its number.
    #[inline(never)]
    pub fn closest<L: SimdFloat<Scalar = S>>(
        &self,
        range: Range<usize>,
        base: u32,
        ray: &Ray<L>,
        hit: &mut Hit<L>,
    ) {
        for compound in self.first[range].iter().flatten() {
            self.intersect_item(&self.compounds[*compound as usize], base, ray, L::mask(true), hit);
        }
    }

    /// Returns the lanes of `wanted` whose ray hits a compound at a distance between 0 and `limit`.
    /// Only compounds whose first part is in `range` are tested.
    #[inline(never)]
    pub fn occluded<L: SimdFloat<Scalar = S>>(
        &self,
        range: Range<usize>,
        ray: &Ray<L>,
        limit: L,
        wanted: L::Mask,
    ) -> L::Mask {
        let mut occluded = L::mask(false);
        for compound in self.first[range].iter().flatten() {
            let open = wanted.and_not(occluded);
            if open.none() {
                break;
            }
            let mut hit = Hit::with_t_max(limit);
            self.intersect_item(&self.compounds[*compound as usize], 0, ray, open, &mut hit);
            occluded = occluded | hit.t.lt(limit);
        }
        occluded
    }

    /// Returns the projection of `point` onto the surface of a compound's part. The normal points
    /// out of the compound.
    #[inline(never)]
    pub fn surface<L: SimdFloat<Scalar = S>>(
        &self,
        part: usize,
        point: Vec3<L>,
    ) -> SurfacePoint<L> {
        let part = &self.parts[part];
        let surface: SurfacePoint<L> = each!(&part.solid, solid => solid.surface(point));
        let normal = if part.reversed { -surface.normal } else { surface.normal };
        SurfacePoint { normal, ..surface }
    }

    /// Returns the texture coordinates of a compound's part at `point`; `None` if the part has
    /// none.
    pub fn uv<L: SimdFloat<Scalar = S>>(
        &self,
        part: usize,
        point: Vec3<L>,
    ) -> Option<UvGradients<L>> {
        each!(&self.parts[part].solid, solid => solid.uv(point))
    }
}

/// Returns the lanes in which the distance `t` is inside of at least one of `spans`.
#[inline(always)]
fn inside_any<L: SimdFloat>(spans: &[Interval<L>], t: L) -> L::Mask {
    let [first, others @ ..] = spans else { return L::mask(false) };
    others.iter().fold(first.at(t), |inside, span| inside | span.at(t))
}
