//! Surfaces that lie on each other, such as the bottom of a glass and the table that it stands on.
//!
//! Rounding decides which of them a ray meets first, and a ray that leaves one of them begins beyond the
//! others. So where at least one of two surfaces lets light through, paths pass them one after the other,
//! as if there were a gap of no width between the objects: a ray leaves the solids that it is inside, meets
//! what is flat, and enters the solids behind. Of solids on the same side of the place, transparent ones
//! lie outside of opaque ones, and transparent ones outside of those that are listed before them; flat
//! transparent forms lie on both sides of opaque ones.
//!
//! Each surface has a layer: places in the order along the ray's way. Leaving a solid is below zero,
//! entering it above, so that a ray that turns back has the layers' signs changed. Which objects may touch
//! is known before any ray: nothing is asked where a path meets others.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat, Vec3};
use crate::primitive::{Aggregate, Form, PrimitiveId, SphereForm};
use crate::world::integrator::nested_dielectrics::MediumStack;
use crate::world::integrator::opaque::next_distinct;
use glam::DVec3;

/// Surfaces that are so many roundings of the largest coordinate apart lie on each other, as the parts of a
/// compound do.
const TIE: f64 = 16.0;

/// Rays leave such surfaces so many ties off.
const LIFT: f64 = 1.5;

/// The least cosine between the normals of surfaces that lie on each other.
const PARALLEL: f64 = 0.5;

/// Kind of a surface among coincident ones.
#[derive(Clone, Copy, Debug)]
enum SurfaceKind {
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
}

/// Objects of a world that may touch.
pub(crate) struct Contacts<S> {
    /// For each item.
    of: Vec<Vec<Contact<S>>>,
    /// For each item its kind and the distance of its layer from zero.
    kinds: Vec<(SurfaceKind, S)>,
}

/// Start of rays on surfaces that lie on others.
#[derive(Clone, Copy)]
pub(crate) struct CoincidentState<L: SimdFloat> {
    /// Lanes where they do.
    pub lanes: L::Mask,
    /// Tag of the item.
    pub item: L,
    /// A point of it.
    pub point: Vec3<L>,
    /// Unit normal on the side to which the rays go.
    pub axis: Vec3<L>,
    /// Its layer.
    pub layer: L,
}

/// Surfaces in a layer.
pub(crate) struct CoincidentQuery<L: SimdFloat> {
    /// Lanes where there is one.
    pub lanes: L::Mask,
    /// Lanes where something lies on the surface at hand.
    pub touching: L::Mask,
    pub item: L,
    pub facet: L,
    pub layer: L,
    /// Distance off the surface at which rays start that leave it.
    pub lift: L,
}

impl<L: SimdFloat> CoincidentState<L> {
    /// Nowhere.
    pub fn none() -> Self {
        let zero = Vec3::zero();
        let item = L::from_id(0);
        Self { lanes: L::mask(false), item, point: zero, axis: zero, layer: L::zero() }
    }

    /// The rays turn back.
    pub fn reversed(&self) -> Self {
        Self { axis: -self.axis, layer: -self.layer, ..*self }
    }

    /// `yes` where `mask` is true, `no` elsewhere; the lanes are those of `no`.
    pub fn select(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            lanes: no.lanes,
            item: L::select(mask, yes.item, no.item),
            point: Vec3::select(mask, yes.point, no.point),
            axis: Vec3::select(mask, yes.axis, no.axis),
            layer: L::select(mask, yes.layer, no.layer),
        }
    }
}

impl<S: Float> Contacts<S> {
    /// Creates the contacts of `forms`, whose coordinates are rounded to `epsilon` and were given with the error `given`.
    /// `transparent`: for each of the items that `sources` lists, whether it lets light through; `rank_of`:
    /// the rank of the transparent solid that it bounds. `None`: nothing touches anything transparent.
    pub fn new(
        forms: &[Form],
        sources: &[PrimitiveId],
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
            let rounding =
                (epsilon * forms[a].max_coordinate().max(forms[b].max_coordinate())).max(given);
            if may_touch(&forms[a], &forms[b], 4.0 * TIE * rounding) {
                let tie = S::from_f64(TIE * rounding);
                touching[a].push(Contact { item: first[b], tie });
                touching[b].push(Contact { item: first[a], tie });
            }
        }
        if touching.iter().all(Vec::is_empty) {
            return None;
        }
        let count = forms.len() as f64;
        let kind = |(item, source): (usize, &PrimitiveId)| {
            let flat = forms[source.form].is_flat();
            let number = source.form as f64;
            let (kind, layer) = match (rank_of[item], flat, transparent[item]) {
                (0, true, true) => (SurfaceKind::Pane, 1.0 + number),
                (0, true, false) => (SurfaceKind::Sheet, 0.0),
                (0, false, _) => (SurfaceKind::Opaque, 4.0 * count + number),
                (rank, ..) => (SurfaceKind::Transparent(rank), 3.0 * count - f64::from(rank)),
            };
            (kind, S::from_f64(layer))
        };
        let kinds = sources.iter().enumerate().map(kind).collect();
        let of = sources.iter().map(|source| touching[source.form].clone()).collect();
        Some(Self { of, kinds })
    }

    /// Returns `true` if a surface may lie on `item`.
    #[inline(always)]
    pub fn touches(&self, item: u32) -> bool {
        !self.of[item as usize].is_empty()
    }

    /// The layer of `item` for rays that come to it from `before`; `leaves`: those that go where its
    /// normal points to.
    fn layer<L: SimdFloat<Scalar = S>>(&self, item: u32, leaves: L::Mask, before: L) -> L {
        let (kind, layer) = &self.kinds[item as usize];
        let layer = L::splat(*layer);
        let below = match kind {
            SurfaceKind::Pane => before.lt(L::zero()),
            SurfaceKind::Sheet => return L::zero(),
            SurfaceKind::Transparent(_) | SurfaceKind::Opaque => leaves,
        };
        L::select(below, -layer, layer)
    }

    /// The first surface behind the one that rays begin on, of those that lie on it. `inside`: what the
    /// rays are inside.
    pub fn next<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        coincident: &CoincidentState<L>,
        inside: &MediumStack<L>,
    ) -> CoincidentQuery<L> {
        let mut out = CoincidentQuery {
            lanes: L::mask(false),
            touching: L::mask(false),
            item: coincident.item,
            facet: L::from_id(0),
            layer: L::from_f64(L::MAX),
            lift: L::zero(),
        };
        self.search(geometry, coincident, inside, &mut out);
        out
    }

    /// The surface that rays meet first of the one that `coincident` says and those that lie on it; the seam's
    /// layer means nothing. `leaves`: lanes that go where the normal of the seam's item points to.
    pub fn first<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        coincident: &CoincidentState<L>,
        leaves: L::Mask,
        inside: &MediumStack<L>,
    ) -> CoincidentQuery<L> {
        let before = L::from_f64(-L::MAX);
        let mut layer = L::zero();
        let mut left = coincident.lanes;
        while let Some((item, here)) = next_distinct(coincident.item, left) {
            layer = L::select(here, self.layer(item, leaves, before), layer);
            left = left.and_not(here);
        }
        let mut out = CoincidentQuery {
            lanes: L::mask(false),
            touching: L::mask(false),
            item: coincident.item,
            facet: L::from_id(0),
            layer,
            lift: L::zero(),
        };
        self.search(geometry, &CoincidentState { layer: before, ..*coincident }, inside, &mut out);
        out
    }

    /// Puts into `out` what comes before its layer and behind that of `coincident`.
    #[inline(never)]
    fn search<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        coincident: &CoincidentState<L>,
        inside: &MediumStack<L>,
        out: &mut CoincidentQuery<L>,
    ) {
        let rounding = coincident.point.max_abs() * L::from_f64(TIE * L::EPSILON);
        let mut left = coincident.lanes;
        while let Some((item, here)) = next_distinct(coincident.item, left) {
            left = left.and_not(here);
            for contact in &self.of[item as usize] {
                // Along the normal, through the point: so the angle of the ray does not matter.
                let tie = rounding.max(L::splat(contact.tie));
                let origin = coincident.axis.mul_add(-tie, coincident.point);
                let limit = L::select(here, tie + tie, L::from_f64(-1.0));
                let ray = Ray { origin, direction: coincident.axis };
                let hit = geometry.closest_to(contact.item, &ray, limit);
                let mut met = here & hit.t.lt(limit);
                while let Some((other, these)) = next_distinct(hit.item, met) {
                    met = met.and_not(these);
                    let normal = geometry.surface(other, hit.triangle, coincident.point).normal;
                    let cosine = normal.dot(coincident.axis);
                    let leaves = cosine.gt(L::zero());
                    let mut these = these & cosine.abs().gt(L::from_f64(PARALLEL));
                    if let (SurfaceKind::Transparent(rank), _) = &self.kinds[other as usize] {
                        // What a path is not inside of it cannot leave.
                        let within = inside.contains(L::from_f64(f64::from(*rank)));
                        these = these & ((within & leaves) | (!within & !leaves));
                    }
                    let layer = self.layer(other, leaves, coincident.layer);
                    out.touching = out.touching | these;
                    out.lift = L::select(these, out.lift.max(tie * L::from_f64(LIFT)), out.lift);
                    let nearer = these & layer.gt(coincident.layer) & layer.lt(out.layer);
                    out.lanes = out.lanes | nearer;
                    out.item = L::select(nearer, L::from_id(other), out.item);
                    out.facet = L::select(nearer, hit.triangle, out.facet);
                    out.layer = L::select(nearer, layer, out.layer);
                }
            }
        }
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

/// Returns `true` if surfaces of two forms may come within `slack` of each other.
fn may_touch(a: &Form, b: &Form, slack: f64) -> bool {
    let normal = |form: &Form| form.plane().map(|plane| plane.normal);
    let apart = |axis: DVec3| match (a.extent_along(axis), b.extent_along(axis)) {
        (Some(a), Some(b)) => a.0 > b.1 + slack || b.0 > a.1 + slack,
        _ => false,
    };
    if DVec3::AXES.into_iter().chain(normal(a)).chain(normal(b)).any(apart) {
        return false;
    }
    if let (
        Form::Sphere(SphereForm { center, radius }),
        Form::Sphere(SphereForm { center: other, radius: size }),
    ) = (a, b)
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
    use crate::primitive::PlaneForm;
    use crate::shape::Shape;

    #[test]
    fn only_what_touches_is_paired() {
        let ball =
            |y: f64, radius| Form::Sphere(SphereForm { center: DVec3::new(0.0, y, 0.0), radius });
        let plane = |normal: DVec3, offset| Form::Plane(PlaneForm { normal, offset });
        let cube = Shape::fitted_to("cube", DVec3::ZERO, DVec3::ONE).unwrap().form();
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
