//! The paths of worlds with surfaces that let light through: trees of reflected and transmitted rays.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::material::{Interface, ReflectionLobe};
use crate::sampling::PacketSampler;
use crate::world::compile::World;
use crate::world::culling::tile::TileCandidates;
use crate::world::integrator::coincident_surfaces::{CoincidentQuery, CoincidentState, Contacts};
use crate::world::integrator::nested_dielectrics::{InterfaceHit, MediumStack, NestedDielectrics};
use crate::world::integrator::opaque::{Counts, Path, Radiance, SurfaceInteraction};

/// At so many surfaces, counted from the eye, a path follows both the reflected and the transmitted ray;
/// from then on one of them, by chance.
const SPLIT_DEPTH: usize = 2;

/// A packet of paths on their way.
#[derive(Clone, Copy)]
struct Branch<L: SimdFloat> {
    path: Path<L>,
    lanes: L::Mask,
    /// What the rays are inside.
    inside: MediumStack<L>,
    /// Surfaces met before.
    bounce: u32,
    /// Where the rays begin on surfaces that lie on others; `None`: nowhere.
    coincident: Option<CoincidentState<L>>,
}

/// Arms that wait until those that left the same surfaces are done.
struct BranchStack<L: SimdFloat> {
    branches: [Option<Branch<L>>; SPLIT_DEPTH],
}

impl<L: SimdFloat> BranchStack<L> {
    /// `branch` left a surface that is no farther from the eye than `SPLIT_DEPTH`, and every arm left another.
    fn push(&mut self, branch: Branch<L>) {
        self.branches[branch.bounce as usize - 1] = Some(branch);
    }

    /// The one that left the surface farthest from the eye.
    fn pop(&mut self) -> Option<Branch<L>> {
        self.branches.iter_mut().rev().find_map(Option::take)
    }
}

/// Two ways to go on from a surface.
struct SplitDirections<L> {
    /// Direction of the reflected rays.
    reflected: Vec3<L>,
    /// What they count.
    reflected_weight: Vec3<L>,
    /// Direction of the transmitted rays.
    transmitted: Vec3<L>,
    /// What they count.
    transmitted_weight: Vec3<L>,
}

impl<L: SimdFloat> World<L> {
    /// [`World::trace`] for a world with `nested_dielectrics`. In every lane what a surface transmits is traced
    /// before what it reflects, whatever the other lanes do.
    #[inline(never)]
    pub(crate) fn trace_transmissive(
        &self,
        nested_dielectrics: &NestedDielectrics<L>,
        ray: Ray<L>,
        candidates: &TileCandidates,
        draws: &PacketSampler<'_, L>,
        lanes: L::Mask,
        out: &mut Radiance<L>,
    ) -> Counts {
        let mut counts = Counts::default();
        let inside = nested_dielectrics.at_start(&ray);
        let path = Path { ray, throughput: Vec3::of([1.0; 3]) };
        let mut waiting = BranchStack { branches: [None; SPLIT_DEPTH] };
        let mut branch = Branch { path, lanes, inside, bounce: 0, coincident: None };
        loop {
            let candidates = if branch.bounce == 0 { candidates } else { &self.all_candidates };
            if !self.advance(
                nested_dielectrics,
                &mut branch,
                candidates,
                draws,
                &mut waiting,
                out,
                &mut counts,
            ) {
                match waiting.pop() {
                    Some(next) => branch = next,
                    None => return counts,
                }
            }
        }
    }

    /// Follows `branch` to the surfaces where it ends and turns it into what goes on from there; false: nothing
    /// does.
    #[allow(clippy::too_many_arguments, reason = "what a path's step reads and what it writes")]
    fn advance(
        &self,
        nested_dielectrics: &NestedDielectrics<L>,
        branch: &mut Branch<L>,
        candidates: &TileCandidates,
        draws: &PacketSampler<'_, L>,
        waiting: &mut BranchStack<L>,
        out: &mut Radiance<L>,
        counts: &mut Counts,
    ) -> bool {
        let Branch { mut path, inside, bounce, .. } = *branch;
        counts.rays += u64::from(branch.lanes.bits().count_ones());
        let mut hit = self.geometry.closest_masked(&path.ray, &candidates.primary, branch.lanes);
        let mut behind = None;
        if let (Some(contacts), Some(coincident)) =
            (&nested_dielectrics.contacts, &branch.coincident)
            && (coincident.lanes & branch.lanes).any()
        {
            let coincident =
                CoincidentState { lanes: coincident.lanes & branch.lanes, ..*coincident };
            let next = contacts.next(&self.geometry, &coincident, &inside);
            let origin = Vec3::select(next.lanes, coincident.point, path.ray.origin);
            path.ray.origin = origin;
            hit.take_in(next.lanes, L::zero(), (next.item, next.facet));
            behind = Some(next);
        }
        let ended = hit.t.lt(L::from_f64(L::MAX));
        if let Some(group) = self.background {
            out.groups[group] += path.throughput.masked(branch.lanes.and_not(ended));
        }
        let lanes = branch.lanes & ended;
        let Some(mut met) = self.interact::<false>(&path.ray, &hit, lanes) else { return false };
        let mut coincident = None;
        if let Some(contacts) = &nested_dielectrics.contacts {
            let among = behind.as_ref().map_or(L::mask(false), |next| next.lanes);
            let fresh = contacts.near(met.item, met.point, lanes.and_not(among));
            if behind.is_some() || fresh.any() {
                let (behind, ended) = (behind.as_ref(), (lanes, fresh));
                coincident =
                    self.coincident(contacts, &path, (&mut hit, &mut met), ended, behind, &inside);
            }
        }
        let interface_hit = self.interface_hit(nested_dielectrics, &met, lanes, &inside);
        if let Some(interface_hit) = &interface_hit {
            met.mask_out(interface_hit.suppressed);
        }
        self.direct_lighting::<false>(&path, &met, candidates, out, counts);
        if bounce == self.depth {
            return false;
        }
        let bounce = bounce + 1;
        let Some(interface_hit) = interface_hit else {
            branch.lanes =
                self.sample_reflection::<false>(&mut branch.path, &met, draws, bounce - 1, counts);
            branch.bounce = bounce;
            branch.coincident = coincident.as_ref().map(CoincidentState::reversed);
            return branch.lanes.any();
        };
        let split_directions =
            self.split_directions(&path, &met, &interface_hit, draws, bounce - 1, counts);
        let worth = |weight: Vec3<L>| {
            let strongest = weight.max_element();
            strongest.gt(L::zero()) & strongest.ge(L::from_f64(self.min_weight))
        };
        let mirrors =
            (met.reflecting | interface_hit.lanes) & worth(split_directions.reflected_weight);
        let passes = interface_hit.lanes & worth(split_directions.transmitted_weight);
        let both = mirrors & passes;
        let reflected = Branch {
            path: Path {
                ray: Ray { origin: met.ray_origin(), direction: split_directions.reflected },
                throughput: split_directions.reflected_weight,
            },
            lanes: both,
            inside: MediumStack::select(
                interface_hit.lanes,
                &interface_hit.medium_reflected,
                &inside,
            ),
            bounce,
            coincident: coincident.as_ref().map(CoincidentState::reversed),
        };
        // Lanes that go through, and what their paths and those of the others count.
        let (mut through, mut reflected_weight, mut transmitted_weight) =
            (passes, split_directions.reflected_weight, split_directions.transmitted_weight);
        if both.any() {
            if bounce as usize <= SPLIT_DEPTH {
                waiting.push(reflected);
            } else {
                counts.glossy = true;
                let (r, t) = (reflected_weight.max_element(), transmitted_weight.max_element());
                let back =
                    both & (draws.branch_1d(bounce - 1 - SPLIT_DEPTH as u32) * (r + t)).lt(r);
                through = through.and_not(back);
                let scaled = |v: Vec3<L>, k: L| Vec3::select(both, v * ((r + t) / k), v);
                reflected_weight = scaled(reflected_weight, r);
                transmitted_weight = scaled(transmitted_weight, t);
            }
        }
        let lanes = mirrors | passes;
        let path = Path {
            ray: Ray {
                origin: Vec3::select(through, met.ray_origin_behind(), met.ray_origin()),
                direction: Vec3::select(
                    through,
                    split_directions.transmitted,
                    split_directions.reflected,
                ),
            },
            throughput: Vec3::select(through, transmitted_weight, reflected_weight),
        };
        let inside =
            MediumStack::select(through, &interface_hit.medium_transmitted, &reflected.inside);
        let coincident = coincident.map(|coincident| {
            CoincidentState::select(through, &coincident, &coincident.reversed())
        });
        *branch = Branch { path, lanes, inside, bounce, coincident };
        lanes.any()
    }

    /// Where the rays of `lanes` ended on surfaces that lie on others, on which side they go on when they
    /// pass; `None`: nowhere. Of such surfaces it puts those into `hit` and `met` that come first; `behind`:
    /// those that were found behind the ones that the rays left; `fresh`: lanes where others may be.
    #[inline(never)]
    fn coincident(
        &self,
        contacts: &Contacts<L::Scalar>,
        path: &Path<L>,
        (hit, met): (&mut Hit<L>, &mut SurfaceInteraction<L>),
        (lanes, fresh): (L::Mask, L::Mask),
        behind: Option<&CoincidentQuery<L>>,
        inside: &MediumStack<L>,
    ) -> Option<CoincidentState<L>> {
        let (mut layer, mut lift, mut among) = (L::zero(), met.offset, L::mask(false));
        if let Some(next) = behind {
            // Light that comes from the side of the rays is blocked by what they left.
            if self.shadows {
                met.shade(next.lanes);
            }
            (layer, among) = (next.layer, next.lanes);
            lift = lift.max(next.lift.masked(among));
        }
        if fresh.any() {
            let (item, point, axis) = (met.item, met.point, -met.geometric);
            let coincident = CoincidentState { lanes: fresh, item, point, axis, layer: L::zero() };
            let first = contacts.first(&self.geometry, &coincident, !met.front, inside);
            if first.lanes.any() {
                hit.take_in(first.lanes, hit.t, (first.item, first.facet));
                if let Some(other) = self.interact::<false>(&path.ray, hit, lanes) {
                    *met = other;
                    lift = lift.max(met.offset);
                    if let (Some(next), true) = (behind, self.shadows) {
                        met.shade(next.lanes);
                    }
                }
            }
            layer = L::select(first.touching, first.layer, layer);
            among = among | first.touching;
            lift = lift.max(first.lift.masked(first.touching));
        }
        met.offset = L::select(among, lift, met.offset);
        let coincident = CoincidentState {
            lanes: among,
            item: met.item,
            point: met.point,
            axis: -met.geometric,
            layer,
        };
        among.any().then_some(coincident)
    }

    /// Where the rays of `lanes` meet surfaces that let light through; `None`: none of them does.
    fn interface_hit(
        &self,
        nested_dielectrics: &NestedDielectrics<L>,
        met: &SurfaceInteraction<L>,
        lanes: L::Mask,
        inside: &MediumStack<L>,
    ) -> Option<InterfaceHit<L>> {
        let mut through = L::mask(false);
        let mut index = L::one();
        for (finish, here) in met.bsdfs(lanes) {
            if let Some(transmission) = &self.bsdfs[finish].transmission {
                through = through | here;
                index = L::select(here, L::splat(transmission.index), index);
            }
        }
        through.any().then(|| nested_dielectrics.cross(met, through, inside, index))
    }

    /// How paths go on from the surfaces that they meet, of which some let light through.
    fn split_directions(
        &self,
        path: &Path<L>,
        met: &SurfaceInteraction<L>,
        interface_hit: &InterfaceHit<L>,
        draws: &PacketSampler<'_, L>,
        bounce: u32,
        counts: &mut Counts,
    ) -> SplitDirections<L> {
        let incident = path.ray.direction;
        let interface = Interface::new(incident, met.normal, interface_hit.n_i, interface_hit.n_t);
        let straight = interface_hit.thin | interface_hit.suppressed;
        let mut split_directions = SplitDirections {
            reflected: incident.reflect(met.normal),
            reflected_weight: Vec3::zero(),
            transmitted: Vec3::select(straight, incident, interface.refracted),
            transmitted_weight: Vec3::zero(),
        };
        let mut numbers = None;
        for (finish, lanes) in met.bsdfs(met.reflecting | interface_hit.lanes) {
            let finish = &self.bsdfs[finish];
            let mut own = L::one();
            if let Some(transmission) = &finish.transmission {
                let mut split = interface.split(transmission, interface_hit.outer);
                if interface_hit.thin.any() {
                    let pane = interface.split_thin(transmission);
                    let choose = |a, b| L::select(interface_hit.thin, a, b);
                    split.reflected = choose(pane.reflected, split.reflected);
                    split.transmitted = choose(pane.transmitted, split.transmitted);
                    split.tir = choose(pane.tir, split.tir);
                }
                own = split.reflected.masked(!interface_hit.suppressed);
                let transmitted = L::select(interface_hit.suppressed, L::one(), split.transmitted);
                split_directions.transmitted_weight = Vec3::select(
                    lanes,
                    path.throughput * transmitted,
                    split_directions.transmitted_weight,
                );
                let total = path.throughput * split.tir.masked(!interface_hit.suppressed);
                split_directions.reflected_weight =
                    Vec3::select(lanes, total, split_directions.reflected_weight);
            }
            let Some((emission, spread)) = &finish.reflection else { continue };
            // Not on backs without a finish.
            let lanes = lanes & met.reflecting & own.gt(L::zero());
            if lanes.none() {
                continue;
            }
            let uv = if matches!(spread, ReflectionLobe::Mirror) {
                (L::zero(), L::zero())
            } else {
                counts.glossy = true;
                *numbers.get_or_insert_with(|| draws.lobe_2d(bounce))
            };
            let r = finish.sample(*emission, spread, incident, met.normal, uv, self.fold);
            let weight = path.throughput.component_mul(r.weight) * own;
            split_directions.reflected =
                Vec3::select(lanes, r.direction, split_directions.reflected);
            split_directions.reflected_weight =
                Vec3::select(lanes, weight, split_directions.reflected_weight);
        }
        if self.smooth {
            split_directions.reflected = met.into_hemisphere(split_directions.reflected);
            // What would stay before the surface goes as steeply behind it.
            split_directions.transmitted = -met.into_hemisphere(-split_directions.transmitted);
        }
        split_directions.reflected_weight = Path::bounded(split_directions.reflected_weight);
        split_directions.transmitted_weight = Path::bounded(split_directions.transmitted_weight);
        split_directions
    }
}
