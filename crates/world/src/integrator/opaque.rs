//! Integrator of worlds without transmission (Whitted 1980). At each hit it computes direct
//! lighting and continues the path with one reflected ray, sampled from the reflection lobe.

use crate::integrator::Integrator;
use crate::integrator::emitter_lighting::{ReflectedRays, visible_emitters};
use crate::integrator::indirect_diffuse::DiffuseReservoir;
use crate::integrator::interaction::interact;
use crate::integrator::nested_dielectrics::MediumStack;
use crate::integrator::path::{Path, Radiance};
use crate::integrator::vertex::{Vertex, add_background};
use zerkalo_kernel::lanes::{Mask, SimdFloat, next_distinct};

impl<L: SimdFloat> Integrator<'_, L> {
    /// Traces paths in a world without transmissive surfaces, and adds their radiance to `out`. The
    /// paths start in the lanes `active`. `path` is overwritten. `reservoir` collects the hits from
    /// which indirect diffuse light may bounce.
    ///
    /// `SIMPLE` is the value of [`World::simple`](crate::World::simple), here and in all called
    /// functions. It is `false` if the world has indirect diffuse light.
    #[inline(never)]
    pub fn trace_opaque<const SIMPLE: bool>(
        &self,
        path: &mut Path<L>,
        mut active: L::Mask,
        mut reservoir: Option<&mut DiffuseReservoir<L>>,
        out: &mut Radiance<L>,
    ) {
        let Self { world, sampler, mut candidates, depth } = *self;
        for bounce in 0.. {
            out.counts.add_rays(active);
            let hit = if SIMPLE {
                world.geometry.closest_linear(&path.ray, &candidates.primary, active)
            } else {
                world.geometry.closest_masked(&path.ray, &candidates.primary, active)
            };
            if !SIMPLE {
                visible_emitters(world, path, hit.t, active, None, out);
            }
            active = add_background(world, path, hit.t, active, None, out);
            let Some(first) = next_distinct(hit.primitive, active) else { return };
            let mut interaction = interact::<_, SIMPLE>(world, &path.ray, &hit, first, active);
            if let Some(turned) = &world.turned {
                turned.divide(&mut interaction, sampler, out);
            }
            let is_last = bounce == depth;
            let mut vertex = Vertex {
                world,
                path: &mut *path,
                interaction: &interaction,
                candidates,
                sampler,
                bounce,
                media: None,
                out: &mut *out,
            };
            let mut bouncing = None;
            if !SIMPLE && let Some(reservoir) = &mut reservoir {
                bouncing = Some(reservoir.offer(&vertex, &MediumStack::vacuum(), None));
            }
            let walks = reservoir.as_ref().and_then(|reservoir| reservoir.walk);
            let mut followed = if is_last { L::mask(false) } else { interaction.reflecting };
            if !SIMPLE && let Some(walk) = walks {
                followed = followed & walk.may_reflect;
            }
            vertex.shade::<SIMPLE>(&hit, bouncing, |_| ReflectedRays {
                lanes: followed,
                share: L::one(),
            });
            if !SIMPLE && let (Some(_), Some(reservoir)) = (walks, &mut reservoir) {
                reservoir.choose_way(&vertex, followed);
            } else if is_last || interaction.reflecting.none() {
                return;
            }
            active = vertex.sample_reflection::<SIMPLE>();
            if !SIMPLE && let (Some(_), Some(reservoir)) = (walks, &mut reservoir) {
                return reservoir.go_on(&mut vertex, active);
            }
            if active.none() {
                return;
            }
            candidates = &world.culling.all_candidates;
        }
    }
}
