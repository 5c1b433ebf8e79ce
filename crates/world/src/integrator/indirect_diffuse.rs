//! Indirect diffuse light: bounces from diffuse surfaces, in generations.
//!
//! A generation is the tree of mirror and glass surfaces that a ray reaches. The first generation
//! starts at the camera, as in a scene without indirect diffuse light. One hit of a generation is
//! chosen for the diffuse bounce, with a probability in proportion to the light that it can pass on
//! (weighted reservoir sampling, Chao 1982, *A General Purpose Unequal Probability Sampling Plan*).
//! The next generation starts at the chosen hit, in a direction whose density is the cosine to the
//! normal, divided by pi, mixed with directions of emitters in mirrors (`lights/mirror_images.rs`).
//! Mirrors therefore have no more noise than without diffuse bounces, and a
//! path bounces at most once per generation. In worlds with many bounces and without transmission,
//! paths go one way at each surface after their first bounce, in full packets (`bounce_queue.rs`).
//!
//! Emitters and environments are sampled at every hit. A ray that starts at a diffuse bounce
//! therefore adds nothing where it reaches an emitter or escapes to an environment.

use crate::integrator::Integrator;
use crate::integrator::bounce_queue::BounceQueue;
use crate::integrator::coincident_surfaces::CoincidentState;
use crate::integrator::nested_dielectrics::{MediumStack, equal};
use crate::integrator::path::{Path, Radiance};
use crate::integrator::transmission::{Branch, TransmissionIntegrator};
use crate::integrator::vertex::Vertex;
use crate::world::World;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Float, Frame, Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::warp::cosine_hemisphere;

/// Density [1/sr] that multiple importance sampling assumes for rays of diffuse bounces: so small
/// that samples of points on emitters get the full weight. Rays of this density do not find
/// environments.
pub(crate) const NO_PDF: f64 = 1e-30;

/// Density [1/sr] of such rays after a reflection at a mirror that throws light. They find no sampled
/// emitters.
pub(crate) const THROWN_PDF: f64 = 1e-29;

/// Limits of indirect diffuse light in a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DiffuseLimits {
    /// Largest number of diffuse bounces of a path, greater than 0.
    pub depth: u32,
    /// `true` if mirrors reflect and glass transmits after a diffuse bounce.
    pub caustics: bool,
    /// `true` if paths go one way at each surface after their first bounce.
    pub walks: bool,
}

/// Smallest number of diffuse bounces with which paths go one way at each surface after the first. With
/// fewer of them, the queue costs more than it saves.
pub(crate) const MIN_WALK: u32 = 4;

/// Way of paths that go one way at each surface, after their first diffuse bounce.
#[derive(Clone, Copy)]
pub(crate) struct Walk<L: SimdFloat> {
    /// Number of the surface, counted from the first diffuse bounce.
    pub step: u32,
    /// Lanes whose limits permit another diffuse bounce.
    pub may_bounce: L::Mask,
    /// Lanes whose limits permit another reflection.
    pub may_reflect: L::Mask,
    /// Lanes that take part in Russian roulette.
    pub may_end: L::Mask,
    /// Lanes that go on by a diffuse bounce.
    pub bounces: L::Mask,
    /// Lanes that go on by a reflection.
    pub reflects: L::Mask,
    /// Factor of the throughput of these.
    scale: L,
}

/// Reservoir of weighted reservoir sampling. It keeps one hit per lane, chosen from all hits of a
/// generation, at which the next diffuse bounce starts.
pub(crate) struct DiffuseReservoir<L: SimdFloat> {
    /// Number of hits that each lane has offered.
    offers: L,
    /// Lanes whose reservoir holds a hit.
    lanes: L::Mask,
    /// Sum of the weights of all offered hits.
    sum: L,
    /// Throughput of the path up to the chosen hit, times its diffuse albedo. Its largest channel is
    /// the weight of the hit.
    throughput: Vec3<L>,
    origin: Vec3<L>,
    normal: Vec3<L>,
    geometric: Vec3<L>,
    media: MediumStack<L>,
    coincident: Option<CoincidentState<L>>,
    /// Way of the paths, if they go one way only; `None` in the first generation.
    pub walk: Option<Walk<L>>,
}

impl<L: SimdFloat> Walk<L> {
    /// Returns the walk at surface number `step` before its choice, with the lanes `may_bounce`,
    /// `may_reflect` and `may_end`.
    pub fn new(step: u32, [may_bounce, may_reflect, may_end]: [L::Mask; 3]) -> Self {
        let (bounces, reflects) = (L::mask(false), L::mask(false));
        Self { step, may_bounce, may_reflect, may_end, bounces, reflects, scale: L::one() }
    }
}

impl<L: SimdFloat> DiffuseReservoir<L> {
    /// Returns the reservoir of paths that go one way.
    pub fn walking(walk: Walk<L>) -> Self {
        Self { walk: Some(walk), ..Self::new() }
    }

    fn new() -> Self {
        Self {
            walk: None,
            offers: L::zero(),
            lanes: L::mask(false),
            sum: L::zero(),
            throughput: Vec3::zero(),
            origin: Vec3::zero(),
            normal: Vec3::zero(),
            geometric: Vec3::zero(),
            media: MediumStack::vacuum(),
            coincident: None,
        }
    }

    /// Offers the hits of `vertex` to the reservoir. `media` and `coincident` are the state in
    /// which a diffuse bounce would start, on the side from which the path arrived. Returns the
    /// lanes whose surface reflects diffusely: they get no ambient light, because the diffuse
    /// bounce computes their indirect light.
    #[inline(never)]
    pub fn offer(
        &mut self,
        vertex: &Vertex<'_, L>,
        media: &MediumStack<L>,
        coincident: Option<&CoincidentState<L>>,
    ) -> L::Mask {
        let interaction = vertex.interaction;
        let throughput = vertex.path.throughput.component_mul(interaction.diffuse);
        let weight = throughput.max_element();
        // A surface behind a coincident surface gets no light from lights, but has a diffuse bounce
        // like other surfaces.
        let mut lanes = interaction.has_bsdf & weight.gt(L::zero());
        if let Some(walk) = &self.walk {
            lanes = lanes & walk.may_bounce;
        }
        if lanes.none() {
            return lanes;
        }
        self.sum += weight.masked(lanes);
        // Random numbers are numbered by the offers of the lane, not of the packet, whose other lanes
        // hit other surfaces.
        let (mut taken, mut undecided) = (lanes, lanes & self.lanes);
        while undecided.any() {
            let offers = self.offers.lane(undecided.bits().trailing_zeros() as usize);
            let alike = undecided & equal(self.offers, L::splat(offers));
            let number = vertex.sampler.reservoir_1d(offers.to_f64() as u32);
            taken = taken.and_not(alike & (number * self.sum).ge(weight));
            undecided = undecided.and_not(alike);
        }
        self.offers += L::one().masked(lanes);
        self.lanes = self.lanes | lanes;
        self.throughput = Vec3::select(taken, throughput, self.throughput);
        self.origin = Vec3::select(taken, interaction.ray_origin(), self.origin);
        self.normal = Vec3::select(taken, interaction.normal, self.normal);
        self.geometric = Vec3::select(taken, interaction.geometric, self.geometric);
        self.media = MediumStack::select(taken, media, &self.media);
        let idle = |state| CoincidentState { lanes: L::mask(false), ..state };
        let new = coincident.copied().or(self.coincident.map(idle));
        let old = self.coincident.or(coincident.copied().map(idle));
        self.coincident = new.zip(old).map(|(new, old)| {
            let lanes = (taken & new.lanes) | old.lanes.and_not(taken);
            CoincidentState { lanes, ..CoincidentState::select(taken, &new, &old) }
        });
        lanes
    }

    /// Chooses one way for each path at `vertex`, in proportion to its throughput: the diffuse bounce
    /// that was offered, or the reflection if it is `followed`. Paths that lose throughput end with
    /// some probability (Russian roulette, Arvo and Kirk 1990).
    #[inline(never)]
    pub fn choose_way(&mut self, vertex: &Vertex<'_, L>, followed: L::Mask) {
        let Some(walk) = &mut self.walk else { return };
        let (zero, one) = (L::zero(), L::one());
        let arriving = vertex.path.throughput.max_element();
        let mut mirrored = zero;
        for (index, lanes) in vertex.interaction.bsdfs(followed) {
            let strength = vertex.world.bsdfs[index].reflection.map_or(zero, L::splat);
            mirrored = L::select(lanes, strength * arriving, mirrored);
        }
        let diffuse = self.throughput.max_element().masked(self.lanes);
        let sum = diffuse + mirrored;
        let possible = sum.gt(zero);
        let kept = (sum / L::select(possible, arriving, one)).min(one);
        let kept = L::select(walk.may_end, kept, one);
        let number = vertex.sampler.reservoir_1d(0) * sum;
        walk.bounces = possible & number.lt(diffuse * kept);
        walk.reflects = possible.and_not(walk.bounces) & number.lt(sum * kept) & followed;
        walk.scale = sum / L::select(walk.reflects, mirrored * kept, one);
        self.sum = sum / L::select(possible, kept, one);
    }

    /// Replaces the paths by those that go on, of which `path` has the reflected ones in `lanes`.
    #[inline(never)]
    pub fn go_on(&mut self, vertex: &mut Vertex<'_, L>, lanes: L::Mask) {
        let Some(walk) = self.walk else { return };
        let step = walk.step;
        let reflects = walk.reflects & lanes;
        let path = &mut *vertex.path;
        path.throughput = Path::bounded(path.throughput * walk.scale);
        let start = self.start(vertex.world, vertex.sampler.diffuse_2d(step));
        let bounces = walk.bounces & start.lanes;
        *path = Path::select(bounces, &start.path, path);
        self.walk = Some(Walk { bounces, reflects, ..walk });
    }

    /// Returns the rays that leave the chosen hits by a diffuse bounce.
    fn start(&self, world: &World<L>, (u, v): (L, L)) -> Branch<L> {
        let (direction, ratio) = match &world.lights.mirror_images {
            Some(images) => images.sample_bounce(self.origin, self.normal, u, v),
            None => (Frame::around(self.normal).to_world(cosine_hemisphere(u, v)), L::one()),
        };
        // The throughput is divided by the probability of the choice, weight / sum.
        let weight = self.throughput.max_element();
        let scale = self.sum * ratio / L::select(self.lanes, weight, L::one());
        let path = Path {
            ray: Ray { origin: self.origin, direction },
            throughput: Path::bounded(self.throughput * scale),
            lobe_pdf: L::from_f64(NO_PDF),
            passed: L::zero(),
        };
        let lanes = self.lanes
            & direction.dot(self.geometric).gt(L::zero())
            & path.throughput.max_element().ge(L::from_f64(world.min_throughput));
        Branch { path, lanes, media: self.media, bounce: 0, coincident: self.coincident }
    }
}

impl<L: SimdFloat> Integrator<'_, L> {
    /// Traces camera rays in a scene with indirect diffuse light. The paths of the first diffuse bounce
    /// are added to `queue`, if there is one.
    #[inline(never)]
    pub fn trace_generations(
        &self,
        limits: DiffuseLimits,
        ray: Ray<L>,
        active: L::Mask,
        out: &mut Radiance<L>,
        queue: Option<&mut BounceQueue<L>>,
    ) {
        let world = self.world;
        let mut start = Branch::camera(ray, active);
        if let Some(nested_dielectrics) = &world.nested_dielectrics {
            nested_dielectrics.add_at_start(&ray, &mut start.media);
        }
        let (mut candidates, mut depth) = (self.candidates, self.depth);
        for generation in 0..=limits.depth {
            let sampler = &self.sampler.generation(generation);
            let integrator = Integrator { world, sampler, candidates, depth };
            let mut reservoir = (generation < limits.depth).then(DiffuseReservoir::new);
            match &world.nested_dielectrics {
                Some(nested_dielectrics) => {
                    TransmissionIntegrator { base: integrator, nested_dielectrics }.trace(
                        &mut start,
                        reservoir.as_mut(),
                        out,
                    );
                }
                None => {
                    let (path, lanes) = (&mut start.path, start.lanes);
                    integrator.trace_opaque::<false>(path, lanes, reservoir.as_mut(), out);
                }
            }
            let Some(reservoir) = reservoir else { break };
            start = reservoir.start(world, sampler.diffuse_2d(generation));
            if start.lanes.none() {
                break;
            }
            out.counts.glossy = true;
            if let Some(queue) = queue {
                return queue.push(start.path, start.lanes, sampler);
            }
            candidates = &world.culling.all_candidates;
            depth = if limits.caustics { world.depth } else { 0 };
        }
    }
}
