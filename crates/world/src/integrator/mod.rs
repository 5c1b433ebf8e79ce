//! Integrators: radiance along camera rays.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

pub(crate) mod bounce_queue;
mod box_tree;
pub(crate) mod clear_panes;
pub(crate) mod coincident_surfaces;
pub(crate) mod direct_lighting;
mod emitter_lighting;
mod environment_lighting;
pub(crate) mod first_hit;
pub(crate) mod indirect_diffuse;
mod interaction;
mod interface_lighting;
pub(crate) mod mirror_light;
pub(crate) mod nested_dielectrics;
mod opaque;
pub(crate) mod path;
pub(crate) mod surface_textures;
mod transmission;
pub(crate) mod turned_material;
mod vertex;

use crate::culling::tile::TileCandidates;
use crate::integrator::bounce_queue::BounceQueue;
use crate::integrator::path::{Path, Radiance};
use crate::integrator::transmission::{Branch, TransmissionIntegrator};
use crate::world::World;
use zerkalo_kernel::lanes::{Double, SimdFloat, Single, Vec3};
use zerkalo_kernel::sampling::{PacketSampler, Sampler};

/// Inputs that all paths of a packet share.
#[derive(Clone, Copy)]
pub(crate) struct Integrator<'a, L: SimdFloat> {
    pub world: &'a World<L>,
    pub sampler: &'a PacketSampler<'a, L>,
    /// Candidates of camera rays, and of the shadow rays from their hit points. All later rays are
    /// tested against all primitives.
    pub candidates: &'a TileCandidates,
    /// Largest number of surfaces on a path after the first.
    pub depth: u32,
}

impl<L: SimdFloat> World<L> {
    /// Traces one packet of paths from the camera, and overwrites `path`. Lanes outside `active`
    /// stay black. `candidates` are the primitives that the camera rays and the shadow rays from
    /// their hit points are tested against; `None` means all primitives. `queue` gets the paths of
    /// diffuse bounces, if there is one; they are black without `BounceQueue::finish`.
    #[inline(always)]
    pub fn trace(
        &self,
        path: &mut Path<L>,
        candidates: Option<&TileCandidates>,
        sampler: &PacketSampler<'_, L>,
        active: L::Mask,
        out: &mut Radiance<L>,
        queue: Option<&mut BounceQueue<L>>,
    ) {
        for group in &mut out.groups[..self.info.scales.len()] {
            *group = Vec3::zero();
        }
        out.met = [L::mask(false); path::MAX_ORDER];
        let candidates = candidates.unwrap_or(&self.culling.all_candidates);
        let integrator = Integrator { world: self, sampler, candidates, depth: self.depth };
        if let Some(limits) = self.diffuse_limits {
            integrator.trace_generations(limits, path.ray, active, out, queue);
        } else if let Some(nested_dielectrics) = &self.nested_dielectrics {
            let mut start = Branch::camera(path.ray, active);
            nested_dielectrics.add_at_start(&path.ray, &mut start.media);
            TransmissionIntegrator { base: integrator, nested_dielectrics }
                .trace(&mut start, None, out);
        } else {
            match self.simple {
                true => integrator.trace_opaque::<true>(path, active, None, out),
                false => integrator.trace_opaque::<false>(path, active, None, out),
            }
        }
    }
}

/// Type of [`World::trace`] for the SIMD type `L`.
type Trace<L> = fn(
    &World<L>,
    &mut Path<L>,
    Option<&TileCandidates>,
    &PacketSampler<'_, L>,
    <L as SimdFloat>::Mask,
    &mut Radiance<L>,
    Option<&mut BounceQueue<L>>,
);

/// Type of `BounceQueue::finish` for the SIMD type `L`.
type Finish<L> = fn(&mut BounceQueue<L>, &World<L>, &Sampler<L>, &mut Radiance<L>);

/// [`World::trace`] and `BounceQueue::finish` in both precisions. No code reads this static: it
/// makes the compiler generate the machine code of the kernels in this crate, so that other crates
/// call it instead of generating their own.
#[doc(hidden)]
pub static KERNELS: (Trace<Single>, Trace<Double>, Finish<Single>, Finish<Double>) =
    (World::trace, World::trace, BounceQueue::finish, BounceQueue::finish);
