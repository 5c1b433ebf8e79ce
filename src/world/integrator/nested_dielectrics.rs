//! Nested dielectrics: the transparent solids that paths are inside of, several of which may hold one point.
//!
//! Where solids overlap, the one that the scene lists last fills the common space; the surfaces of the
//! others are not there. So a bubble is listed after its ball, and water may reach a little into the wall
//! of the glass that is listed after it. Light that leaves the last solid is outside, where the index of
//! refraction is 1.

use crate::bvh::Ray;
use crate::lanes::{Float, Mask, SimdFloat};
use crate::material::Bsdf;
use crate::primitive::{Aggregate, Form, PrimitiveId};
use crate::world::integrator::coincident_surfaces::Contacts;
use crate::world::integrator::opaque::{SurfaceInteraction, next_distinct};
use glam::DVec3;

/// Number of solids around one point that are distinguished; of more, those that are listed last.
const MAX_NESTING: usize = 4;

/// The solids that paths are inside, by rank: 0 is none; of two the one with the higher rank fills the
/// space. From the highest down.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MediumStack<L> {
    priorities: [L; MAX_NESTING],
}

impl<L: SimdFloat> MediumStack<L> {
    /// Outside of everything.
    #[inline(always)]
    pub fn vacuum() -> Self {
        Self { priorities: [L::zero(); MAX_NESTING] }
    }

    /// Rank of the solid that fills the space.
    #[inline(always)]
    fn top(&self) -> L {
        self.priorities[0]
    }

    /// Lanes that are inside of `priority`.
    pub fn contains(&self, priority: L) -> L::Mask {
        self.priorities.iter().fold(L::mask(false), |found, of| found | equal(*of, priority))
    }

    /// Outside of `priority`.
    #[inline(always)]
    fn without(&self, priority: L) -> Self {
        let mut out = *self;
        let mut found = L::mask(false);
        for (i, of) in self.priorities.iter().enumerate() {
            found = found | equal(*of, priority);
            let next = self.priorities.get(i + 1).copied().unwrap_or(L::zero());
            out.priorities[i] = L::select(found, next, *of);
        }
        out
    }

    /// Inside of `priority`, beside what holds already.
    #[inline(always)]
    fn with(&self, priority: L) -> Self {
        let mut out = self.without(priority);
        let mut priority = priority;
        for of in &mut out.priorities {
            let (high, low) = (of.max(priority), of.min(priority));
            (*of, priority) = (high, low);
        }
        out
    }

    /// `yes` where `mask` is true, `no` elsewhere.
    #[inline(always)]
    pub fn select(mask: L::Mask, yes: &Self, no: &Self) -> Self {
        Self {
            priorities: std::array::from_fn(|i| {
                L::select(mask, yes.priorities[i], no.priorities[i])
            }),
        }
    }
}

#[inline(always)]
fn equal<L: SimdFloat>(a: L, b: L) -> L::Mask {
    a.le(b) & b.le(a)
}

/// The transparent solids of a world.
pub(crate) struct NestedDielectrics<L: SimdFloat> {
    /// For each item of the geometry, the rank of the transparent solid that it bounds; 0: it bounds
    /// none.
    priority_of: Vec<u32>,
    /// By rank, the index of refraction; that of rank 0 is 1.
    indices: Vec<L::Scalar>,
    /// The solids that camera rays may begin in, each alone.
    around_eye: Vec<(u32, Aggregate<L>)>,
    /// Surfaces that touch one that lets light through; `None` if there are none.
    pub contacts: Option<Contacts<L::Scalar>>,
}

/// Crossings of rays with surfaces that let light through.
pub(crate) struct InterfaceHit<L: SimdFloat> {
    /// Lanes that do.
    pub lanes: L::Mask,
    /// Those of them that hit a solid's surface from outside.
    pub outer: L::Mask,
    /// Those that meet an open surface, a thin pane.
    pub thin: L::Mask,
    /// Those that meet a surface which is not there, because another solid fills the space.
    pub suppressed: L::Mask,
    /// Index of refraction before the surface.
    pub n_i: L,
    /// Index of refraction behind it; for a pane, of what it is made of.
    pub n_t: L,
    /// Media that reflected rays are inside.
    pub medium_reflected: MediumStack<L>,
    /// Media that transmitted rays are inside.
    pub medium_transmitted: MediumStack<L>,
}

impl<L: SimdFloat> NestedDielectrics<L> {
    /// `finish_of`: for each of the items that `sources` lists, its finish; `None`: nothing lets light
    /// through. `nearest`: how far from the eye the camera's rays begin, at most. `given`: how exactly
    /// coordinates were given.
    pub fn new(
        forms: &[Form],
        sources: &[PrimitiveId],
        finish_of: &[u32],
        finishes: &[Bsdf<L::Scalar>],
        (eye, nearest): (DVec3, f64),
        given: f64,
    ) -> Option<Self> {
        let through = |finish: u32| finishes[finish as usize].transmission;
        if finishes.iter().all(|f| f.transmission.is_none()) {
            return None;
        }
        let mut indices = vec![None; forms.len() + 1];
        let priority_of = sources.iter().zip(finish_of).map(|(source, finish)| {
            let flat = forms[source.form].is_flat();
            let priority = source.form + 1;
            match through(*finish) {
                Some(transmission) if !flat => {
                    // The first part of a compound that lets light through says what is inside.
                    indices[priority].get_or_insert(transmission.index);
                    priority as u32
                }
                _ => 0,
            }
        });
        let priority_of: Vec<u32> = priority_of.collect();
        let transparent: Vec<bool> = finish_of.iter().map(|f| through(*f).is_some()).collect();
        let rounding = (L::EPSILON, given);
        let contacts = Contacts::new(forms, sources, (&transparent, &priority_of), rounding);
        let near = |form: &Form| {
            form.bounds().is_none_or(|(low, high)| eye.clamp(low, high).distance(eye) <= nearest)
        };
        let around = |(form, index): (usize, &Option<_>)| {
            let around = index.is_some() && near(&forms[form]);
            around.then(|| (form as u32 + 1, Aggregate::with_tree(&forms[form..=form], false)))
        };
        let around_eye = indices[1..].iter().enumerate().filter_map(around).collect();
        let indices = indices.into_iter().map(|n| n.unwrap_or(L::Scalar::from_f64(1.0))).collect();
        Some(Self { priority_of, indices, around_eye, contacts })
    }

    /// For each item, whether paths get inside of what it bounds.
    pub fn entered(&self) -> Vec<bool> {
        self.priority_of.iter().map(|priority| *priority > 0).collect()
    }

    /// Media that rays begin inside of: the solids that they hit from inside first.
    pub fn at_start(&self, ray: &Ray<L>) -> MediumStack<L> {
        let mut inside = MediumStack::vacuum();
        for (priority, solid) in &self.around_eye {
            let hit = solid.closest(ray, solid.all());
            let mut left = hit.t.lt(L::from_f64(L::MAX));
            let mut within = L::mask(false);
            while let Some((item, here)) = next_distinct(hit.item, left) {
                let normal = solid.surface(item, hit.triangle, ray.at(hit.t)).normal;
                within = within | (here & normal.dot(ray.direction).gt(L::zero()));
                left = left.and_not(here);
            }
            let entered = inside.with(L::from_f64(f64::from(*priority)));
            inside = MediumStack::select(within, &entered, &inside);
        }
        inside
    }

    /// Index of refraction inside of what the ranks say.
    fn index(&self, priority: L) -> L {
        let of = |priority: L::Scalar| self.indices[priority.to_f64() as usize];
        let first = priority.lane(0);
        if equal(priority, L::splat(first)).all() {
            return L::splat(of(first));
        }
        L::from_fn(|lane| of(priority.lane(lane)))
    }

    /// Crossings of the rays of `lanes`, which are `inside` these media, with surfaces that let light through.
    /// `index_of_pane`: what those are made of that are open.
    pub fn cross(
        &self,
        met: &SurfaceInteraction<L>,
        lanes: L::Mask,
        inside: &MediumStack<L>,
        index_of_pane: L,
    ) -> InterfaceHit<L> {
        let outer = lanes & met.front;
        let mut priority = L::zero();
        let mut left = lanes;
        while let Some((item, here)) = next_distinct(met.item, left) {
            priority =
                L::select(here, L::from_f64(f64::from(self.priority_of[item as usize])), priority);
            left = left.and_not(here);
        }
        let solid = priority.gt(L::zero());
        let (outside, within) = (inside.without(priority), inside.with(priority));
        let pick =
            |yes, no| MediumStack::select(solid, &MediumStack::select(outer, yes, no), inside);
        let (before, behind) = (pick(&outside, &within), pick(&within, &outside));
        let n_i = self.index(before.top());
        InterfaceHit {
            lanes,
            outer,
            thin: lanes.and_not(solid),
            suppressed: lanes & solid & equal(before.top(), behind.top()),
            n_i,
            n_t: L::select(solid, self.index(behind.top()), index_of_pane),
            medium_reflected: before,
            medium_transmitted: behind,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn priorities(inside: &MediumStack<f64>) -> [f64; MAX_NESTING] {
        inside.priorities
    }

    #[test]
    fn the_solid_listed_last_fills_the_space() {
        let mut inside = MediumStack::<f64>::vacuum();
        for priority in [2.0, 5.0, 1.0, 5.0] {
            inside = inside.with(priority);
        }
        assert_eq!(priorities(&inside), [5.0, 2.0, 1.0, 0.0]);
        assert_eq!(priorities(&inside.without(2.0)), [5.0, 1.0, 0.0, 0.0]);
        assert_eq!(priorities(&inside.without(3.0)), priorities(&inside));
        assert_eq!(priorities(&inside.without(5.0).without(1.0).without(2.0)), [0.0; 4]);
        // Of more than can be held those that are listed last.
        let full = inside.with(3.0).with(4.0);
        assert_eq!(priorities(&full), [5.0, 4.0, 3.0, 2.0]);
    }
}
