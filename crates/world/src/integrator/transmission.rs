//! Integrator of worlds with transmission. At an interface a path splits into a reflected and a
//! transmitted ray.

use crate::integrator::Integrator;
use crate::integrator::coincident_surfaces::{CoincidentQuery, CoincidentState};
use crate::integrator::emitter_lighting::{ReflectedRays, eval_lobe, visible_emitters};
use crate::integrator::indirect_diffuse::DiffuseReservoir;
use crate::integrator::interaction::{SurfaceInteraction, interact};
use crate::integrator::interface_lighting::RoughInterface;
use crate::integrator::nested_dielectrics::{InterfaceHit, Media, MediumStack, NestedDielectrics};
use crate::integrator::path::{Counts, Path, Radiance};
use crate::integrator::vertex::{Vertex, add_background};
use zerkalo_kernel::bvh::{Hit, Ray};
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3, next_distinct};
use zerkalo_scene::material::Interface;

/// Number of surfaces, counted from the eye or from the latest diffuse bounce, at which a path
/// splits into reflection and refraction if the surface is an interface. At later interfaces one of
/// the two is chosen at random.
pub(crate) const SPLIT_DEPTH: usize = 2;

/// [`SPLIT_DEPTH`] of rough interfaces. Their light is noisy in any case.
pub(crate) const ROUGH_SPLIT_DEPTH: u32 = 1;

/// One branch of a packet of paths, which split into reflection and transmission at interfaces. All
/// paths of the branch have hit the same number of surfaces.
#[derive(Clone, Copy)]
pub(crate) struct Branch<L: SimdFloat> {
    pub path: Path<L>,
    pub lanes: L::Mask,
    /// Media that the rays are inside of.
    pub media: MediumStack<L>,
    /// Number of surfaces that the paths have hit before, since the camera or the latest diffuse
    /// bounce.
    pub bounce: u32,
    /// State of rays that start on one of several coincident surfaces. `None` if no ray does.
    pub coincident: Option<CoincidentState<L>>,
}

impl<L: SimdFloat> Branch<L> {
    /// Creates the paths of camera rays, which start in vacuum.
    #[inline(always)]
    pub fn camera(ray: Ray<L>, lanes: L::Mask) -> Self {
        let media = MediumStack::vacuum();
        Self { path: Path::new(ray), lanes, media, bounce: 0, coincident: None }
    }
}

/// Reflected and transmitted paths at the interfaces of a packet.
struct Split<'a, L: SimdFloat> {
    rough: &'a RoughInterface<'a, L>,
    /// Refraction as if the surfaces had no roughness.
    interface: Interface<L>,
    reflected: Path<L>,
    transmitted: Path<L>,
    /// Lanes whose reflected paths continue.
    reflects: L::Mask,
    /// Lanes whose transmitted paths continue.
    transmits: L::Mask,
    /// Lanes that transmit with roughness.
    spreads: L::Mask,
}

/// Integrator of scenes with transmission.
pub(crate) struct TransmissionIntegrator<'a, L: SimdFloat> {
    pub base: Integrator<'a, L>,
    pub nested_dielectrics: &'a NestedDielectrics<L>,
}

impl<L: SimdFloat> TransmissionIntegrator<'_, L> {
    /// Traces the rays of `start` and overwrites it. In each lane, the transmitted branch of an
    /// interface is traced before the reflected one; this order does not depend on the other lanes.
    /// `reservoir` collects the hits from which indirect diffuse light may bounce.
    #[inline(never)]
    pub fn trace(
        &self,
        start: &mut Branch<L>,
        mut reservoir: Option<&mut DiffuseReservoir<L>>,
        out: &mut Radiance<L>,
    ) {
        // Reflected branches that are traced after the transmitted branches of the same interface.
        // Entry i starts at the path's surface number i + 1, counted from 1. Branches are large, so
        // they are traced where they are stored, and the array literal leaves the bytes of unused
        // entries uninitialised.
        let mut waiting: [Option<Branch<L>>; SPLIT_DEPTH] = [None, None];
        // Number of the entry of `waiting` whose branch is traced, counted from 1; 0 stands for
        // `start`.
        let mut current = 0;
        loop {
            let (traced, deeper) = waiting.split_at_mut(current);
            let branch = match traced.last_mut() {
                None => &mut *start,
                Some(Some(branch)) => branch,
                Some(None) => return,
            };
            if self.advance(branch, deeper, reservoir.as_deref_mut(), out) {
                continue;
            }
            if let Some(finished) = traced.last_mut() {
                *finished = None;
            }
            match waiting.iter().rposition(Option::is_some) {
                Some(deepest) => current = deepest + 1,
                None => return,
            }
        }
    }

    /// Traces the rays of `branch` to their next surfaces and adds the radiance of these surfaces.
    /// Replaces `branch` by the paths that continue, and returns `false` if there are none. At an
    /// interface among the first [`SPLIT_DEPTH`] surfaces, stores the reflected branch in
    /// `waiting`.
    fn advance(
        &self,
        branch: &mut Branch<L>,
        waiting: &mut [Option<Branch<L>>],
        reservoir: Option<&mut DiffuseReservoir<L>>,
        out: &mut Radiance<L>,
    ) -> bool {
        let Integrator { world, sampler, candidates, depth } = self.base;
        let candidates =
            if branch.bounce == 0 { candidates } else { &world.culling.all_candidates };
        out.counts.add_rays(branch.lanes);
        let geometry = &world.geometry;
        let mut hit = geometry.closest_masked(&branch.path.ray, &candidates.primary, branch.lanes);
        let behind = self.behind(branch, &mut hit);
        let media =
            Some(Media { nested_dielectrics: self.nested_dielectrics, stack: &branch.media });
        if world.lights.has_emitters() {
            visible_emitters(world, &branch.path, hit.t, branch.lanes, media, out);
        }
        let lanes = add_background(world, &mut branch.path, hit.t, branch.lanes, media, out);
        let Some(first) = next_distinct(hit.primitive, lanes) else { return false };
        let mut interaction = interact::<_, false>(world, &branch.path.ray, &hit, first, lanes);
        let coincident =
            self.cross_first(branch, &mut hit, &mut interaction, lanes, behind.as_ref());
        let reversed = coincident.as_ref().map(CoincidentState::reversed);
        // Paths and media are large, so they are borrowed instead of copied.
        let (path, stack, bounce) = (&mut branch.path, &branch.media, branch.bounce);
        let interface_hit = self.interface_hit(&interaction, lanes, stack);
        if let Some(hit) = &interface_hit {
            interaction.mask_out(hit.suppressed);
        }
        let interaction = &interaction;
        let mut vertex =
            Vertex { world, path, interaction, candidates, sampler, bounce, media, out };
        let bouncing = reservoir.map(|reservoir| {
            let media = interface_hit.as_ref().map_or(*stack, |hit| hit.stack_reflected(stack));
            reservoir.offer(&vertex, &media, reversed.as_ref())
        });
        vertex.shade::<false>(&hit, bouncing, |vertex| {
            if bounce == depth {
                return ReflectedRays { lanes: L::mask(false), share: L::one() };
            }
            reflected_rays(vertex, interface_hit.as_ref())
        });
        if bounce == depth {
            return false;
        }
        let Some(interface_hit) = &interface_hit else {
            branch.lanes = vertex.sample_reflection::<false>();
            branch.coincident = reversed;
            branch.bounce += 1;
            return branch.lanes.any();
        };
        let coincident_lanes = coincident.as_ref().map_or(L::mask(false), |state| state.lanes);
        let query = interface_hit.query(&vertex);
        let rough = RoughInterface::new(&vertex, interface_hit, &query, coincident_lanes);
        if (rough.reflecting | rough.transmitting).any() {
            vertex.interface_lighting(&rough, self.nested_dielectrics);
        }
        let mut split = Split::new(&mut vertex, &rough);
        self.follow(branch, &mut split, coincident.as_ref(), waiting, &mut out.counts)
    }

    /// Orders coincident surfaces: replaces `hit` and `interaction` in those of `lanes` that hit
    /// several surfaces at one place by the surface that takes effect first. `behind` is the next
    /// coincident surface of rays that start on one. Returns the state with which transmitted rays
    /// look for the following surface; `None` if no surfaces coincide.
    #[inline(always)]
    fn cross_first(
        &self,
        branch: &Branch<L>,
        hit: &mut Hit<L>,
        interaction: &mut SurfaceInteraction<L>,
        lanes: L::Mask,
        behind: Option<&CoincidentQuery<L>>,
    ) -> Option<CoincidentState<L>> {
        let contacts = self.nested_dielectrics.contacts.as_ref()?;
        let uncrossed = lanes.and_not(behind.map_or(L::mask(false), |next| next.lanes));
        let near = contacts.near(interaction.primitive, interaction.point, uncrossed);
        if behind.is_none() && near.none() {
            return None;
        }
        self.cross_contacts(branch, hit, interaction, lanes, near, behind)
    }

    /// Continues [`Self::cross_first`], where the lanes `contact_lanes` may hit several surfaces.
    #[inline(never)]
    fn cross_contacts(
        &self,
        branch: &Branch<L>,
        hit: &mut Hit<L>,
        interaction: &mut SurfaceInteraction<L>,
        lanes: L::Mask,
        contact_lanes: L::Mask,
        behind: Option<&CoincidentQuery<L>>,
    ) -> Option<CoincidentState<L>> {
        let world = self.base.world;
        let contacts = self.nested_dielectrics.contacts.as_ref()?;
        let (mut layer, mut offset, mut coincident_lanes) =
            (L::zero(), interaction.offset, L::mask(false));
        if let Some(next) = behind {
            (layer, coincident_lanes) = (next.layer, next.lanes);
            offset = offset.max(next.offset.masked(coincident_lanes));
        }
        if contact_lanes.any() {
            let coincident = CoincidentState::behind(interaction, contact_lanes, L::zero());
            let leaves = !interaction.front;
            let first = contacts.first(&world.geometry, &coincident, leaves, &branch.media);
            if first.lanes.any() {
                let CoincidentQuery { primitive, triangle, .. } = first;
                hit.replace(first.lanes, &Hit { t: hit.t, primitive, triangle });
                if let Some(distinct) = next_distinct(hit.primitive, lanes) {
                    *interaction =
                        interact::<_, false>(world, &branch.path.ray, hit, distinct, lanes);
                    offset = offset.max(interaction.offset);
                }
            }
            layer = L::select(first.touching, first.layer, layer);
            coincident_lanes = coincident_lanes | first.touching;
            offset = offset.max(first.offset.masked(first.touching));
        }
        if let (Some(next), true) = (behind, world.shadows) {
            // The surface that the rays have left is in front of the surface that they hit, and
            // occludes all lights on the side of the rays.
            interaction.cover(next.lanes);
        }
        interaction.offset = L::select(coincident_lanes, offset, interaction.offset);
        let coincident = CoincidentState::behind(interaction, coincident_lanes, layer);
        coincident_lanes.any().then_some(coincident)
    }

    /// Returns the hits of `lanes` on transmissive surfaces; `None` if no lane hits such a surface.
    fn interface_hit(
        &self,
        interaction: &SurfaceInteraction<L>,
        lanes: L::Mask,
        media: &MediumStack<L>,
    ) -> Option<InterfaceHit<L>> {
        let mut transmissive = L::mask(false);
        let mut index = L::one();
        for (bsdf, bsdf_lanes) in interaction.bsdfs(lanes) {
            if let Some(transmission) = &self.base.world.bsdfs[bsdf].transmission {
                transmissive = transmissive | bsdf_lanes;
                index = L::select(bsdf_lanes, L::splat(transmission.index), index);
            }
        }
        self.nested_dielectrics.cross(interaction, transmissive, media, index)
    }

    /// Finds the surface that rays of `branch` cross next if they start on one of several
    /// coincident surfaces. Replaces the hits of these rays in `hit`, and moves their origins onto
    /// the surface. Returns `None` if no ray starts on such a surface.
    fn behind(&self, branch: &mut Branch<L>, hit: &mut Hit<L>) -> Option<CoincidentQuery<L>> {
        let contacts = self.nested_dielectrics.contacts.as_ref()?;
        let coincident = branch.coincident.as_ref()?;
        let lanes = coincident.lanes & branch.lanes;
        if lanes.none() {
            return None;
        }
        let coincident = CoincidentState { lanes, ..*coincident };
        let next = contacts.next(&self.base.world.geometry, &coincident, &branch.media);
        let ray = &mut branch.path.ray;
        ray.origin = Vec3::select(next.lanes, coincident.point, ray.origin);
        let CoincidentQuery { primitive, triangle, .. } = next;
        hit.replace(next.lanes, &Hit { t: L::zero(), primitive, triangle });
        Some(next)
    }

    /// Continues `branch` with the transmitted paths, or with the reflected paths in lanes that
    /// have no transmitted one. Lanes with both store the reflected branch in `waiting`, or choose
    /// one of the two at random after [`SPLIT_DEPTH`] surfaces, [`ROUGH_SPLIT_DEPTH`] if the surface
    /// is rough. `coincident` is the state of transmitted rays. Returns `false` if no path continues.
    fn follow(
        &self,
        branch: &mut Branch<L>,
        split: &mut Split<'_, L>,
        coincident: Option<&CoincidentState<L>>,
        waiting: &mut [Option<Branch<L>>],
        counts: &mut Counts,
    ) -> bool {
        let Split { rough, reflected, transmitted, reflects, transmits, spreads, .. } = split;
        let (reflects, mut transmits) = (*reflects, *transmits);
        let lanes = reflects | transmits;
        let bounce = branch.bounce + 1;
        let media = rough.hit.stack_reflected(&branch.media);
        let reversed = coincident.map(CoincidentState::reversed);
        let both = reflects & transmits;
        let splits = match bounce as usize <= SPLIT_DEPTH {
            true => both.and_not(*spreads & L::mask(bounce > ROUGH_SPLIT_DEPTH)),
            false => L::mask(false),
        };
        if splits.any() {
            let entry = waiting.len() + bounce as usize - 1 - SPLIT_DEPTH;
            waiting[entry] = Some(Branch {
                path: *reflected,
                lanes: splits,
                media,
                bounce,
                coincident: reversed,
            });
        }
        let chooses = both.and_not(splits);
        if chooses.any() {
            counts.glossy = true;
            let [r, t] = [&*reflected, &*transmitted].map(|path| path.throughput.max_element());
            let first = self.nested_dielectrics.first_choice;
            let number = self.base.sampler.branch_1d(bounce - first);
            transmits = transmits.and_not(chooses & (number * (r + t)).lt(r));
            for (path, own) in [(&mut *reflected, r), (&mut *transmitted, t)] {
                let scaled = path.throughput * ((r + t) / own);
                path.throughput = Vec3::select(chooses, scaled, path.throughput);
            }
        }
        branch.path = Path::select(transmits, transmitted, reflected);
        branch.lanes = lanes;
        branch.media = MediumStack::select(transmits, &rough.hit.medium_transmitted, &media);
        branch.bounce = bounce;
        branch.coincident = coincident
            .zip(reversed.as_ref())
            .map(|(passed, reversed)| CoincidentState::select(transmits, passed, reversed));
        lanes.any()
    }
}

/// Returns the reflected rays that may hit emitters, and the reflected share of the light. Rough
/// interfaces are excluded, because [`Vertex::interface_lighting`] computes their light.
fn reflected_rays<L: SimdFloat>(
    vertex: &Vertex<'_, L>,
    hit: Option<&InterfaceHit<L>>,
) -> ReflectedRays<L> {
    let interaction = vertex.interaction;
    let (mut followed, mut share) = (interaction.reflecting, L::one());
    let Some(hit) = hit else { return ReflectedRays { lanes: followed, share } };
    let query = hit.query(vertex);
    let interface = query.interface(interaction.normal);
    for (index, lanes) in interaction.bsdfs(followed & hit.lanes) {
        let bsdf = &vertex.world.bsdfs[index];
        if !bsdf.is_delta() {
            followed = followed.and_not(lanes);
        }
        share = L::select(lanes, bsdf.split(&interface, &query).reflected, share);
    }
    ReflectedRays { lanes: followed.and_not(hit.suppressed), share }
}

impl<'a, L: SimdFloat> Split<'a, L> {
    /// Samples the reflected and the transmitted directions at the hit points of `vertex`. The
    /// surface must transmit in at least one lane.
    fn new(vertex: &mut Vertex<'_, L>, rough: &'a RoughInterface<'a, L>) -> Self {
        let (world, interaction, hit) = (vertex.world, vertex.interaction, rough.hit);
        let incident = vertex.path.ray.direction;
        let interface = rough.query.interface(interaction.normal);
        let path = |origin, direction| Path {
            ray: Ray { origin, direction },
            throughput: Vec3::zero(),
            lobe_pdf: L::from_f64(L::MAX),
            passed: L::zero(),
        };
        let straight = hit.media.thin | hit.suppressed;
        let refracted = Vec3::select(straight, incident, interface.refracted);
        let mut split = Self {
            rough,
            interface,
            reflected: path(interaction.ray_origin(), incident.reflect(interaction.normal)),
            transmitted: path(interaction.ray_origin_behind(), refracted),
            reflects: interaction.reflecting | hit.lanes,
            transmits: hit.lanes,
            spreads: L::mask(false),
        };
        let mut numbers = None;
        for (index, lanes) in interaction.bsdfs(interaction.reflecting | hit.lanes) {
            let bsdf = &world.bsdfs[index];
            if bsdf.transmission.is_some() && !bsdf.is_delta() {
                split.spreads = split.spreads | lanes;
                split.sample_rough(vertex, index, lanes, &mut numbers);
            } else {
                split.sample_smooth(vertex, index, lanes, &mut numbers);
            }
        }
        let Self { reflected, transmitted, .. } = &mut split;
        if world.smooth {
            let direction = &mut reflected.ray.direction;
            *direction = interaction.reflect_into_hemisphere(*direction);
            // Transmitted directions that stay in front of the surface are mirrored to the other
            // side.
            let direction = &mut transmitted.ray.direction;
            *direction = -interaction.reflect_into_hemisphere(-*direction);
        }
        let sides = [(false, rough.reflecting, reflected), (true, rough.transmitting, transmitted)];
        for (behind, lanes, path) in sides {
            if lanes.any() {
                let pdf = rough.eval(vertex, &path.ray.direction, behind).density;
                path.lobe_pdf = L::select(lanes, pdf, path.lobe_pdf);
            }
            path.throughput = Path::bounded(path.throughput);
        }
        split.reflects = split.reflects & world.reaches_min_throughput(split.reflected.throughput);
        split.transmits =
            split.transmits & world.reaches_min_throughput(split.transmitted.throughput);
        split
    }

    /// Samples the directions of `lanes`, whose surfaces have BSDF number `index`: they are opaque,
    /// or transmit without roughness. `numbers`: see [`Vertex::lobe_numbers`].
    fn sample_smooth(
        &mut self,
        vertex: &mut Vertex<'_, L>,
        index: usize,
        lanes: L::Mask,
        numbers: &mut Option<(L, L)>,
    ) {
        let RoughInterface { hit, query, .. } = self.rough;
        let (world, interaction) = (vertex.world, vertex.interaction);
        let throughput = vertex.path.throughput;
        let bsdf = &world.bsdfs[index];
        let mut share = L::one();
        if bsdf.transmission.is_some() {
            let shares = bsdf.split(&self.interface, query);
            share = shares.reflected.masked(!hit.suppressed);
            let transmitted = L::select(hit.suppressed, L::one(), shares.transmitted);
            let transmitted = throughput * transmitted;
            if world.lights.has_emitters() && (lanes & hit.media.thin).any() {
                self.pass_pane(vertex, lanes & hit.media.thin);
            }
            let tir = throughput * shares.tir.masked(!hit.suppressed);
            self.transmitted.throughput =
                Vec3::select(lanes, transmitted, self.transmitted.throughput);
            self.reflected.throughput = Vec3::select(lanes, tir, self.reflected.throughput);
        }
        // Hits on the back of a one-sided surface have no BSDF to reflect.
        let lanes = lanes & interaction.reflecting & share.gt(L::zero());
        if lanes.none() {
            return;
        }
        let uv = vertex.lobe_numbers(bsdf.is_delta(), numbers);
        let sample = bsdf.sample(&query.rays, uv);
        if world.lights.has_emitters() {
            let mut direction = sample.direction;
            if world.smooth {
                direction = interaction.reflect_into_hemisphere(direction);
            }
            let pdf = eval_lobe(world, interaction, &query.rays, index, direction).density;
            self.reflected.lobe_pdf = L::select(lanes, pdf, self.reflected.lobe_pdf);
        }
        let throughput = throughput.component_mul(sample.weight) * share;
        let ray = &mut self.reflected.ray;
        ray.direction = Vec3::select(lanes, sample.direction, ray.direction);
        self.reflected.throughput = Vec3::select(lanes, throughput, self.reflected.throughput);
    }

    /// Lets the transmitted rays of `lanes`, which pass clear panes, keep the density of the paths:
    /// shadow rays pass the panes, too.
    #[inline(never)]
    fn pass_pane(&mut self, vertex: &Vertex<'_, L>, lanes: L::Mask) {
        let (path, transmitted) = (&*vertex.path, &mut self.transmitted);
        let step = (transmitted.ray.origin - path.ray.origin).dot(path.ray.direction);
        let passed = (path.passed + step).masked(path.lobe_pdf.lt(L::from_f64(L::MAX)));
        transmitted.lobe_pdf = L::select(lanes, path.lobe_pdf, transmitted.lobe_pdf);
        transmitted.passed = L::select(lanes, passed, transmitted.passed);
    }

    /// Samples the directions of `lanes`, whose surfaces have BSDF number `index` and transmit with
    /// roughness. `numbers`: see [`Vertex::lobe_numbers`].
    #[inline(never)]
    fn sample_rough(
        &mut self,
        vertex: &mut Vertex<'_, L>,
        index: usize,
        lanes: L::Mask,
        numbers: &mut Option<(L, L)>,
    ) {
        let RoughInterface { hit, query, .. } = self.rough;
        let uv = vertex.lobe_numbers(false, numbers);
        let throughput = vertex.path.throughput;
        let sample = vertex.world.bsdfs[index].sample_interface(query, uv);
        // Rays pass a suppressed boundary (inside a solid with a higher priority) unchanged.
        let rough = lanes.and_not(hit.suppressed);
        let weight = throughput.component_mul(sample.reflected_weight);
        let reflected = &mut self.reflected;
        reflected.ray.direction = Vec3::select(rough, sample.reflected, reflected.ray.direction);
        reflected.throughput = Vec3::select(rough, weight, reflected.throughput);
        let passed = L::select(hit.suppressed, L::one(), sample.transmitted_weight);
        let transmitted = &mut self.transmitted;
        transmitted.ray.direction =
            Vec3::select(rough, sample.transmitted, transmitted.ray.direction);
        transmitted.throughput = Vec3::select(lanes, throughput * passed, transmitted.throughput);
    }
}
