//! Vertices of a packet of paths: shading and reflection at the hit points of its rays.

use crate::culling::tile::TileCandidates;
use crate::integrator::emitter_lighting::{ReflectedRays, eval_lobe};
use crate::integrator::interaction::SurfaceInteraction;
use crate::integrator::nested_dielectrics::{Media, attenuated};
use crate::integrator::path::{Path, Radiance};
use crate::world::World;
use zerkalo_kernel::bvh::Hit;
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3};
use zerkalo_kernel::sampling::PacketSampler;
use zerkalo_scene::material::BsdfQuery;

/// Vertices of a packet of paths: its hit points, and what is needed to shade them.
pub(crate) struct Vertex<'a, L: SimdFloat> {
    pub world: &'a World<L>,
    /// Paths that arrive at the hit points.
    pub path: &'a mut Path<L>,
    pub interaction: &'a SurfaceInteraction<L>,
    /// Primitives that shadow rays are tested against.
    pub candidates: &'a TileCandidates,
    pub sampler: &'a PacketSampler<'a, L>,
    /// Number of earlier surfaces of the paths, since the camera or the latest diffuse bounce.
    pub bounce: u32,
    /// Media in front of the surfaces; `None` in worlds without transmission.
    pub media: Option<Media<'a, L>>,
    pub out: &'a mut Radiance<L>,
}

/// Multiplies the throughput of `path` by the transmittance up to its hits at the distance `t`,
/// which is the largest finite number without a hit. Adds the background in the lanes of `active`
/// that hit no surface. Returns the other lanes of `active`.
#[inline(always)]
pub(crate) fn add_background<L: SimdFloat>(
    world: &World<L>,
    path: &mut Path<L>,
    t: L,
    active: L::Mask,
    media: Option<Media<'_, L>>,
    out: &mut Radiance<L>,
) -> L::Mask {
    path.throughput = attenuated(media, path.throughput, t);
    let is_hit = t.lt(L::from_f64(L::MAX));
    if let Some(group) = world.background {
        out.groups[group] += path.throughput.masked(active.and_not(is_hit));
    }
    active & is_hit
}

impl<L: SimdFloat> Vertex<'_, L> {
    /// Adds the light that the surfaces emit and reflect. `bouncing` are the lanes whose indirect
    /// light a diffuse bounce computes; `None` if there are no bounces. `rays` returns the reflected
    /// rays that the integrator follows.
    #[inline(always)]
    pub fn shade<const SIMPLE: bool>(
        &mut self,
        hit: &Hit<L>,
        bouncing: Option<L::Mask>,
        rays: impl FnOnce(&Self) -> ReflectedRays<L>,
    ) {
        let world = self.world;
        let emitters = !SIMPLE && world.lights.has_emitters();
        if emitters && world.lights.emitters.has_objects() {
            self.surface_emission(hit);
        }
        self.ambient_light::<SIMPLE>(bouncing);
        self.delta_lights::<SIMPLE>();
        if let Some(choice) = &world.lights.choice {
            self.chosen_lights::<SIMPLE>(choice);
        }
        if !SIMPLE && !world.mirrors.is_empty() && self.interaction.direct_mask.any() {
            self.mirror_light();
        }
        if emitters {
            let rays = rays(self);
            self.emitter_lighting(&rays);
        }
    }

    /// Replaces the rays of the paths by reflected rays, with directions sampled from the
    /// reflection lobes. Returns the lanes whose paths continue: their new throughput is at least
    /// [`min_throughput`](World::min_throughput).
    #[inline(always)]
    pub fn sample_reflection<const SIMPLE: bool>(&mut self) -> L::Mask {
        let (world, interaction, query) = (self.world, self.interaction, self.query());
        let throughput = self.path.throughput;
        let mut numbers = None;
        for (index, lanes) in interaction.bsdfs(interaction.reflecting) {
            let bsdf = &world.bsdfs[index];
            let uv = self.lobe_numbers(bsdf.is_delta(), &mut numbers);
            let path = &mut *self.path;
            let sample = bsdf.sample(&query, uv);
            let mut direction = sample.direction;
            if !SIMPLE && world.smooth {
                direction = interaction.reflect_into_hemisphere(direction);
            }
            if !SIMPLE && world.lights.has_emitters() {
                let pdf = eval_lobe(world, interaction, &query, index, direction).density;
                let pdf = world.thrown(interaction.primitive, path.lobe_pdf, pdf);
                path.lobe_pdf = L::select(lanes, pdf, path.lobe_pdf);
            }
            path.ray.direction = Vec3::select(lanes, direction, path.ray.direction);
            let throughput = Path::bounded(throughput.component_mul(sample.weight));
            path.throughput = Vec3::select(lanes, throughput, path.throughput);
        }
        self.path.ray.origin = interaction.ray_origin();
        self.path.passed = L::zero();
        interaction.reflecting & world.reaches_min_throughput(self.path.throughput)
    }

    /// Returns the query of BSDFs at the hit points.
    #[inline(always)]
    pub fn query(&self) -> BsdfQuery<L> {
        BsdfQuery {
            incident: self.path.ray.direction,
            normal: self.interaction.normal,
            fold: self.world.fold,
        }
    }

    /// Returns the random numbers of samples of a lobe; zeros if it is a mirror (`is_delta`).
    /// `numbers` holds them once they are computed, because all lobes of a packet share them.
    #[inline(always)]
    pub fn lobe_numbers(&mut self, is_delta: bool, numbers: &mut Option<(L, L)>) -> (L, L) {
        if is_delta {
            return (L::zero(), L::zero());
        }
        self.out.counts.glossy = true;
        let shared = numbers.unwrap_or_else(
            #[inline(always)]
            || self.sampler.lobe_2d(self.bounce),
        );
        *numbers = Some(shared);
        shared
    }
}
