//! Surfaces that lie on each other, such as the bottom of a glass and the table that it stands on.
//!
//! Rounding decides which of them a ray meets first, and a ray that leaves one of them begins beyond the
//! others. So where at least one of two surfaces lets light through, paths pass them one after the other,
//! as if there were a gap of no width between the things: a ray leaves the solids that it is inside, meets
//! what is flat, and enters the solids behind. Of solids on the same side of the place, transparent ones
//! lie outside of opaque ones, and transparent ones outside of those that are listed before them; flat
//! transparent things lie on both sides of opaque ones.
//!
//! Each surface has a layer: places in the order along the ray's way. Leaving a solid is below zero,
//! entering it above, so that a ray that turns back has the layers' signs changed. Which things may touch
//! is known before any ray: nothing is asked where a path meets others.

use super::media::Inside;
use super::path::first_tag;
use crate::lanes::{Lanes, Mask, Real, V3};
use crate::shape::{Form, Geometry, Ray, Source};
use glam::DVec3;

/// Surfaces that are so many roundings of the largest coordinate apart lie on each other, as the parts of a
/// compound do.
const TIE: f64 = 16.0;

/// Rays leave such surfaces so many ties off.
const LIFT: f64 = 1.5;

/// The least cosine between the normals of surfaces that lie on each other.
const PARALLEL: f64 = 0.5;

/// How an item lies among others.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// The surface of a transparent solid of this rank.
    Transparent(u32),
    /// The surface of an opaque solid.
    Opaque,
    /// Flat and transparent.
    Pane,
    /// Flat and opaque.
    Sheet,
}

/// An item that may lie on another one.
#[derive(Clone, Copy, Debug)]
struct Contact<S> {
    /// The first part of it, if it is a compound.
    item: u32,
    /// Half the width within which surfaces lie on each other.
    tie: S,
    /// A box around it, endless where it is.
    low: [S; 3],
    high: [S; 3],
}

impl<S: Real> Contact<S> {
    fn new(item: u32, form: &Form, tie: f64) -> Self {
        let (low, high) = extent(form);
        let [low, high] = [low, high].map(|corner| corner.to_array().map(S::of));
        Self { item, tie: S::of(tie), low, high }
    }

    /// Half the width within which surfaces lie on each other at points that are rounded to `rounding` / `TIE`.
    #[inline(always)]
    fn tie<L: Lanes<Scalar = S>>(&self, rounding: L) -> L {
        rounding.max(L::splat(self.tie))
    }

    /// Lanes whose point may be on it. What is found within one tie of a point is itself found to some roundings,
    /// far less than the other tie.
    #[inline(always)]
    fn is_near<L: Lanes<Scalar = S>>(&self, point: V3<L>, rounding: L) -> L::Mask {
        let beyond =
            |p: L, axis: usize| (L::splat(self.low[axis]) - p).max(p - L::splat(self.high[axis]));
        let beyond = beyond(point.x, 0).max(beyond(point.y, 1)).max(beyond(point.z, 2));
        let tie = self.tie(rounding);
        beyond.le(tie + tie)
    }
}

/// Rounding of the coordinates of points, `TIE` times.
#[inline(always)]
fn rounding<L: Lanes>(point: V3<L>) -> L {
    point.max_abs() * L::of(TIE * L::EPSILON)
}

/// The things of a world that may touch.
pub(super) struct Contacts<S> {
    /// For each item.
    of: Vec<Vec<Contact<S>>>,
    /// For each item its kind and the distance of its layer from zero.
    kinds: Vec<(Kind, S)>,
}

/// Where rays begin on surfaces that lie on others.
#[derive(Clone, Copy)]
pub(super) struct Seam<L: Lanes> {
    /// Lanes where they do.
    pub lanes: L::Mask,
    /// Tag of the item.
    pub item: L,
    /// A point of it.
    pub point: V3<L>,
    /// Unit normal on the side to which the rays go.
    pub axis: V3<L>,
    /// Its layer.
    pub layer: L,
}

/// Surfaces in a layer.
pub(super) struct Layer<L: Lanes> {
    /// Lanes where there is one.
    pub lanes: L::Mask,
    /// Lanes where something lies on the surface at hand.
    pub touching: L::Mask,
    pub item: L,
    pub facet: L,
    pub layer: L,
    /// How far off rays start that leave it.
    pub lift: L,
}

impl<L: Lanes> Seam<L> {
    /// The rays turn back.
    pub fn reversed(&self) -> Self {
        Self { axis: -self.axis, layer: -self.layer, ..*self }
    }

    /// `yes` where `mask` is true, `no` elsewhere; the lanes are those of `no`.
    pub fn select(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            lanes: no.lanes,
            item: L::select(mask, yes.item, no.item),
            point: V3::select(mask, yes.point, no.point),
            axis: V3::select(mask, yes.axis, no.axis),
            layer: L::select(mask, yes.layer, no.layer),
        }
    }
}

impl<S: Real> Contacts<S> {
    /// Of `forms`, whose coordinates are rounded to `epsilon` and were given with the error `given`.
    /// `transparent`: for each of the items that `sources` lists, whether it lets light through; `rank_of`:
    /// the rank of the transparent solid that it bounds. `None`: nothing touches anything transparent.
    pub fn new(
        forms: &[Form],
        sources: &[Source],
        (transparent, rank_of): (&[bool], &[u32]),
        (epsilon, given): (f64, f64),
    ) -> Option<Self> {
        let mut first = vec![0; forms.len()];
        let mut lets_through = vec![false; forms.len()];
        for (item, source) in (0..).zip(sources) {
            if source.part == 0 {
                first[source.form] = item;
            }
            lets_through[source.form] |= transparent[item as usize];
        }
        let mut touching = vec![Vec::new(); forms.len()];
        for (a, b) in pairs(forms, |a, b| lets_through[a] || lets_through[b]) {
            let rounding = (epsilon * reach(&forms[a]).max(reach(&forms[b]))).max(given);
            if may_touch(&forms[a], &forms[b], 4.0 * TIE * rounding) {
                let tie = TIE * rounding;
                touching[a].push(Contact::new(first[b], &forms[b], tie));
                touching[b].push(Contact::new(first[a], &forms[a], tie));
            }
        }
        if touching.iter().all(Vec::is_empty) {
            return None;
        }
        let count = forms.len() as f64;
        let kind = |(item, source): (usize, &Source)| {
            let flat =
                matches!(forms[source.form], Form::Parallelogram { .. } | Form::Plane { .. });
            let number = source.form as f64;
            let (kind, layer) = match (rank_of[item], flat, transparent[item]) {
                (0, true, true) => (Kind::Pane, 1.0 + number),
                (0, true, false) => (Kind::Sheet, 0.0),
                (0, false, _) => (Kind::Opaque, 4.0 * count + number),
                (rank, ..) => (Kind::Transparent(rank), 3.0 * count - f64::from(rank)),
            };
            (kind, S::of(layer))
        };
        let kinds = sources.iter().enumerate().map(kind).collect();
        let of = sources.iter().map(|source| touching[source.form].clone()).collect();
        Some(Self { of, kinds })
    }

    /// Of `lanes`, with a `point` of one of the `items` each, those where anything may lie on it. Most surfaces touch
    /// others in few places only: the boxes of these tell.
    #[inline(always)]
    pub fn near<L: Lanes<Scalar = S>>(&self, items: L, point: V3<L>, lanes: L::Mask) -> L::Mask {
        let rounding = rounding(point);
        let (mut near, mut left) = (L::mask(false), lanes);
        while let Some((item, here)) = first_tag(items, left) {
            for contact in &self.of[item as usize] {
                near = near | (here & contact.is_near(point, rounding));
            }
            left = left.and_not(here);
        }
        near
    }

    /// The layer of `item` for rays that come to it from `before`; `leaves`: those that go where its
    /// normal points to.
    fn layer<L: Lanes<Scalar = S>>(&self, item: u32, leaves: L::Mask, before: L) -> L {
        let (kind, layer) = &self.kinds[item as usize];
        let layer = L::splat(*layer);
        let below = match kind {
            Kind::Pane => before.lt(L::zero()),
            Kind::Sheet => return L::zero(),
            Kind::Transparent(_) | Kind::Opaque => leaves,
        };
        L::select(below, -layer, layer)
    }

    /// The first surface behind the one that rays begin on, of those that lie on it. `inside`: what the
    /// rays are inside.
    pub fn next<L: Lanes<Scalar = S>>(
        &self,
        geometry: &Geometry<L>,
        seam: &Seam<L>,
        inside: &Inside<L>,
    ) -> Layer<L> {
        let mut out = Layer {
            lanes: L::mask(false),
            touching: L::mask(false),
            item: seam.item,
            facet: L::tag(0),
            layer: L::of(L::MAX),
            lift: L::zero(),
        };
        self.search(geometry, seam, inside, &mut out);
        out
    }

    /// The surface that rays meet first of the one that `seam` says and those that lie on it; the seam's
    /// layer means nothing. `leaves`: lanes that go where the normal of the seam's item points to.
    pub fn first<L: Lanes<Scalar = S>>(
        &self,
        geometry: &Geometry<L>,
        seam: &Seam<L>,
        leaves: L::Mask,
        inside: &Inside<L>,
    ) -> Layer<L> {
        let before = L::of(-L::MAX);
        let mut layer = L::zero();
        let mut left = seam.lanes;
        while let Some((item, here)) = first_tag(seam.item, left) {
            layer = L::select(here, self.layer(item, leaves, before), layer);
            left = left.and_not(here);
        }
        let mut out = Layer {
            lanes: L::mask(false),
            touching: L::mask(false),
            item: seam.item,
            facet: L::tag(0),
            layer,
            lift: L::zero(),
        };
        self.search(geometry, &Seam { layer: before, ..*seam }, inside, &mut out);
        out
    }

    /// Puts into `out` what comes before its layer and behind that of `seam`.
    #[inline(never)]
    fn search<L: Lanes<Scalar = S>>(
        &self,
        geometry: &Geometry<L>,
        seam: &Seam<L>,
        inside: &Inside<L>,
        out: &mut Layer<L>,
    ) {
        let rounding = rounding(seam.point);
        let mut left = seam.lanes;
        while let Some((item, here)) = first_tag(seam.item, left) {
            left = left.and_not(here);
            for contact in &self.of[item as usize] {
                let here = here & contact.is_near(seam.point, rounding);
                if here.none() {
                    continue;
                }
                // Along the normal, through the point: so the angle of the ray does not matter.
                let tie = contact.tie(rounding);
                let origin = seam.axis.mul_add(-tie, seam.point);
                let limit = L::select(here, tie + tie, L::of(-1.0));
                let ray = Ray { origin, direction: seam.axis };
                let hit = geometry.closest_to(contact.item, &ray, limit);
                let mut met = here & hit.t.lt(limit);
                while let Some((other, these)) = first_tag(hit.item, met) {
                    met = met.and_not(these);
                    let normal = geometry.surface(other, hit.facet, seam.point).normal;
                    let cosine = normal.dot(seam.axis);
                    let leaves = cosine.gt(L::zero());
                    let mut these = these & cosine.abs().gt(L::of(PARALLEL));
                    if let (Kind::Transparent(rank), _) = &self.kinds[other as usize] {
                        // What a path is not inside of it cannot leave.
                        let within = inside.holds(L::of(f64::from(*rank)));
                        these = these & ((within & leaves) | (!within & !leaves));
                    }
                    let layer = self.layer(other, leaves, seam.layer);
                    out.touching = out.touching | these;
                    out.lift = L::select(these, out.lift.max(tie * L::of(LIFT)), out.lift);
                    let nearer = these & layer.gt(seam.layer) & layer.lt(out.layer);
                    out.lanes = out.lanes | nearer;
                    out.item = L::select(nearer, L::tag(other), out.item);
                    out.facet = L::select(nearer, hit.facet, out.facet);
                    out.layer = L::select(nearer, layer, out.layer);
                }
            }
        }
    }
}

/// Largest magnitude of a coordinate that its surface is computed from.
fn reach(form: &Form) -> f64 {
    match form {
        Form::Plane { offset, .. } => offset.abs(),
        _ => form.bounds().map_or(0.0, |(low, high)| low.abs().max(high.abs()).max_element()),
    }
}

/// The box around a form, endless where the form is; of a plane across an axis its place there.
fn extent(form: &Form) -> (DVec3, DVec3) {
    let (low, high) = (DVec3::NEG_INFINITY, DVec3::INFINITY);
    match form {
        Form::Plane { normal, offset } => {
            let at = *normal * *offset;
            let across = |axis: &DVec3| normal.dot(*axis).abs() == 1.0;
            DVec3::AXES.iter().find(|axis| across(axis)).map_or((low, high), |axis| {
                let here = axis.cmpne(DVec3::ZERO);
                (DVec3::select(here, at, low), DVec3::select(here, at, high))
            })
        }
        _ => form.bounds().unwrap_or((low, high)),
    }
}

/// The pairs of forms for which `wanted` is true and whose boxes overlap, or come close.
fn pairs(forms: &[Form], wanted: impl Fn(usize, usize) -> bool) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    let endless = (DVec3::NEG_INFINITY, DVec3::INFINITY);
    let slack = 1e-5;
    let around = |form: &Form| {
        form.bounds().map_or(endless, |(low, high)| {
            let room = slack * low.abs().max(high.abs()).max_element();
            (low - room, high + room)
        })
    };
    let boxes: Vec<_> = forms.iter().map(around).collect();
    let mut order: Vec<usize> = (0..forms.len()).collect();
    order.sort_by(|a, b| boxes[*a].0.x.total_cmp(&boxes[*b].0.x));
    for (i, a) in order.iter().enumerate() {
        let (low, high) = boxes[*a];
        for b in order[i + 1..].iter().take_while(|b| boxes[**b].0.x <= high.x) {
            let apart = boxes[*b].0.cmpgt(high).any() || boxes[*b].1.cmplt(low).any();
            if !apart && wanted(*a, *b) {
                out.push((*a.min(b), *a.max(b)));
            }
        }
    }
    // The order of the list, so that nothing depends on places.
    out.sort_unstable();
    out
}

/// The least and the largest of `axis . p` over a form, or beyond; `None`: it has no end there.
fn span(form: &Form, axis: DVec3) -> Option<(f64, f64)> {
    let around = |points: &[DVec3]| {
        let heights = points.iter().map(|p| axis.dot(*p));
        (heights.clone().fold(f64::INFINITY, f64::min), heights.fold(f64::NEG_INFINITY, f64::max))
    };
    match form {
        Form::Sphere { center, radius } => {
            Some((axis.dot(*center) - radius, axis.dot(*center) + radius))
        }
        Form::Convex { corners, .. } => Some(around(corners)),
        Form::Parallelogram { corner, u, v } => {
            Some(around(&[*corner, corner + u, corner + v, corner + u + v]))
        }
        Form::Plane { normal, offset } => {
            let along = normal.dot(axis);
            let parallel = along.abs() > 1.0 - 1e-12;
            parallel.then_some((along.signum() * offset, along.signum() * offset))
        }
        _ => {
            let (low, high) = form.bounds()?;
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            let (at, reach) = (axis.dot(middle), axis.abs().dot(half));
            Some((at - reach, at + reach))
        }
    }
}

/// Whether surfaces of two forms may come within `slack` of each other.
fn may_touch(a: &Form, b: &Form, slack: f64) -> bool {
    let normal = |form: &Form| match form {
        Form::Parallelogram { u, v, .. } => Some(u.cross(*v).normalize()),
        Form::Plane { normal, .. } => Some(*normal),
        _ => None,
    };
    let apart = |axis: DVec3| match (span(a, axis), span(b, axis)) {
        (Some(a), Some(b)) => a.0 > b.1 + slack || b.0 > a.1 + slack,
        _ => false,
    };
    if DVec3::AXES.into_iter().chain(normal(a)).chain(normal(b)).any(apart) {
        return false;
    }
    if let (Form::Sphere { center, radius }, Form::Sphere { center: other, radius: size }) = (a, b)
    {
        let distance = center.distance(*other);
        // Beside each other, or one inside the other.
        return distance <= radius + size + slack && distance + slack >= (radius - size).abs();
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;

    #[test]
    fn only_what_touches_is_paired() {
        let ball = |y: f64, radius| Form::Sphere { center: DVec3::new(0.0, y, 0.0), radius };
        let plane = |normal: DVec3, offset| Form::Plane { normal, offset };
        let cube = Shape::standing("cube", DVec3::ZERO, DVec3::ONE).unwrap().form();
        let slanted = DVec3::new(0.6, 0.8, 0.0);
        for (a, b, touch) in [
            (ball(1.0, 1.0), plane(DVec3::Y, 0.0), true),
            (ball(1.1, 1.0), plane(DVec3::Y, 0.0), false),
            (ball(1.0, 1.0), plane(slanted, -0.2), true),
            (ball(1.1, 1.0), plane(slanted, -0.2), false),
            (ball(0.0, 1.0), ball(2.0, 1.0), true),
            (ball(0.0, 1.0), ball(0.0, 0.9), false),
            (ball(0.0, 1.0), ball(0.1, 0.9), true),
            (ball(0.0, 1.0), ball(2.1, 1.0), false),
            (cube.clone(), plane(DVec3::NEG_Y, 0.0), true),
            (cube.clone(), plane(DVec3::Y, -0.1), false),
            (cube.clone(), ball(-1.0, 1.0), true),
            (plane(DVec3::Y, 1.0), plane(DVec3::NEG_Y, -1.0), true),
            (plane(DVec3::Y, 1.0), plane(DVec3::Y, 1.1), false),
        ] {
            assert_eq!(may_touch(&a, &b, 1e-6), touch, "{a:?} {b:?}");
            assert_eq!(may_touch(&b, &a, 1e-6), touch, "{b:?} {a:?}");
        }
        let forms = [ball(0.0, 1.0), plane(DVec3::Y, 7.0), ball(5.0, 1.0), ball(0.5, 1.0)];
        let found = pairs(&forms, |a, b| a == 1 || b == 1 || a + b == 3);
        assert_eq!(found, [(0, 1), (0, 3), (1, 2), (1, 3)]);
    }
}
