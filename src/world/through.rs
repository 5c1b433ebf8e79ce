//! The paths of worlds with surfaces that let light through: trees of reflected and transmitted rays.

use super::compile::World;
use super::contact::{Contacts, Layer, Seam};
use super::media::{Crossing, Inside, Media};
use super::outlook::Outlook;
use super::path::{Counts, Met, Path, Radiance};
use crate::lanes::{Lanes, Mask, V3};
use crate::material::{Interface, Spread};
use crate::sampling::Draws;
use crate::shape::{Hit, Ray};

/// At so many surfaces, counted from the eye, a path follows both the reflected and the transmitted ray;
/// from then on one of them, by chance.
const BOTH: usize = 2;

/// A packet of paths on their way.
#[derive(Clone, Copy)]
struct Arm<L: Lanes> {
    path: Path<L>,
    lanes: L::Mask,
    /// What the rays are inside.
    inside: Inside<L>,
    /// Surfaces met before.
    bounce: u32,
    /// Where the rays begin on surfaces that lie on others; `None`: nowhere.
    seam: Option<Seam<L>>,
}

/// Arms that wait until those that left the same surfaces are done.
struct Waiting<L: Lanes> {
    arms: [Option<Arm<L>>; BOTH],
}

impl<L: Lanes> Waiting<L> {
    /// `arm` left a surface that is no farther from the eye than `BOTH`, and every arm left another.
    fn push(&mut self, arm: Arm<L>) {
        self.arms[arm.bounce as usize - 1] = Some(arm);
    }

    /// The one that left the surface farthest from the eye.
    fn pop(&mut self) -> Option<Arm<L>> {
        self.arms.iter_mut().rev().find_map(Option::take)
    }
}

/// Two ways to go on from a surface.
struct Ways<L> {
    /// Direction of the reflected rays.
    mirrored: V3<L>,
    /// What they count.
    mirrored_weight: V3<L>,
    /// Direction of the transmitted rays.
    passed: V3<L>,
    /// What they count.
    passed_weight: V3<L>,
}

impl<L: Lanes> World<L> {
    /// [`World::trace`] for a world with `media`. In every lane what a surface transmits is traced
    /// before what it reflects, whatever the other lanes do.
    #[inline(never)]
    pub(super) fn trace_through(
        &self,
        media: &Media<L>,
        ray: Ray<L>,
        outlook: &Outlook,
        draws: &Draws<'_, L>,
        lanes: L::Mask,
        out: &mut Radiance<L>,
    ) -> Counts {
        let mut counts = Counts::default();
        let inside = media.at_start(&ray);
        let path = Path { ray, weight: V3::of([1.0; 3]) };
        let mut waiting = Waiting { arms: [None; BOTH] };
        let mut arm = Arm { path, lanes, inside, bounce: 0, seam: None };
        loop {
            let outlook = if arm.bounce == 0 { outlook } else { &self.panorama };
            if !self.follow(media, &mut arm, outlook, draws, &mut waiting, out, &mut counts) {
                match waiting.pop() {
                    Some(next) => arm = next,
                    None => return counts,
                }
            }
        }
    }

    /// Follows `arm` to the surfaces where it ends and turns it into what goes on from there; false: nothing
    /// does.
    #[allow(clippy::too_many_arguments, reason = "what a path's step reads and what it writes")]
    fn follow(
        &self,
        media: &Media<L>,
        arm: &mut Arm<L>,
        outlook: &Outlook,
        draws: &Draws<'_, L>,
        waiting: &mut Waiting<L>,
        out: &mut Radiance<L>,
        counts: &mut Counts,
    ) -> bool {
        let Arm { mut path, inside, bounce, .. } = *arm;
        counts.rays += u64::from(arm.lanes.bits().count_ones());
        let mut hit = self.geometry.closest_of(&path.ray, &outlook.seen, arm.lanes);
        let mut behind = None;
        if let (Some(contacts), Some(seam)) = (&media.contacts, &arm.seam)
            && (seam.lanes & arm.lanes).any()
        {
            let seam = Seam { lanes: seam.lanes & arm.lanes, ..*seam };
            let next = contacts.next(&self.geometry, &seam, &inside);
            let origin = V3::select(next.lanes, seam.point, path.ray.origin);
            path.ray.origin = origin;
            hit.take_in(next.lanes, L::zero(), (next.item, next.facet));
            behind = Some(next);
        }
        let ended = hit.t.lt(L::of(L::MAX));
        if let Some(group) = self.background {
            out.groups[group] += path.weight.only(arm.lanes.and_not(ended));
        }
        let lanes = arm.lanes & ended;
        let Some(mut met) = self.meet::<false>(&path.ray, &hit, lanes) else { return false };
        let mut seam = None;
        if let Some(contacts) = &media.contacts {
            let among = behind.as_ref().map_or(L::mask(false), |next| next.lanes);
            let fresh = contacts.near(met.item, met.point, lanes.and_not(among));
            if behind.is_some() || fresh.any() {
                let (behind, ended) = (behind.as_ref(), (lanes, fresh));
                seam = self.seam(contacts, &path, (&mut hit, &mut met), ended, behind, &inside);
            }
        }
        let crossing = self.crossing(media, &met, lanes, &inside);
        if let Some(crossing) = &crossing {
            met.leave_out(crossing.hidden);
        }
        self.light::<false>(&path, &met, outlook, out, counts);
        if bounce == self.depth {
            return false;
        }
        let bounce = bounce + 1;
        let Some(crossing) = crossing else {
            arm.lanes = self.bounce::<false>(&mut arm.path, &met, draws, bounce - 1, counts);
            arm.bounce = bounce;
            arm.seam = seam.as_ref().map(Seam::reversed);
            return arm.lanes.any();
        };
        let ways = self.ways(&path, &met, &crossing, draws, bounce - 1, counts);
        let worth = |weight: V3<L>| {
            let strongest = weight.max_element();
            strongest.gt(L::zero()) & strongest.ge(L::of(self.min_weight))
        };
        let mirrors = (met.reflecting | crossing.lanes) & worth(ways.mirrored_weight);
        let passes = crossing.lanes & worth(ways.passed_weight);
        let both = mirrors & passes;
        let mirrored = Arm {
            path: Path {
                ray: Ray { origin: met.start(), direction: ways.mirrored },
                weight: ways.mirrored_weight,
            },
            lanes: both,
            inside: Inside::select(crossing.lanes, &crossing.before, &inside),
            bounce,
            seam: seam.as_ref().map(Seam::reversed),
        };
        // Lanes that go through, and what their paths and those of the others count.
        let (mut through, mut mirrored_weight, mut passed_weight) =
            (passes, ways.mirrored_weight, ways.passed_weight);
        if both.any() {
            if bounce as usize <= BOTH {
                waiting.push(mirrored);
            } else {
                counts.glossy = true;
                let (r, t) = (mirrored_weight.max_element(), passed_weight.max_element());
                let back = both & (draws.choice(bounce - 1 - BOTH as u32) * (r + t)).lt(r);
                through = through.and_not(back);
                let scaled = |v: V3<L>, k: L| V3::select(both, v * ((r + t) / k), v);
                mirrored_weight = scaled(mirrored_weight, r);
                passed_weight = scaled(passed_weight, t);
            }
        }
        let lanes = mirrors | passes;
        let path = Path {
            ray: Ray {
                origin: V3::select(through, met.beyond(), met.start()),
                direction: V3::select(through, ways.passed, ways.mirrored),
            },
            weight: V3::select(through, passed_weight, mirrored_weight),
        };
        let inside = Inside::select(through, &crossing.behind, &mirrored.inside);
        let seam = seam.map(|seam| Seam::select(through, &seam, &seam.reversed()));
        *arm = Arm { path, lanes, inside, bounce, seam };
        lanes.any()
    }

    /// Where the rays of `lanes` ended on surfaces that lie on others, on which side they go on when they
    /// pass; `None`: nowhere. Of such surfaces it puts those into `hit` and `met` that come first; `behind`:
    /// those that were found behind the ones that the rays left; `fresh`: lanes where others may be.
    #[inline(never)]
    fn seam(
        &self,
        contacts: &Contacts<L::Scalar>,
        path: &Path<L>,
        (hit, met): (&mut Hit<L>, &mut Met<L>),
        (lanes, fresh): (L::Mask, L::Mask),
        behind: Option<&Layer<L>>,
        inside: &Inside<L>,
    ) -> Option<Seam<L>> {
        let (mut layer, mut lift, mut among) = (L::zero(), met.lift, L::mask(false));
        if let Some(next) = behind {
            // Light that comes from the side of the rays is blocked by what they left.
            if self.shadows {
                met.shade(next.lanes);
            }
            (layer, among) = (next.layer, next.lanes);
            lift = lift.max(next.lift.only(among));
        }
        if fresh.any() {
            let (item, point, axis) = (met.item, met.point, -met.geometric);
            let seam = Seam { lanes: fresh, item, point, axis, layer: L::zero() };
            let first = contacts.first(&self.geometry, &seam, !met.front, inside);
            if first.lanes.any() {
                hit.take_in(first.lanes, hit.t, (first.item, first.facet));
                if let Some(other) = self.meet::<false>(&path.ray, hit, lanes) {
                    *met = other;
                    lift = lift.max(met.lift);
                    if let (Some(next), true) = (behind, self.shadows) {
                        met.shade(next.lanes);
                    }
                }
            }
            layer = L::select(first.touching, first.layer, layer);
            among = among | first.touching;
            lift = lift.max(first.lift.only(first.touching));
        }
        met.lift = L::select(among, lift, met.lift);
        let seam =
            Seam { lanes: among, item: met.item, point: met.point, axis: -met.geometric, layer };
        among.any().then_some(seam)
    }

    /// Where the rays of `lanes` meet surfaces that let light through; `None`: none of them does.
    fn crossing(
        &self,
        media: &Media<L>,
        met: &Met<L>,
        lanes: L::Mask,
        inside: &Inside<L>,
    ) -> Option<Crossing<L>> {
        let mut through = L::mask(false);
        let mut index = L::one();
        for (finish, here) in met.finishes(lanes) {
            if let Some(transmission) = &self.finishes[finish].transmission {
                through = through | here;
                index = L::select(here, L::splat(transmission.index), index);
            }
        }
        through.any().then(|| media.cross(met, through, inside, index))
    }

    /// How paths go on from the surfaces that they meet, of which some let light through.
    fn ways(
        &self,
        path: &Path<L>,
        met: &Met<L>,
        crossing: &Crossing<L>,
        draws: &Draws<'_, L>,
        bounce: u32,
        counts: &mut Counts,
    ) -> Ways<L> {
        let incident = path.ray.direction;
        let interface = Interface::new(incident, met.normal, crossing.n_i, crossing.n_t);
        let straight = crossing.pane | crossing.hidden;
        let mut ways = Ways {
            mirrored: incident.reflect(met.normal),
            mirrored_weight: V3::zero(),
            passed: V3::select(straight, incident, interface.refracted),
            passed_weight: V3::zero(),
        };
        let mut numbers = None;
        for (finish, lanes) in met.finishes(met.reflecting | crossing.lanes) {
            let finish = &self.finishes[finish];
            let mut own = L::one();
            if let Some(transmission) = &finish.transmission {
                let mut split = interface.split(transmission, crossing.outer);
                if crossing.pane.any() {
                    let pane = interface.split_by_pane(transmission);
                    let choose = |a, b| L::select(crossing.pane, a, b);
                    split.reflected = choose(pane.reflected, split.reflected);
                    split.transmitted = choose(pane.transmitted, split.transmitted);
                    split.total = choose(pane.total, split.total);
                }
                own = split.reflected.only(!crossing.hidden);
                let passed = L::select(crossing.hidden, L::one(), split.transmitted);
                ways.passed_weight = V3::select(lanes, path.weight * passed, ways.passed_weight);
                let total = path.weight * split.total.only(!crossing.hidden);
                ways.mirrored_weight = V3::select(lanes, total, ways.mirrored_weight);
            }
            let Some((strength, spread)) = &finish.reflection else { continue };
            // Not on backs without a finish.
            let lanes = lanes & met.reflecting & own.gt(L::zero());
            if lanes.none() {
                continue;
            }
            let uv = if matches!(spread, Spread::Mirror) {
                (L::zero(), L::zero())
            } else {
                counts.glossy = true;
                *numbers.get_or_insert_with(|| draws.lobe(bounce))
            };
            let r = finish.reflect(*strength, spread, incident, met.normal, uv, self.fold);
            let weight = path.weight.times(r.weight) * own;
            ways.mirrored = V3::select(lanes, r.direction, ways.mirrored);
            ways.mirrored_weight = V3::select(lanes, weight, ways.mirrored_weight);
        }
        if self.smooth {
            ways.mirrored = met.outward(ways.mirrored);
            // What would stay before the surface goes as steeply behind it.
            ways.passed = -met.outward(-ways.passed);
        }
        ways.mirrored_weight = Path::bounded(ways.mirrored_weight);
        ways.passed_weight = Path::bounded(ways.passed_weight);
        ways
    }
}
