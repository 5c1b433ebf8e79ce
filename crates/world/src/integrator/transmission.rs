//! Integrator of worlds with transmission. At an interface a path splits into a reflected and a
//! transmitted ray.

use crate::culling::tile::TileCandidates;
use crate::integrator::chosen_lights::chosen_lights;
use crate::integrator::coincident_surfaces::{CoincidentQuery, CoincidentState, Contacts};
use crate::integrator::direct_lighting::direct_lighting;
use crate::integrator::emitter_lighting::{
    ReflectingLobes, emitter_lighting, reflected_density, surface_emission, visible_emitters,
};
use crate::integrator::indirect_diffuse::DiffuseReservoir;
use crate::integrator::interaction::{SurfaceInteraction, interact};
use crate::integrator::interface_lighting::{RoughInterface, interface_lighting};
use crate::integrator::nested_dielectrics::{InterfaceHit, Media, MediumStack, NestedDielectrics};
use crate::integrator::opaque::sample_reflection;
use crate::integrator::path::{Counts, Path, Radiance};
use crate::world::World;
use zerkalo_kernel::bvh::{Hit, Ray};
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3, next_distinct};
use zerkalo_kernel::sampling::PacketSampler;
use zerkalo_scene::material::{Bsdf, Interface, InterfaceMedia, ReflectionLobe, Transmission};

/// Number of surfaces, counted from the eye or from the latest diffuse bounce, at which a path
/// splits into reflection and refraction if the surface is an interface. At later interfaces one of
/// the two is chosen at random.
const SPLIT_DEPTH: usize = 2;

/// One branch of a packet of paths, which split into reflection and transmission at interfaces. All
/// paths of the branch have hit the same number of surfaces.
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

/// Reflected and transmitted directions at the interfaces of a packet, with the throughputs of the
/// paths that continue in them.
struct SplitDirections<L> {
    /// Directions of the reflected rays.
    reflected: Vec3<L>,
    /// Throughput of the reflected paths.
    reflected_weight: Vec3<L>,
    /// Densities \[1/sr\] of the reflected directions; see [`Path::lobe_density`].
    reflected_density: L,
    /// Directions of the transmitted rays.
    transmitted: Vec3<L>,
    /// Throughput of the transmitted paths.
    transmitted_weight: Vec3<L>,
    /// Densities \[1/sr\] of the transmitted directions; see [`Path::lobe_density`].
    transmitted_density: L,
}

/// Integrator of scenes with transmission, with the inputs that all branches of a packet's paths
/// share.
pub(crate) struct TransmissionIntegrator<'a, L: SimdFloat> {
    pub world: &'a World<L>,
    pub nested_dielectrics: &'a NestedDielectrics<L>,
    pub sampler: &'a PacketSampler<'a, L>,
}

impl<L: SimdFloat> TransmissionIntegrator<'_, L> {
    /// Traces the rays of `start`, over at most `depth` surfaces after the first, and overwrites
    /// `start`. In each lane, the transmitted branch of an interface is traced before the reflected
    /// one; this order does not depend on the other lanes. `reservoir` collects the hits from which
    /// indirect diffuse light may bounce.
    #[inline(never)]
    pub fn trace(
        &self,
        start: &mut Branch<L>,
        depth: u32,
        candidates: &TileCandidates,
        mut reservoir: Option<&mut DiffuseReservoir<L>>,
        out: &mut Radiance<L>,
    ) -> Counts {
        let mut counts = Counts::default();
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
                Some(None) => return counts,
            };
            let candidates =
                if branch.bounce == 0 { candidates } else { &self.world.all_candidates };
            let limits = (depth, reservoir.as_deref_mut());
            if self.advance(branch, candidates, deeper, limits, (&mut *out, &mut counts)) {
                continue;
            }
            if let Some(finished) = traced.last_mut() {
                *finished = None;
            }
            match waiting.iter().rposition(Option::is_some) {
                Some(deepest) => current = deepest + 1,
                None => return counts,
            }
        }
    }

    /// Traces the rays of `branch` and adds the radiance of their hit points to `out`. Replaces
    /// `branch` by the paths that continue, and returns `false` if there are none. A path has at
    /// most `depth` surfaces after the first. At an interface among the first [`SPLIT_DEPTH`]
    /// surfaces, the reflected branch is stored in `waiting`.
    fn advance(
        &self,
        branch: &mut Branch<L>,
        candidates: &TileCandidates,
        waiting: &mut [Option<Branch<L>>],
        (depth, reservoir): (u32, Option<&mut DiffuseReservoir<L>>),
        (out, counts): (&mut Radiance<L>, &mut Counts),
    ) -> bool {
        let world = self.world;
        // Paths and media are large, so they are borrowed instead of copied.
        let (path, media, active, bounce) =
            (&mut branch.path, &branch.media, branch.lanes, branch.bounce);
        counts.rays += u64::from(active.bits().count_ones());
        let mut hit = world.geometry.closest_masked(&path.ray, &candidates.primary, active);
        let mut behind = None;
        if let (Some(contacts), Some(coincident)) =
            (&self.nested_dielectrics.contacts, &branch.coincident)
            && (coincident.lanes & active).any()
        {
            let coincident = CoincidentState { lanes: coincident.lanes & active, ..*coincident };
            let next = contacts.next(&world.geometry, &coincident, media);
            let origin = Vec3::select(next.lanes, coincident.point, path.ray.origin);
            path.ray.origin = origin;
            hit.take_in(next.lanes, L::zero(), (next.primitive, next.triangle));
            behind = Some(next);
        }
        let absorbing = Media { nested_dielectrics: self.nested_dielectrics, stack: media };
        let has_emitters = world.has_emitters();
        if has_emitters {
            visible_emitters(world, path, hit.t, active, Some(absorbing), out);
        }
        if let Some(left) = absorbing.transmittance(hit.t) {
            path.throughput = path.throughput.component_mul(left);
        }
        let is_hit = hit.t.lt(L::from_f64(L::MAX));
        if let Some(group) = world.background {
            out.groups[group] += path.throughput.masked(active.and_not(is_hit));
        }
        let lanes = active & is_hit;
        let Some(first) = next_distinct(hit.primitive, lanes) else { return false };
        let mut interaction = interact::<_, false>(world, &path.ray, &hit, first, lanes);
        let mut coincident = None;
        if let Some(contacts) = &self.nested_dielectrics.contacts {
            let behind_lanes = behind.as_ref().map_or(L::mask(false), |next| next.lanes);
            let contact_lanes = contacts.near(
                interaction.primitive,
                interaction.point,
                lanes.and_not(behind_lanes),
            );
            if behind.is_some() || contact_lanes.any() {
                let lanes = (lanes, contact_lanes);
                let hits = (&mut hit, &mut interaction);
                coincident = self.coincident(contacts, path, hits, lanes, behind.as_ref(), media);
            }
        }
        let interface_hit = self.interface_hit(&interaction, lanes, media);
        if let Some(interface_hit) = &interface_hit {
            interaction.mask_out(interface_hit.suppressed);
        }
        if has_emitters && !world.emission.is_empty() {
            surface_emission(world, path, &hit, &interaction, out);
        }
        let bouncing = reservoir.map(|reservoir| {
            let coincident = coincident.as_ref().map(CoincidentState::reversed);
            let media = match &interface_hit {
                Some(hit) => MediumStack::select(hit.lanes, &hit.medium_reflected, media),
                None => *media,
            };
            reservoir.offer(path, &interaction, (&media, coincident.as_ref()), self.sampler)
        });
        direct_lighting::<_, false>(
            world,
            path,
            &interaction,
            candidates,
            bouncing,
            Some(absorbing),
            (&mut *out, &mut *counts),
        );
        if let Some(choice) = &world.light_choice {
            chosen_lights::<_, false>(
                world,
                (choice, &candidates.occluders[world.first_stratum()..]),
                path,
                &interaction,
                (self.sampler, bounce),
                Some(absorbing),
                (&mut *out, &mut *counts),
            );
        }
        if has_emitters {
            let lobes = if bounce == depth {
                ReflectingLobes { lanes: L::mask(false), share: L::one() }
            } else {
                self.reflecting_lobes(path, &interaction, interface_hit.as_ref())
            };
            emitter_lighting(
                world,
                path,
                &interaction,
                candidates,
                (self.sampler, bounce),
                (&lobes, Some(absorbing)),
                (out, counts),
            );
        }
        if bounce == depth {
            return false;
        }
        let rough = interface_hit.as_ref().map(|hit| {
            let coincident = coincident.as_ref().map_or(L::mask(false), |state| state.lanes);
            RoughInterface::new(world, &interaction, hit, coincident)
        });
        if let Some(rough) = &rough
            && rough.reflecting.any()
        {
            let random = (self.sampler, bounce);
            let rough = (rough, self.nested_dielectrics);
            interface_lighting(world, path, &interaction, rough, random, (out, counts));
        }
        let bounce = bounce + 1;
        let Some(rough) = &rough else {
            let random = (self.sampler, bounce - 1);
            branch.lanes = sample_reflection::<_, false>(
                world,
                path,
                &interaction,
                random,
                has_emitters,
                counts,
            );
            branch.bounce = bounce;
            branch.coincident = coincident.as_ref().map(CoincidentState::reversed);
            return branch.lanes.any();
        };
        let interface_hit = rough.hit;
        let split = self.split_directions(path, &interaction, rough, bounce - 1, counts);
        let reaches_min_weight = |throughput: Vec3<L>| {
            let max_throughput = throughput.max_element();
            max_throughput.gt(L::zero()) & max_throughput.ge(L::from_f64(world.min_weight))
        };
        let reflects = (interaction.reflecting | interface_hit.lanes)
            & reaches_min_weight(split.reflected_weight);
        let transmits = interface_hit.lanes & reaches_min_weight(split.transmitted_weight);
        let both = reflects & transmits;
        let origin = interaction.ray_origin();
        let medium_reflected =
            MediumStack::select(interface_hit.lanes, &interface_hit.medium_reflected, media);
        let coincident_reflected = coincident.as_ref().map(CoincidentState::reversed);
        // Lanes that continue with the transmitted ray; the others continue with the reflected one.
        let (mut transmitted, mut reflected_weight, mut transmitted_weight) =
            (transmits, split.reflected_weight, split.transmitted_weight);
        if both.any() {
            if bounce as usize <= SPLIT_DEPTH {
                let entry = waiting.len() + bounce as usize - 1 - SPLIT_DEPTH;
                waiting[entry] = Some(Branch {
                    path: Path {
                        ray: Ray { origin, direction: split.reflected },
                        throughput: split.reflected_weight,
                        lobe_density: split.reflected_density,
                    },
                    lanes: both,
                    media: medium_reflected,
                    bounce,
                    coincident: coincident_reflected,
                });
            } else {
                counts.glossy = true;
                let (r, t) = (reflected_weight.max_element(), transmitted_weight.max_element());
                let choose_reflection = both
                    & (self.sampler.branch_1d(bounce - 1 - SPLIT_DEPTH as u32) * (r + t)).lt(r);
                transmitted = transmitted.and_not(choose_reflection);
                let scaled = |v: Vec3<L>, k: L| Vec3::select(both, v * ((r + t) / k), v);
                reflected_weight = scaled(reflected_weight, r);
                transmitted_weight = scaled(transmitted_weight, t);
            }
        }
        path.ray.origin = Vec3::select(transmitted, interaction.ray_origin_behind(), origin);
        path.ray.direction = Vec3::select(transmitted, split.transmitted, split.reflected);
        path.throughput = Vec3::select(transmitted, transmitted_weight, reflected_weight);
        path.lobe_density =
            L::select(transmitted, split.transmitted_density, split.reflected_density);
        branch.lanes = reflects | transmits;
        branch.media =
            MediumStack::select(transmitted, &interface_hit.medium_transmitted, &medium_reflected);
        branch.bounce = bounce;
        branch.coincident = coincident.as_ref().zip(coincident_reflected.as_ref()).map(
            |(transmitted_state, reflected_state)| {
                CoincidentState::select(transmitted, transmitted_state, reflected_state)
            },
        );
        branch.lanes.any()
    }

    /// Resolves hits of `lanes` on coincident surfaces: replaces `hit` and `interaction` by those
    /// of the surface that the path crosses first (see [`Contacts`]). `contact_lanes` are the lanes
    /// whose hit point may be on a second primitive as well. `behind` is the coincident surface
    /// behind the start points of the rays, if one was found. Returns the state of rays that pass
    /// the surface, or `None` if no surfaces coincide.
    #[inline(never)]
    fn coincident(
        &self,
        contacts: &Contacts<L::Scalar>,
        path: &Path<L>,
        (hit, interaction): (&mut Hit<L>, &mut SurfaceInteraction<L>),
        (lanes, contact_lanes): (L::Mask, L::Mask),
        behind: Option<&CoincidentQuery<L>>,
        media: &MediumStack<L>,
    ) -> Option<CoincidentState<L>> {
        let (mut layer, mut offset, mut coincident_lanes) =
            (L::zero(), interaction.offset, L::mask(false));
        if let Some(next) = behind {
            // The surface that the rays have left is in front of the surface that they hit, and
            // occludes all lights on the side of the rays.
            if self.world.shadows {
                interaction.shade(next.lanes);
            }
            (layer, coincident_lanes) = (next.layer, next.lanes);
            offset = offset.max(next.offset.masked(coincident_lanes));
        }
        if contact_lanes.any() {
            let (primitive, point, axis) =
                (interaction.primitive, interaction.point, -interaction.geometric);
            let coincident =
                CoincidentState { lanes: contact_lanes, primitive, point, axis, layer: L::zero() };
            let first =
                contacts.first(&self.world.geometry, &coincident, !interaction.front, media);
            if first.lanes.any() {
                hit.take_in(first.lanes, hit.t, (first.primitive, first.triangle));
                if let Some(distinct) = next_distinct(hit.primitive, lanes) {
                    *interaction =
                        interact::<_, false>(self.world, &path.ray, hit, distinct, lanes);
                    offset = offset.max(interaction.offset);
                    if let (Some(next), true) = (behind, self.world.shadows) {
                        interaction.shade(next.lanes);
                    }
                }
            }
            layer = L::select(first.touching, first.layer, layer);
            coincident_lanes = coincident_lanes | first.touching;
            offset = offset.max(first.offset.masked(first.touching));
        }
        interaction.offset = L::select(coincident_lanes, offset, interaction.offset);
        let coincident = CoincidentState {
            lanes: coincident_lanes,
            primitive: interaction.primitive,
            point: interaction.point,
            axis: -interaction.geometric,
            layer,
        };
        coincident_lanes.any().then_some(coincident)
    }

    /// Returns the hits of `lanes` on transmissive surfaces. Returns `None` if no lane hits such a
    /// surface.
    fn interface_hit(
        &self,
        interaction: &SurfaceInteraction<L>,
        lanes: L::Mask,
        media: &MediumStack<L>,
    ) -> Option<InterfaceHit<L>> {
        let mut transmissive = L::mask(false);
        let mut index = L::one();
        for (bsdf, bsdf_lanes) in interaction.bsdfs(lanes) {
            if let Some(transmission) = &self.world.bsdfs[bsdf].transmission {
                transmissive = transmissive | bsdf_lanes;
                index = L::select(bsdf_lanes, L::splat(transmission.index), index);
            }
        }
        self.nested_dielectrics.cross(interaction, transmissive, media, index)
    }

    /// Returns two values: the lanes whose reflected rays are followed, and in each lane the
    /// fraction of the light that the surface reflects. Rough interfaces are excluded; see
    /// [`interface_lighting`].
    fn reflecting_lobes(
        &self,
        path: &Path<L>,
        interaction: &SurfaceInteraction<L>,
        interface_hit: Option<&InterfaceHit<L>>,
    ) -> ReflectingLobes<L> {
        let (mut followed, mut share) = (interaction.reflecting, L::one());
        let Some(interface_hit) = interface_hit else {
            return ReflectingLobes { lanes: followed, share };
        };
        let interface = smooth_interface(path.ray.direction, interaction, interface_hit);
        for (index, lanes) in interaction.bsdfs(followed & interface_hit.lanes) {
            if let Some(transmission) = &self.world.bsdfs[index].transmission {
                if !matches!(transmission.lobe, ReflectionLobe::Mirror) {
                    followed = followed.and_not(lanes);
                }
                let shares =
                    interface.split_at(transmission, interface_hit.outer, interface_hit.thin);
                share = L::select(lanes, shares.reflected, share);
            }
        }
        ReflectingLobes { lanes: followed.and_not(interface_hit.suppressed), share }
    }

    /// Samples the reflected and transmitted directions at the hit points of `path`. The surface
    /// must transmit in at least one lane. `bounce` is the number of surfaces that the path has hit
    /// before.
    fn split_directions(
        &self,
        path: &Path<L>,
        interaction: &SurfaceInteraction<L>,
        rough: &RoughInterface<'_, L>,
        bounce: u32,
        counts: &mut Counts,
    ) -> SplitDirections<L> {
        let interface_hit = rough.hit;
        let incident = path.ray.direction;
        let interface = smooth_interface(incident, interaction, interface_hit);
        let straight = interface_hit.thin | interface_hit.suppressed;
        let mut directions = SplitDirections {
            reflected: incident.reflect(interaction.normal),
            reflected_weight: Vec3::zero(),
            reflected_density: L::from_f64(L::MAX),
            transmitted: Vec3::select(straight, incident, interface.refracted),
            transmitted_weight: Vec3::zero(),
            transmitted_density: L::from_f64(L::MAX),
        };
        let mut lobe_sample = None;
        for (index, lanes) in interaction.bsdfs(interaction.reflecting | interface_hit.lanes) {
            let bsdf = &self.world.bsdfs[index];
            let mut reflected_share = L::one();
            if let Some(transmission) = &bsdf.transmission {
                if !matches!(transmission.lobe, ReflectionLobe::Mirror) {
                    counts.glossy = true;
                    let uv = *lobe_sample.get_or_insert_with(|| self.sampler.lobe_2d(bounce));
                    let at = (path, interaction, interface_hit);
                    self.sample_rough(&mut directions, bsdf, transmission, at, (lanes, uv));
                    continue;
                }
                let shares =
                    interface.split_at(transmission, interface_hit.outer, interface_hit.thin);
                reflected_share = shares.reflected.masked(!interface_hit.suppressed);
                let transmitted = L::select(interface_hit.suppressed, L::one(), shares.transmitted);
                directions.transmitted_weight = Vec3::select(
                    lanes,
                    path.throughput * transmitted,
                    directions.transmitted_weight,
                );
                let tir = path.throughput * shares.tir.masked(!interface_hit.suppressed);
                directions.reflected_weight = Vec3::select(lanes, tir, directions.reflected_weight);
            }
            let Some((strength, lobe)) = &bsdf.reflection else { continue };
            // Hits on the back of a one-sided surface have no BSDF to reflect.
            let lanes = lanes & interaction.reflecting & reflected_share.gt(L::zero());
            if lanes.none() {
                continue;
            }
            let uv = if matches!(lobe, ReflectionLobe::Mirror) {
                (L::zero(), L::zero())
            } else {
                counts.glossy = true;
                *lobe_sample.get_or_insert_with(|| self.sampler.lobe_2d(bounce))
            };
            let sample =
                bsdf.sample(*strength, lobe, incident, interaction.normal, uv, self.world.fold);
            let weight = path.throughput.component_mul(sample.weight) * reflected_share;
            directions.reflected = Vec3::select(lanes, sample.direction, directions.reflected);
            if self.world.has_emitters() && !matches!(lobe, ReflectionLobe::Mirror) {
                let mut direction = sample.direction;
                if self.world.smooth {
                    direction = interaction.reflect_into_hemisphere(direction);
                }
                let density =
                    reflected_density(self.world, &incident, interaction, index, direction);
                directions.reflected_density =
                    L::select(lanes, density, directions.reflected_density);
            }
            directions.reflected_weight = Vec3::select(lanes, weight, directions.reflected_weight);
        }
        if self.world.smooth {
            directions.reflected = interaction.reflect_into_hemisphere(directions.reflected);
            // Transmitted directions that stay in front of the surface are mirrored to the other
            // side.
            directions.transmitted = -interaction.reflect_into_hemisphere(-directions.transmitted);
        }
        for (behind, lanes) in [(false, rough.reflecting), (true, rough.transmitting)] {
            if lanes.none() {
                continue;
            }
            let (direction, density) = if behind {
                (&directions.transmitted, &mut directions.transmitted_density)
            } else {
                (&directions.reflected, &mut directions.reflected_density)
            };
            let (_, lobe_density) =
                rough.evaluate(self.world, &incident, interaction, direction, behind);
            *density = L::select(lanes, lobe_density, *density);
        }
        directions.reflected_weight = Path::bounded(directions.reflected_weight);
        directions.transmitted_weight = Path::bounded(directions.transmitted_weight);
        directions
    }

    /// Samples the reflected and transmitted directions of `lanes`, whose surfaces must be rough,
    /// with the random numbers `uv`, and stores them in `directions`.
    #[inline(never)]
    fn sample_rough(
        &self,
        directions: &mut SplitDirections<L>,
        bsdf: &Bsdf<L::Scalar>,
        transmission: &Transmission<L::Scalar>,
        (path, interaction, hit): (&Path<L>, &SurfaceInteraction<L>, &InterfaceHit<L>),
        (lanes, uv): (L::Mask, (L, L)),
    ) {
        let media = InterfaceMedia { n_i: hit.n_i, n_t: hit.n_t, outer: hit.outer, thin: hit.thin };
        let incident = path.ray.direction;
        let sample = bsdf.sample_interface(
            transmission,
            &media,
            (incident, interaction.normal),
            uv,
            (interaction.reflecting, self.world.fold),
        );
        // Rays pass a suppressed boundary (inside of a solid with a higher priority) unchanged.
        let rough = lanes.and_not(hit.suppressed);
        let reflected_weight = path.throughput.component_mul(sample.reflected_weight);
        let transmitted = L::select(hit.suppressed, L::one(), sample.transmitted_weight);
        let transmitted_weight = path.throughput * transmitted;
        directions.reflected = Vec3::select(rough, sample.reflected, directions.reflected);
        directions.reflected_weight =
            Vec3::select(rough, reflected_weight, directions.reflected_weight);
        directions.transmitted = Vec3::select(rough, sample.transmitted, directions.transmitted);
        directions.transmitted_weight =
            Vec3::select(lanes, transmitted_weight, directions.transmitted_weight);
    }
}

/// Returns the refraction of rays with the direction `incident` at the surfaces of `hit`, as if
/// they had no roughness.
#[inline(always)]
fn smooth_interface<L: SimdFloat>(
    incident: Vec3<L>,
    interaction: &SurfaceInteraction<L>,
    hit: &InterfaceHit<L>,
) -> Interface<L> {
    Interface::new(incident, interaction.normal, hit.n_i, hit.n_t)
}
