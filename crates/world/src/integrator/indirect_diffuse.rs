//! Indirect diffuse light: bounces from diffuse surfaces, in generations.
//!
//! A generation is the tree of mirror and glass surfaces that a ray reaches. The first generation
//! starts at the camera, as in a scene without indirect diffuse light. One hit of a generation is
//! chosen for the diffuse bounce, with a probability in proportion to the light that it can pass on
//! (weighted reservoir sampling, Chao 1982, *A General Purpose Unequal Probability Sampling Plan*).
//! The next generation starts at the chosen hit, in a direction whose density is the cosine to the
//! normal, divided by pi, mixed with directions of emitters in mirrors (`lights/mirror_images.rs`).
//! Mirrors therefore have no more noise than without diffuse bounces, and a
//! path bounces at most once per generation.
//!
//! Emitters and environments are sampled at every hit. A ray that starts at a diffuse bounce
//! therefore adds nothing where it reaches an emitter or escapes to an environment.

use crate::integrator::Integrator;
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

/// Limits of indirect diffuse light in a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DiffuseLimits {
    /// Largest number of diffuse bounces of a path, greater than 0.
    pub depth: u32,
    /// `true` if mirrors reflect and glass transmits after a diffuse bounce.
    pub caustics: bool,
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
}

impl<L: SimdFloat> DiffuseReservoir<L> {
    fn new() -> Self {
        Self {
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
        let lanes = interaction.has_bsdf & weight.gt(L::zero());
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

    /// Returns the rays that leave the chosen hits by a diffuse bounce.
    fn start(&self, world: &World<L>, (u, v): (L, L)) -> Branch<L> {
        let (direction, ratio) = match &world.lights.mirror_images {
            Some(images) => images.sample_bounce((self.origin, self.normal), (u, v)),
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
    /// Traces camera rays in a scene with indirect diffuse light.
    #[inline(never)]
    pub fn trace_generations(
        &self,
        limits: DiffuseLimits,
        ray: Ray<L>,
        active: L::Mask,
        out: &mut Radiance<L>,
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
            candidates = &world.culling.all_candidates;
            depth = if limits.caustics { world.depth } else { 0 };
        }
    }
}
