//! Coincident surfaces: surfaces of different primitives at the same position, such as the bottom
//! of a glass and the table below it.
//!
//! Rounding decides which of two coincident surfaces a ray hits first, and a ray that leaves one
//! surface starts beyond the others. Paths therefore cross coincident surfaces in a fixed order if
//! at least one of the surfaces transmits. The order is as if the primitives had gaps of zero
//! width: a ray first leaves the solids that it is inside, then crosses flat primitives, then
//! enters the solids behind. Several solids on the same side of a surface count as nested.
//! Transparent solids enclose opaque solids, and a transparent solid encloses those listed before
//! it in the scene file. Flat transparent primitives are on both sides of flat opaque ones.
//!
//! The *layer* of a surface is a number that gives its position in this order along the ray.
//! Surfaces where the ray leaves a solid have negative layers, surfaces where it enters a solid
//! have positive ones. For a ray of the opposite direction the signs change. A *contact* is a
//! primitive that may touch another one. Contacts are found at compilation, so that hits on other
//! primitives cost no lookup.

use crate::integrator::box_tree::BoxTree;
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::nested_dielectrics::MediumStack;
use glam::DVec3;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, Vec3, distinct};
use zerkalo_kernel::primitive::{Aggregate, Bounds, Form, PrimitiveId, SphereForm, UNBOUNDED};
use zerkalo_scene::value::{ascending, total_order};

/// *Tie distance*: the largest distance along the normal at which a surface counts as coincident
/// with the surface of a hit point, in rounding errors of the largest coordinate. `primitive::csg`
/// uses the same value for surfaces of parts of a compound.
const TIE: f64 = 16.0;

/// Height above coincident surfaces at which rays that leave them start, in tie distances.
const OFFSET_TIES: f64 = 1.5;

/// Smallest cosine between the normals of coincident surfaces. Rays cross surfaces at larger angles
/// in the order of distance.
const MIN_COSINE: f64 = 0.5;

/// Largest number of contacts in the list of an object. An object with more searches the boxes of
/// all others, so that the memory grows with the number of objects, not with its square.
const MAX_LISTED: usize = 64;

/// Kind of a surface, which determines the order in which rays cross coincident surfaces.
#[derive(Clone, Copy, Debug)]
enum SurfaceKind {
    /// Boundary of a transparent solid. The value is its priority (see [`MediumStack`]).
    Transparent(u32),
    /// Boundary of an opaque solid, which no ray enters.
    Opaque,
    /// Flat transparent primitive, which has no inside, such as a window pane.
    Pane,
    /// Flat opaque primitive, which has no inside, such as a sheet of paper.
    Sheet,
}

/// Object that primitives of other objects may touch.
#[derive(Clone, Copy, Debug)]
struct Contact<S> {
    /// Id of its primitive; for a compound, the id of the first part.
    primitive: u32,
    /// Lower bound of the tie distance \[scene units\].
    tie: S,
    /// Corners of its bounding box, infinite where it is unbounded.
    low: [S; 3],
    high: [S; 3],
}

impl<S: Float> Contact<S> {
    fn new(primitive: u32, form: &Form, tie: f64) -> Self {
        let (low, high) = unbounded_box(form);
        let [low, high] = [low, high].map(|corner| corner.to_array().map(S::from_f64));
        Self { primitive, tie: S::from_f64(tie), low, high }
    }

    /// Returns the lanes whose point may be on the object: at most two distances `tie` from its
    /// bounding box. One is the range of the search for coincident surfaces, the other is a margin
    /// for rounding errors.
    #[inline(always)]
    fn is_near<L: SimdFloat<Scalar = S>>(&self, point: Vec3<L>, tie: L) -> L::Mask {
        let distance =
            |p: L, axis: usize| (L::splat(self.low[axis]) - p).max(p - L::splat(self.high[axis]));
        let distance = distance(point.x, 0).max(distance(point.y, 1)).max(distance(point.z, 2));
        distance.le(tie + tie)
    }
}

/// Returns the tie distance at each point: the largest rounding error of its coordinates, times
/// [`TIE`].
#[inline(always)]
fn rounding<L: SimdFloat>(point: Vec3<L>) -> L {
    point.max_abs() * L::from_f64(TIE * L::EPSILON)
}

/// Pairs of primitives that may touch each other. In each pair at least one primitive transmits.
pub(crate) struct Contacts<S> {
    objects: Vec<Contact<S>>,
    /// Object of each primitive.
    object_of: Vec<u32>,
    /// Objects that may touch each object; `None` if they are more than [`MAX_LISTED`].
    touching: Vec<Option<Vec<u32>>>,
    /// For opaque objects, the boxes of those that transmit; for objects that transmit, all boxes.
    trees: [BoxTree; 2],
    transmits: Vec<bool>,
    /// Kind of the surface of each primitive, and the magnitude of its layer.
    kinds: Vec<(SurfaceKind, S)>,
}

/// State of rays that start on a surface that may coincide with other surfaces.
#[derive(Clone, Copy)]
pub(crate) struct CoincidentState<L: SimdFloat> {
    /// Lanes whose rays start on a surface that may coincide with others.
    pub lanes: L::Mask,
    /// Ids of the primitives on which the rays start.
    pub primitive: L,
    /// Points at which the rays start.
    pub point: Vec3<L>,
    /// Unit normals on the side to which the rays leave.
    pub axis: Vec3<L>,
    /// Layers of the start surfaces.
    pub layer: L,
}

/// Result of a search for the next coincident surface along the rays.
pub(crate) struct CoincidentQuery<L: SimdFloat> {
    /// Lanes in which a next coincident surface was found.
    pub lanes: L::Mask,
    /// Lanes whose start surface coincides with another one.
    pub touching: L::Mask,
    pub primitive: L,
    pub triangle: L,
    pub layer: L,
    /// Distance above the start surface at which ray origins are beyond all coincident surfaces; 0
    /// if there are none.
    pub offset: L,
}

impl<L: SimdFloat> CoincidentState<L> {
    /// Returns the state of rays that pass the surfaces at the hit points of `lanes`.
    pub fn behind(interaction: &SurfaceInteraction<L>, lanes: L::Mask, layer: L) -> Self {
        let SurfaceInteraction { primitive, point, geometric, .. } = *interaction;
        Self { lanes, primitive, point, axis: -geometric, layer }
    }

    /// Returns the state of rays that start at the same points but run in the opposite directions.
    pub fn reversed(&self) -> Self {
        Self { axis: -self.axis, layer: -self.layer, ..*self }
    }

    /// Returns `yes` in the lanes of `mask` and `no` elsewhere. The result has the `lanes` of `no`.
    pub fn select(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            lanes: no.lanes,
            primitive: L::select(mask, yes.primitive, no.primitive),
            point: Vec3::select(mask, yes.point, no.point),
            axis: Vec3::select(mask, yes.axis, no.axis),
            layer: L::select(mask, yes.layer, no.layer),
        }
    }
}

impl<S: Float> Contacts<S> {
    /// Finds the primitives that may touch each other; `None` if no primitive that transmits
    /// touches another one. `transparent` is `true` for primitives that transmit. `priority_of` has
    /// the priority of the solid that each primitive bounds. `epsilon` is the relative rounding
    /// error of coordinates, and `input_error` is the absolute rounding error of coordinates in the
    /// scene file.
    pub fn new(
        forms: &[Form],
        primitives: &[PrimitiveId],
        transparent: &[bool],
        priority_of: &[u32],
        epsilon: f64,
        input_error: f64,
    ) -> Option<Self> {
        let first = first_primitives(forms, primitives);
        let mut transmits = vec![false; forms.len()];
        for (source, transparent) in primitives.iter().zip(transparent) {
            transmits[source.form] |= transparent;
        }
        let objects = forms.iter().zip(&first).map(|(form, first)| {
            let tie = TIE * (epsilon * form.max_coordinate()).max(input_error);
            Contact::new(*first, form, tie)
        });
        let objects: Vec<Contact<S>> = objects.collect();
        let boxes: Vec<Bounds> = forms.iter().map(padded_box).collect();
        let clear = (0..forms.len()).filter(|form| transmits[*form]).collect();
        let trees = [clear, (0..forms.len()).collect()].map(|forms| BoxTree::new(&boxes, forms));
        let touching_of = |a: usize| {
            let mut found = Vec::new();
            trees[usize::from(transmits[a])].visit(boxes[a], |b| {
                let slack = 4.0 * objects[a].tie.to_f64().max(objects[b].tie.to_f64());
                if a != b && may_touch(&forms[a], &forms[b], slack) {
                    found.push(b as u32);
                }
                found.len() <= MAX_LISTED
            });
            found.sort_unstable();
            Some(found).filter(|found| found.len() <= MAX_LISTED)
        };
        let touching: Vec<_> = (0..forms.len()).map(touching_of).collect();
        if touching.iter().all(|touching| touching.as_ref().is_some_and(Vec::is_empty)) {
            return None;
        }
        let count = forms.len() as f64;
        let kind = |(primitive, source): (usize, &PrimitiveId)| {
            let flat = forms[source.form].is_flat();
            let number = source.form as f64;
            let (kind, layer) = match (priority_of[primitive], flat, transparent[primitive]) {
                (0, true, true) => (SurfaceKind::Pane, 1.0 + number),
                (0, true, false) => (SurfaceKind::Sheet, 0.0),
                (0, false, _) => (SurfaceKind::Opaque, 4.0 * count + number),
                (priority, ..) => {
                    (SurfaceKind::Transparent(priority), 3.0 * count - f64::from(priority))
                }
            };
            (kind, S::from_f64(layer))
        };
        let kinds = primitives.iter().enumerate().map(kind).collect();
        let object_of = primitives.iter().map(|id| id.form as u32).collect();
        Some(Self { objects, object_of, touching, trees, transmits, kinds })
    }

    /// Calls `visit` with each object that may touch the one of `primitive` near the points of
    /// `lanes`, with the tie distance and the lanes.
    #[inline(always)]
    fn visit_near<L: SimdFloat<Scalar = S>>(
        &self,
        primitive: u32,
        point: Vec3<L>,
        lanes: L::Mask,
        mut visit: impl FnMut(&Contact<S>, L, L::Mask),
    ) {
        let object = self.object_of[primitive as usize] as usize;
        let rounding = rounding(point).max(L::splat(self.objects[object].tie));
        let mut visit = |other: u32| {
            let contact = &self.objects[other as usize];
            let tie = rounding.max(L::splat(contact.tie));
            let near = lanes & contact.is_near(point, tie);
            if near.any() {
                visit(contact, tie, near);
            }
        };
        match &self.touching[object] {
            Some(touching) => touching.iter().copied().for_each(visit),
            None => self.crowd(object, point, rounding, lanes).into_iter().for_each(&mut visit),
        }
    }

    /// Returns the objects that have boxes near the points of `lanes` and may touch `object`, in
    /// ascending order.
    #[inline(never)]
    fn crowd<L: SimdFloat<Scalar = S>>(
        &self,
        object: usize,
        point: Vec3<L>,
        rounding: L,
        lanes: L::Mask,
    ) -> Vec<u32> {
        let mut bounds = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for lane in (0..L::WIDTH).filter(|lane| lanes.lane(*lane)) {
            let point = DVec3::from_array(point.lane(lane).map(Float::to_f64));
            let margin = 2.5 * rounding.lane(lane).to_f64();
            bounds = (bounds.0.min(point - margin), bounds.1.max(point + margin));
        }
        let mut found = Vec::new();
        self.trees[usize::from(self.transmits[object])].visit(bounds, |other| {
            if other != object {
                found.push(other as u32);
            }
            true
        });
        found.sort_unstable();
        found
    }

    /// Returns the lanes whose `point`, on `primitives`, may be on a second primitive as
    /// well. Points outside the bounding boxes of all other primitives are excluded, because
    /// most primitives touch others only in small regions.
    #[inline(always)]
    pub fn near<L: SimdFloat<Scalar = S>>(
        &self,
        primitives: L,
        point: Vec3<L>,
        lanes: L::Mask,
    ) -> L::Mask {
        let mut near = L::mask(false);
        for (primitive, lanes) in distinct(primitives, lanes) {
            self.visit_near(primitive, point, lanes, |_, _, lanes| near = near | lanes);
        }
        near
    }

    /// Returns the layer of `primitive` for rays that come from a surface with the layer `before`.
    /// `leaves` are the lanes whose rays run along the outward normal.
    fn layer<L: SimdFloat<Scalar = S>>(&self, primitive: u32, leaves: L::Mask, before: L) -> L {
        let (kind, layer) = &self.kinds[primitive as usize];
        let layer = L::splat(*layer);
        let is_negative = match kind {
            SurfaceKind::Pane => before.lt(L::zero()),
            SurfaceKind::Sheet => return L::zero(),
            SurfaceKind::Transparent(_) | SurfaceKind::Opaque => leaves,
        };
        L::select(is_negative, -layer, layer)
    }

    /// Finds the surface that rays cross next among those that coincide with their start points.
    pub fn next<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        coincident: &CoincidentState<L>,
        media: &MediumStack<L>,
    ) -> CoincidentQuery<L> {
        self.search(geometry, coincident, media, L::from_f64(L::MAX))
    }

    /// Finds the surface that the rays cross first: the start surface or one that coincides with
    /// it. The layer in `coincident` is ignored. `leaves` are the lanes whose rays run along the
    /// outward normal of the start surface.
    pub fn first<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        coincident: &CoincidentState<L>,
        leaves: L::Mask,
        media: &MediumStack<L>,
    ) -> CoincidentQuery<L> {
        let before = L::from_f64(-L::MAX);
        let mut layer = L::zero();
        for (primitive, lanes) in distinct(coincident.primitive, coincident.lanes) {
            layer = L::select(lanes, self.layer(primitive, leaves, before), layer);
        }
        let coincident = CoincidentState { layer: before, ..*coincident };
        self.search(geometry, &coincident, media, layer)
    }

    /// Searches the surfaces that coincide with the start points for the one with the lowest layer,
    /// among layers above `coincident.layer` and below `layer`.
    #[inline(never)]
    fn search<L: SimdFloat<Scalar = S>>(
        &self,
        geometry: &Aggregate<L>,
        coincident: &CoincidentState<L>,
        media: &MediumStack<L>,
        layer: L,
    ) -> CoincidentQuery<L> {
        let mut out = CoincidentQuery {
            lanes: L::mask(false),
            touching: L::mask(false),
            primitive: coincident.primitive,
            triangle: L::from_id(0),
            layer,
            offset: L::zero(),
        };
        for (primitive, lanes) in distinct(coincident.primitive, coincident.lanes) {
            self.visit_near(primitive, coincident.point, lanes, |contact, tie, near| {
                // The search ray runs along the surface normal through the start point, so that the
                // result does not depend on the angle at which the path leaves.
                let origin = coincident.axis.mul_add(-tie, coincident.point);
                let limit = L::select(near, tie + tie, L::from_f64(-1.0));
                let ray = Ray { origin, direction: coincident.axis };
                let hit = geometry.closest_to(contact.primitive, &ray, limit);
                for (other, other_lanes) in distinct(hit.primitive, near & hit.t.lt(limit)) {
                    let normal = geometry.surface(other, hit.triangle, coincident.point).normal;
                    let cosine = normal.dot(coincident.axis);
                    let leaves = cosine.gt(L::zero());
                    let mut parallel = other_lanes & cosine.abs().gt(L::from_f64(MIN_COSINE));
                    if let (SurfaceKind::Transparent(priority), _) = &self.kinds[other as usize] {
                        // A path leaves only solids that it is inside of, and enters only solids
                        // that it is outside of.
                        let within = media.contains(L::from_f64(f64::from(*priority)));
                        parallel = parallel & ((within & leaves) | (!within & !leaves));
                    }
                    let layer = self.layer(other, leaves, coincident.layer);
                    out.touching = out.touching | parallel;
                    out.offset = L::select(
                        parallel,
                        out.offset.max(tie * L::from_f64(OFFSET_TIES)),
                        out.offset,
                    );
                    let nearer = parallel & layer.gt(coincident.layer) & layer.lt(out.layer);
                    out.lanes = out.lanes | nearer;
                    out.primitive = L::select(nearer, L::from_id(other), out.primitive);
                    out.triangle = L::select(nearer, hit.triangle, out.triangle);
                    out.layer = L::select(nearer, layer, out.layer);
                }
            });
        }
        out
    }
}

/// Returns the lowest and the highest corner of an object's bounding box, with infinite coordinates
/// if the object is unbounded. Planes perpendicular to an axis are bounded along that axis.
fn unbounded_box(form: &Form) -> Bounds {
    form.bounds().unwrap_or_else(|| {
        let Some(plane) = form.plane() else { return UNBOUNDED };
        let is_normal = |axis: &&DVec3| plane.normal.dot(**axis).abs() == 1.0;
        let Some(axis) = DVec3::AXES.iter().find(is_normal) else { return UNBOUNDED };
        let point = plane.normal * plane.offset;
        let bounded = |infinite| DVec3::select(axis.cmpne(DVec3::ZERO), point, infinite);
        (bounded(UNBOUNDED.0), bounded(UNBOUNDED.1))
    })
}

/// Returns the id of the first primitive of each form.
pub(crate) fn first_primitives(forms: &[Form], primitives: &[PrimitiveId]) -> Vec<u32> {
    let mut first = vec![0; forms.len()];
    for (primitive, source) in (0..).zip(primitives).filter(|(_, source)| source.part == 0) {
        first[source.form] = primitive;
    }
    first
}

/// Returns the bounding box of an object, enlarged by 1e-5 of its largest coordinate.
fn padded_box(form: &Form) -> Bounds {
    form.bounds().map_or(UNBOUNDED, |(low, high)| {
        let margin = 1e-5 * low.abs().max(high.abs()).max_element();
        (low - margin, high + margin)
    })
}

/// Returns the indices of all pairs of objects for which `wanted` is true and whose padded bounding
/// boxes overlap. The smaller index of a pair
/// comes first, and the pairs are sorted.
pub(crate) fn pairs(forms: &[Form], wanted: impl Fn(usize, usize) -> bool) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    let boxes: Vec<_> = forms.iter().map(padded_box).collect();
    let order = ascending(boxes.iter().map(|(low, _)| total_order(low.x)).collect());
    for (i, a) in order.iter().enumerate() {
        let (low, high) = boxes[*a];
        for b in order[i + 1..].iter().take_while(|b| boxes[**b].0.x <= high.x) {
            let disjoint = boxes[*b].0.cmpgt(high).any() || boxes[*b].1.cmplt(low).any();
            if !disjoint && wanted(*a, *b) {
                out.push((*a.min(b), *a.max(b)));
            }
        }
    }
    // Sorted by index, so that the order does not depend on positions.
    out.sort_unstable();
    out
}

/// Returns the indices of all pairs of objects for which `wanted` is true and whose surfaces may
/// come within `slack` of each other.
pub(crate) fn touching_pairs(
    forms: &[Form],
    wanted: impl Fn(usize, usize) -> bool,
    slack: f64,
) -> impl Iterator<Item = (usize, usize)> {
    pairs(forms, wanted).into_iter().filter(move |(a, b)| may_touch(&forms[*a], &forms[*b], slack))
}

/// Returns `true` if the surfaces of two objects may come within `slack` of each other.
fn may_touch(a: &Form, b: &Form, slack: f64) -> bool {
    let normal = |form: &Form| form.plane().map(|plane| plane.normal);
    let separated = |axis: DVec3| match (a.extent_along(axis), b.extent_along(axis)) {
        (Some(a), Some(b)) => a.0 > b.1 + slack || b.0 > a.1 + slack,
        _ => false,
    };
    if DVec3::AXES.into_iter().chain(normal(a)).chain(normal(b)).any(separated) {
        return false;
    }
    if let (
        Form::Sphere(SphereForm { center, radius }),
        Form::Sphere(SphereForm { center: other, radius: size }),
    ) = (a, b)
    {
        let distance = center.distance(*other);
        // Two spheres can touch side by side, or one inside the other.
        return distance <= radius + size + slack && distance + slack >= (radius - size).abs();
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::primitive::PlaneForm;
    use zerkalo_scene::shape::Shape;

    #[test]
    fn contacts_are_pairs_of_touching_forms() {
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
    /// Checks that an object that touches many others has no list of them, and that the same ones
    /// are found near a point.
    #[test]
    fn crowded_objects_have_no_lists() {
        let ball = |i: usize| {
            let center = DVec3::new((i * 37 % 100) as f64, (i * 61 % 100) as f64, 0.0) * 0.01;
            Form::Sphere(SphereForm { center, radius: 1.0 })
        };
        let forms: Vec<Form> = (0..200).map(ball).collect();
        let primitives: Vec<_> = (0..200).map(|form| PrimitiveId { form, part: 0 }).collect();
        let transparent: Vec<bool> = (0..200).map(|i| i % 2 == 0).collect();
        let priorities: Vec<u32> = (0..200).map(|i| if i % 2 == 0 { i + 1 } else { 0 }).collect();
        let contacts =
            Contacts::<f64>::new(&forms, &primitives, &transparent, &priorities, 1e-16, 0.0);
        let contacts = contacts.unwrap();
        assert!(contacts.touching.iter().all(Option::is_none));
        let mut count = 0;
        for a in 0..200 {
            let [x, y, z] = (forms[a].bounds().unwrap().1 - DVec3::new(1.0, 1.0, 0.0)).to_array();
            let mut found = Vec::new();
            contacts.visit_near(a as u32, Vec3::new(x, y, z), true, |contact, _, _| {
                found.push(contact.primitive);
            });
            let near = |b: &u32| {
                let (low, high) = forms[*b as usize].bounds().unwrap();
                let point = DVec3::new(x, y, z);
                point.cmpge(low - 1e-13).all() && point.cmple(high + 1e-13).all()
            };
            let wanted =
                |b: &u32| *b != a as u32 && (a.is_multiple_of(2) || b.is_multiple_of(2)) && near(b);
            assert_eq!(found, (0..200).filter(wanted).collect::<Vec<_>>());
            count += found.len();
        }
        assert!(count > 1000, "{count}");
    }
}
