//! Nested dielectrics with priorities (Schmidt and Budge 2002, *Simple Nested Dielectrics in Ray
//! Traced Images*).
//!
//! Transparent solids may overlap. The solid that comes last in the scene file has the highest
//! priority: it fills the common space, in which rays ignore the boundaries of the other solids. A
//! bubble therefore comes after the glass ball that contains it. Water may overlap the wall of a
//! glass that comes after the water. Outside all solids the index of refraction is 1.

use crate::compile::RecenteredGeometry;
use crate::integrator::coincident_surfaces::Contacts;
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::transmission::{ROUGH_SPLIT_DEPTH, SPLIT_DEPTH};
use crate::integrator::vertex::Vertex;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, Mask, SimdFloat, Vec3, array_from_fn, distinct};
use zerkalo_kernel::primitive::{Aggregate, BoundingSphere, Form, PrimitiveId, box_distance};
use zerkalo_scene::material::{Bsdf, InterfaceMedia, InterfaceQuery, Transmission};

/// Largest number of solids that a medium stack holds. If a ray is inside more solids, the stack
/// has those listed last in the scene file.
const MAX_NESTING: usize = 4;

/// Medium stack: priorities of the solids that each ray is inside of, in descending order. Priority
/// 0 is vacuum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumStack<L> {
    priorities: [L; MAX_NESTING],
}

impl<L: SimdFloat> MediumStack<L> {
    /// Returns the stack of rays outside all solids.
    #[inline(always)]
    pub fn vacuum() -> Self {
        Self { priorities: [L::zero(); MAX_NESTING] }
    }

    /// Returns the priority of the solid that fills the space.
    #[inline(always)]
    fn top(&self) -> L {
        self.priorities[0]
    }

    /// Returns the lanes whose ray is inside the solid with `priority`.
    pub fn contains(&self, priority: L) -> L::Mask {
        self.priorities.iter().fold(L::mask(false), |found, entry| found | equal(*entry, priority))
    }

    /// Returns the stack without the solid with `priority`.
    #[inline(always)]
    fn without(&self, priority: L) -> Self {
        let mut out = *self;
        let mut found = L::mask(false);
        for (i, entry) in self.priorities.iter().enumerate() {
            found = found | equal(*entry, priority);
            let next = self.priorities.get(i + 1).copied().unwrap_or(L::zero());
            out.priorities[i] = L::select(found, next, *entry);
        }
        out
    }

    /// Returns the stack with the solid with `priority`.
    #[inline(always)]
    fn with(&self, priority: L) -> Self {
        let mut out = self.without(priority);
        let mut priority = priority;
        for entry in &mut out.priorities {
            let (high, low) = (entry.max(priority), entry.min(priority));
            (*entry, priority) = (high, low);
        }
        out
    }

    /// Adds `priority` to the stack in lanes whose ray first hits the boundary of `solid` from
    /// inside.
    #[inline(never)]
    fn add_if_inside(&mut self, ray: &Ray<L>, priority: u32, solid: &Aggregate<L>) {
        let hit = solid.closest(ray, solid.all());
        let mut inside = L::mask(false);
        for (primitive, lanes) in distinct(hit.primitive, hit.t.lt(L::from_f64(L::MAX))) {
            let normal = solid.surface(primitive, hit.triangle, ray.at(hit.t)).normal;
            inside = inside | (lanes & normal.dot(ray.direction).gt(L::zero()));
        }
        *self = Self::select(inside, &self.with(L::from_f64(f64::from(priority))), self);
    }

    /// Returns `yes` in the lanes of `mask` and `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self { priorities: array_from_fn(|i| L::select(mask, yes.priorities[i], no.priorities[i])) }
    }
}

/// Returns the lanes in which `a` and `b` are equal.
#[inline(always)]
pub(crate) fn equal<L: SimdFloat>(a: L, b: L) -> L::Mask {
    a.le(b) & b.le(a)
}

/// Media of a packet of rays, with their properties.
#[derive(Clone, Copy)]
pub(crate) struct Media<'a, L: SimdFloat> {
    pub nested_dielectrics: &'a NestedDielectrics<L>,
    pub stack: &'a MediumStack<L>,
}

impl<L: SimdFloat> Media<'_, L> {
    /// Returns the lanes in which a solid of a higher priority hides the boundary of the transparent
    /// solid that `primitive` bounds; none if it bounds no such solid.
    #[inline(always)]
    pub fn hidden(&self, primitive: u32) -> L::Mask {
        match self.nested_dielectrics.priority_of[primitive as usize] {
            0 => L::mask(false),
            priority => self.stack.top().gt(L::from_f64(f64::from(priority))),
        }
    }
}

/// Returns `true` if the bounding box of `form` overlaps the sphere `ball` or is infinite.
pub(crate) fn may_reach(ball: &BoundingSphere, form: &Form) -> bool {
    let reaches = |bounds| box_distance(bounds, ball.center) <= ball.radius;
    form.bounds().is_none_or(reaches)
}

/// Transmissive surfaces of a scene, and the media that they bound.
pub(crate) struct NestedDielectrics<L: SimdFloat> {
    /// Priority of the transparent solid that each primitive bounds; 0 if it bounds none.
    priority_of: Vec<u32>,
    /// Indices of refraction, by priority.
    indices: Vec<L::Scalar>,
    /// Absorption coefficients [1 / scene unit], by priority. `None` if no solid absorbs light.
    absorption: Option<Vec<[L::Scalar; 3]>>,
    /// `true` for each primitive that is a clear pane: thin, transparent and without roughness.
    /// `None` if there are none.
    pub clear_panes: Option<Vec<bool>>,
    /// Priorities and boundaries of the solids that may contain the origins of camera rays.
    around_eye: Vec<(u32, Aggregate<L>)>,
    /// Primitives that may touch a transmissive primitive; `None` if there are none.
    pub contacts: Option<Contacts<L::Scalar>>,
    /// Number of the first surface, counted from 1, at which paths choose between reflection and
    /// transmission.
    pub first_choice: u32,
}

/// Hits of a packet on transmissive surfaces (interfaces).
pub(crate) struct InterfaceHit<L: SimdFloat> {
    /// Lanes whose ray hits a transmissive surface.
    pub lanes: L::Mask,
    /// Lanes whose ray hits a boundary inside a solid with a higher priority. The ray passes it
    /// unchanged.
    pub suppressed: L::Mask,
    pub media: InterfaceMedia<L>,
    pub medium_reflected: MediumStack<L>,
    pub medium_transmitted: MediumStack<L>,
}

impl<L: SimdFloat> InterfaceHit<L> {
    /// Returns the media of the rays that leave on the side of the incoming rays. `stack` has the
    /// media of the incoming rays.
    #[inline(always)]
    pub fn stack_reflected(&self, stack: &MediumStack<L>) -> MediumStack<L> {
        MediumStack::select(self.lanes, &self.medium_reflected, stack)
    }

    /// Returns the query of BSDFs at the hit points of `vertex`.
    #[inline(always)]
    pub fn query(&self, vertex: &Vertex<'_, L>) -> InterfaceQuery<L> {
        InterfaceQuery {
            rays: vertex.query(),
            media: self.media,
            reflecting: vertex.interaction.reflecting,
        }
    }
}

impl<L: SimdFloat> NestedDielectrics<L> {
    /// Compiles the transmissive surfaces of `primitives`; `None` if no BSDF transmits. `bsdf_of`
    /// has the index of each primitive's BSDF in `bsdfs`. Camera rays start in the sphere `start`.
    pub fn new(
        geometry: &RecenteredGeometry,
        primitives: &[PrimitiveId],
        bsdf_of: &[u32],
        bsdfs: &[Bsdf<L::Scalar>],
        start: &BoundingSphere,
    ) -> Option<Self> {
        let forms = &geometry.forms[..];
        let transmission_of = |bsdf: u32| bsdfs[bsdf as usize].transmission;
        if bsdfs.iter().all(|bsdf| bsdf.transmission.is_none()) {
            return None;
        }
        // Transmission of each solid, by priority. The first transmissive part of a compound
        // determines the index of refraction and the absorption.
        let mut solids = vec![None; forms.len() + 1];
        let priority_of = primitives.iter().zip(bsdf_of).map(|(id, bsdf)| {
            let transmission = transmission_of(*bsdf).filter(|_| forms[id.form].is_solid());
            let priority = transmission.map_or(0, |_| id.form + 1);
            solids[priority] = solids[priority].or(transmission);
            priority as u32
        });
        let priority_of: Vec<u32> = priority_of.collect();
        let transparent: Vec<bool> =
            bsdf_of.iter().map(|bsdf| transmission_of(*bsdf).is_some()).collect();
        let is_clear = |(bsdf, priority): (&u32, &u32)| {
            *priority == 0 && transmission_of(*bsdf).is_some() && bsdfs[*bsdf as usize].is_delta()
        };
        let clear_panes: Vec<bool> = bsdf_of.iter().zip(&priority_of).map(is_clear).collect();
        let clear_panes = clear_panes.contains(&true).then_some(clear_panes);
        let input_error = geometry.input_error();
        let contacts =
            Contacts::new(forms, primitives, &transparent, &priority_of, L::EPSILON, input_error);
        let solid_around_eye = |(form, solid): (usize, &Option<_>)| {
            let may_contain_eye = solid.is_some() && may_reach(start, &forms[form]);
            may_contain_eye
                .then(|| (form as u32 + 1, Aggregate::with_bvh(&forms[form..=form], false)))
        };
        let around_eye = solids[1..].iter().enumerate().filter_map(solid_around_eye).collect();
        let vacuum = L::Scalar::from_f64(1.0);
        let indices =
            solids.iter().map(|solid| solid.map_or(vacuum, |solid| solid.index)).collect();
        let absorption_of = |solid: &Option<Transmission<_>>| {
            solid.map_or([L::Scalar::default(); 3], |solid| solid.absorption)
        };
        let absorption: Vec<_> = solids.iter().map(absorption_of).collect();
        let absorbs = absorption.iter().flatten().any(|c| c.to_f64() > 0.0);
        let absorption = absorbs.then_some(absorption);
        let spreads = |bsdf: &Bsdf<_>| bsdf.transmission.is_some() && !bsdf.is_delta();
        let split_depth =
            if bsdfs.iter().any(spreads) { ROUGH_SPLIT_DEPTH } else { SPLIT_DEPTH as u32 };
        Some(Self {
            priority_of,
            indices,
            absorption,
            clear_panes,
            around_eye,
            contacts,
            first_choice: split_depth + 1,
        })
    }

    /// Returns `true` if `primitive` bounds a solid that paths can be inside of.
    pub fn is_entered(&self, primitive: usize) -> bool {
        self.priority_of[primitive] > 0
    }

    /// Adds to `media` the solids in which camera rays start: the solids whose boundary the ray
    /// first hits from inside.
    #[inline(always)]
    pub fn add_at_start(&self, ray: &Ray<L>, media: &mut MediumStack<L>) {
        for (priority, solid) in &self.around_eye {
            media.add_if_inside(ray, *priority, solid);
        }
    }

    /// Returns the index of refraction of the transparent solid with `priority`.
    fn index(&self, priority: L) -> L {
        let index_of = |priority: L::Scalar| self.indices[priority.to_f64() as usize];
        let first = priority.lane(0);
        if equal(priority, L::splat(first)).all() {
            return L::splat(index_of(first));
        }
        L::from_fn(|lane| index_of(priority.lane(lane)))
    }

    /// Returns the hits of `lanes` on transmissive surfaces; `None` if `lanes` is empty. `media`
    /// are the media of the rays, and `thin_index` is the index of refraction of thin surfaces.
    #[inline(never)]
    pub fn cross(
        &self,
        interaction: &SurfaceInteraction<L>,
        lanes: L::Mask,
        media: &MediumStack<L>,
        thin_index: L,
    ) -> Option<InterfaceHit<L>> {
        if lanes.none() {
            return None;
        }
        let outer = lanes & interaction.front;
        let mut priority = L::zero();
        for (primitive, lanes) in distinct(interaction.primitive, lanes) {
            let of_primitive = L::from_f64(f64::from(self.priority_of[primitive as usize]));
            priority = L::select(lanes, of_primitive, priority);
        }
        let solid = priority.gt(L::zero());
        let (outside, within) = (media.without(priority), media.with(priority));
        let select = |if_outer, if_inner| {
            let of_solid = MediumStack::select(outer, if_outer, if_inner);
            MediumStack::select(solid, &of_solid, media)
        };
        let medium_reflected = select(&outside, &within);
        let medium_transmitted = select(&within, &outside);
        Some(InterfaceHit {
            lanes,
            suppressed: lanes & solid & equal(medium_reflected.top(), medium_transmitted.top()),
            media: InterfaceMedia {
                n_i: self.index(medium_reflected.top()),
                n_t: L::select(solid, self.index(medium_transmitted.top()), thin_index),
                outer,
                thin: lanes.and_not(solid),
            },
            medium_reflected,
            medium_transmitted,
        })
    }
}

/// Returns the part of `radiance` that is left after `distance` [scene units] in `media`, by Beer's
/// law; all of it without media. `distance` may be the largest finite number.
#[inline(always)]
pub(crate) fn attenuated<L: SimdFloat>(
    media: Option<Media<'_, L>>,
    radiance: Vec3<L>,
    distance: L,
) -> Vec3<L> {
    let Some(Media { nested_dielectrics, stack }) = media else { return radiance };
    let Some(absorption) = &nested_dielectrics.absorption else { return radiance };
    radiance.component_mul(transmittance(absorption, stack.top(), distance))
}

/// Returns the fraction of light that is left after `distance` in the solids with `priority`:
/// exp(-coefficient x distance).
#[inline(never)]
fn transmittance<L: SimdFloat>(absorption: &[[L::Scalar; 3]], priority: L, distance: L) -> Vec3<L> {
    let of = |lane| absorption[priority.lane(lane).to_f64() as usize];
    let coefficients = if equal(priority, L::splat(priority.lane(0))).all() {
        Vec3::splat(of(0))
    } else {
        Vec3::from_fn(of)
    };
    let fraction = |c: L| (-(c * distance)).exp();
    Vec3::new(fraction(coefficients.x), fraction(coefficients.y), fraction(coefficients.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn priorities(media: &MediumStack<f64>) -> [f64; MAX_NESTING] {
        media.priorities
    }

    #[test]
    fn medium_stack_is_sorted_and_keeps_solids_listed_last() {
        let mut media = MediumStack::<f64>::vacuum();
        for priority in [2.0, 5.0, 1.0, 5.0] {
            media = media.with(priority);
        }
        assert_eq!(priorities(&media), [5.0, 2.0, 1.0, 0.0]);
        assert_eq!(priorities(&media.without(2.0)), [5.0, 1.0, 0.0, 0.0]);
        assert_eq!(priorities(&media.without(3.0)), priorities(&media));
        assert_eq!(priorities(&media.without(5.0).without(1.0).without(2.0)), [0.0; 4]);
        // With five nested solids the stack holds the four that are listed last.
        let full = media.with(3.0).with(4.0);
        assert_eq!(priorities(&full), [5.0, 4.0, 3.0, 2.0]);
    }
}
