//! The paths: camera rays, the light that surfaces return, reflections.

use super::compile::World;
use super::groups::MAX_GROUPS;
use crate::lanes::{Lanes, MAX_WIDTH, Mask, V3};
use crate::material::{Finish, Spread};
use crate::sampling::Draws;
use crate::shape::{Hit, Ray, Seen};
use std::f64::consts::FRAC_1_PI;

/// The radiance of a packet's samples, per light group, for unit white light.
pub struct Radiance<L> {
    /// The first [`World::groups`] are used.
    pub groups: [V3<L>; MAX_GROUPS],
}

/// What a packet cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Rays of every kind.
    pub rays: u64,
    /// A glossy lobe was met.
    pub glossy: bool,
}

/// The finishes that a packet met.
struct Met<L: Lanes> {
    /// The finish of each lane.
    finish: L,
    /// Lanes that have one.
    lanes: L::Mask,
    /// The finishes that occur.
    list: [u32; MAX_WIDTH],
    len: usize,
}

impl<L: Lanes> Met<L> {
    /// Each finish that occurs with its lanes, never none.
    #[inline(always)]
    fn entries(&self) -> impl Iterator<Item = (u32, L::Mask)> {
        self.list[..self.len].iter().map(|f| (*f, self.lanes & self.finish.has_tag(*f)))
    }
}

/// The surfaces that a packet met.
struct Shaded<L> {
    /// Normal on the viewer's side.
    normal: V3<L>,
    /// Origin of rays that leave on the viewer's side.
    start: V3<L>,
    /// Unit vector to the viewer.
    view: V3<L>,
}

impl<L: Lanes> World<L> {
    /// Traces one packet of camera samples: `origin` and `direction` as [`crate::camera::View`] makes
    /// them. Lanes outside `active` stay black. `seen`: the only items that these rays can meet first,
    /// if that is known.
    #[inline]
    pub fn trace(
        &self,
        (origin, direction): (V3<L>, V3<L>),
        seen: Option<&Seen>,
        draws: &Draws<'_, L>,
        mut active: L::Mask,
        out: &mut Radiance<L>,
    ) -> Counts {
        for group in &mut out.groups[..self.groups()] {
            *group = V3::zero();
        }
        let mut counts = Counts::default();
        let mut ray = Ray { origin, direction };
        let mut weight = V3::of([1.0; 3]);
        let mut bounce = 0;
        loop {
            counts.rays += u64::from(active.bits().count_ones());
            let hit = match seen {
                Some(seen) if bounce == 0 => self.geometry.closest_seen(&ray, seen),
                _ => self.geometry.closest(&ray),
            };
            let met = hit.t.lt(L::of(L::MAX));
            if let Some(group) = self.background {
                out.groups[group] += weight.only(active.and_not(met));
            }
            active = active & met;
            if active.none() {
                return counts;
            }
            let (shaded, finishes) = self.meet(&ray, &hit, active);
            self.light(&shaded, &finishes, weight, out, &mut counts);
            if bounce == self.depth {
                return counts;
            }
            active =
                self.bounce(&shaded, &finishes, draws, bounce, &mut weight, &mut ray, &mut counts);
            if active.none() {
                return counts;
            }
            bounce += 1;
        }
    }

    /// The surfaces where the active rays end, and their finishes; backs of one-sided finishes have
    /// none.
    #[inline(always)]
    fn meet(&self, ray: &Ray<L>, hit: &Hit<L>, active: L::Mask) -> (Shaded<L>, Met<L>) {
        let point = ray.at(hit.t);
        let mut met =
            Met { finish: L::tag(0), lanes: L::mask(false), list: [0; MAX_WIDTH], len: 0 };
        let mut at = Shaded { normal: V3::zero(), start: point, view: -ray.direction };
        let mut left = active;
        loop {
            let bits = left.bits();
            if bits == 0 {
                return (at, met);
            }
            let item = hit.item.tag_lane(bits.trailing_zeros() as usize);
            let here = left & hit.item.has_tag(item);
            left = left.and_not(here);
            let surface = self.geometry.surface(item, point);
            let facing = surface.normal.dot(ray.direction);
            let front = facing.lt(L::zero());
            let normal = V3::select(front, surface.normal, -surface.normal);
            // Start above the surface by a few roundings of the largest number involved.
            let lift = surface.reach.max(surface.point.max_abs()) * L::of(8.0 * L::EPSILON);
            at.normal = V3::select(here, normal, at.normal);
            at.start = V3::select(here, normal.mul_add(lift, surface.point), at.start);
            let finish = self.finish_of[item as usize];
            let here = if self.finishes[finish as usize].two_sided { here } else { here & front };
            if here.none() {
                continue;
            }
            met.finish = L::select(here, L::tag(finish), met.finish);
            met.lanes = met.lanes | here;
            if !met.list[..met.len].contains(&finish) {
                met.list[met.len] = finish;
                met.len += 1;
            }
        }
    }

    /// One value per lane, from the finish of each lane; zero in lanes without one.
    #[inline(always)]
    fn gather(&self, met: &Met<L>, of: impl Fn(&Finish<L::Scalar>) -> [L::Scalar; 3]) -> V3<L> {
        let value = |finish: u32| V3::splat(of(&self.finishes[finish as usize]));
        if met.len == 1 {
            return value(met.list[0]).only(met.lanes);
        }
        met.entries().fold(V3::zero(), |all, (finish, lanes)| V3::select(lanes, value(finish), all))
    }

    /// Adds what the surfaces return of ambient light and of every lamp.
    #[inline(always)]
    fn light(
        &self,
        at: &Shaded<L>,
        met: &Met<L>,
        weight: V3<L>,
        out: &mut Radiance<L>,
        counts: &mut Counts,
    ) {
        if let Some(group) = self.ambient {
            out.groups[group] += weight.times(self.gather(met, |f| f.ambient));
        }
        if self.sources.is_empty() {
            return;
        }
        let mut wanting = L::mask(false);
        for (finish, lanes) in met.entries() {
            if self.finishes[finish as usize].wants_light {
                wanting = wanting | lanes;
            }
        }
        if wanting.none() {
            return;
        }
        let diffuse = self.gather(met, |f| f.diffuse);
        for source in &self.sources {
            let arrival = source.lamp.at(at.start);
            let nl = at.normal.dot(arrival.towards);
            let mut lit = wanting & nl.gt(L::zero());
            if lit.none() {
                continue;
            }
            if self.shadows {
                counts.rays += u64::from(lit.bits().count_ones());
                let ray = Ray { origin: at.start, direction: arrival.towards };
                lit = lit.and_not(self.geometry.blocked(&ray, arrival.distance, lit));
                if lit.none() {
                    continue;
                }
            }
            let mut value = diffuse * (nl * L::of(FRAC_1_PI));
            for (finish, lanes) in met.entries() {
                let finish = &self.finishes[finish as usize];
                if !finish.shines() || (lanes & lit).none() {
                    continue;
                }
                let nv = at.normal.dot(at.view);
                let shine = finish.highlight(at.normal, at.view, arrival.towards, nl, nv);
                value += shine.only(lanes);
            }
            let mut value = weight.times(value) * arrival.irradiance;
            if let Some(strength) = source.weight {
                value = value.times(V3::splat(strength));
            }
            out.groups[source.group] += value.only(lit);
        }
    }

    /// Turns `ray` and `weight` into those of the reflections; returns the lanes that go on.
    #[allow(clippy::too_many_arguments, reason = "the state of a path")]
    #[inline(always)]
    fn bounce(
        &self,
        at: &Shaded<L>,
        met: &Met<L>,
        draws: &Draws<'_, L>,
        bounce: u32,
        weight: &mut V3<L>,
        ray: &mut Ray<L>,
        counts: &mut Counts,
    ) -> L::Mask {
        let mut going = L::mask(false);
        let mut numbers = None;
        let (incident, weight_in) = (ray.direction, *weight);
        for (finish, lanes) in met.entries() {
            let finish = &self.finishes[finish as usize];
            let Some((strength, spread)) = &finish.reflection else { continue };
            let uv = if matches!(spread, Spread::Mirror) {
                (L::zero(), L::zero())
            } else {
                counts.glossy = true;
                *numbers.get_or_insert_with(|| draws.lobe(bounce))
            };
            let r = finish.reflect(*strength, spread, incident, at.normal, uv, self.fold);
            ray.direction = V3::select(lanes, r.direction, ray.direction);
            *weight = V3::select(lanes, weight_in.times(r.weight), *weight);
            going = going | lanes;
        }
        ray.origin = at.start;
        let least = L::of(self.min_weight);
        let strongest = weight.max_element();
        going & strongest.gt(L::zero()) & strongest.ge(least)
    }
}
