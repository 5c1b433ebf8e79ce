//! The paths: camera rays, the light that surfaces return, reflections.

use crate::bvh::{Hit, Ray};
use crate::lanes::{Mask, SimdFloat, Vec3};
use crate::material::ReflectionLobe;
use crate::sampling::PacketSampler;
use crate::world::compile::World;
use crate::world::culling::tile::TileCandidates;
use crate::world::integrator::surface_textures::ShadingPoints;
use crate::world::light_groups::MAX_GROUPS;
use std::f64::consts::FRAC_1_PI;

/// The radiance of a packet's samples, per light group, for unit white light.
pub struct Radiance<L> {
    /// The first [`World::groups`] are used.
    pub groups: [Vec3<L>; MAX_GROUPS],
}

/// What a packet cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    /// Rays of every kind.
    pub rays: u64,
    /// A glossy lobe was met, or one of two rays was chosen by chance.
    pub glossy: bool,
}

/// Where a packet's paths are.
#[derive(Clone, Copy)]
pub(crate) struct Path<L> {
    pub ray: Ray<L>,
    /// What radiance from along the ray counts.
    pub throughput: Vec3<L>,
}

impl<L: SimdFloat> Path<L> {
    /// Weights above this saturate the film; infinity times black would be no number.
    const MAX_THROUGHPUT: f64 = (1u64 << 60) as f64;

    /// `weight`, finite where mirrors amplify without end.
    #[inline(always)]
    pub fn bounded(weight: Vec3<L>) -> Vec3<L> {
        let most = L::from_f64(Self::MAX_THROUGHPUT);
        Vec3::new(most.min(weight.x), most.min(weight.y), most.min(weight.z))
    }
}

/// The surfaces that a packet met.
pub(crate) struct SurfaceInteraction<L: SimdFloat> {
    /// Normal on the viewer's side that light is computed with.
    pub normal: Vec3<L>,
    /// The surface's own, on the viewer's side: the same but on smooth meshes and bumps. Light comes from that side.
    pub geometric: Vec3<L>,
    /// Where the rays end, on the surface.
    pub point: Vec3<L>,
    /// How far from there rays start that leave the surface.
    pub offset: L,
    /// Lanes that met the side that the surface's own normal points to.
    pub front: L::Mask,
    /// Tag of the item.
    pub item: L,
    /// Tag of the finish.
    bsdf: L,
    /// Colour of the thing itself, which multiplies its finish's.
    albedo_factor: Vec3<L>,
    /// k_d x colour.
    diffuse: Vec3<L>,
    /// Lanes with a finish: all but those that met the back of a one-sided one.
    has_bsdf: L::Mask,
    /// Lanes whose finish answers lights.
    direct_mask: L::Mask,
    /// Lanes whose finish has highlights.
    highlight_mask: L::Mask,
    /// Lanes whose finish reflects.
    pub reflecting: L::Mask,
}

/// The first lane's tag, and the lanes of `mask` that share it; `None`: the mask is empty.
#[inline(always)]
pub(crate) fn next_distinct<L: SimdFloat>(tags: L, mask: L::Mask) -> Option<(u32, L::Mask)> {
    let bits = mask.bits();
    if bits == 0 {
        return None;
    }
    let tag = tags.id_lane(bits.trailing_zeros() as usize);
    Some((tag, mask & tags.id_eq(tag)))
}

impl<L: SimdFloat> SurfaceInteraction<L> {
    /// Each finish that occurs among `lanes`, with its lanes.
    #[inline(always)]
    pub fn bsdfs(&self, lanes: L::Mask) -> impl Iterator<Item = (usize, L::Mask)> {
        let (finish, mut left) = (self.bsdf, lanes);
        std::iter::from_fn(move || {
            let (tag, here) = next_distinct(finish, left)?;
            left = left.and_not(here);
            Some((tag as usize, here))
        })
    }

    /// Origin of rays that leave on the viewer's side.
    #[inline(always)]
    pub fn ray_origin(&self) -> Vec3<L> {
        self.geometric.mul_add(self.offset, self.point)
    }

    /// Origin of rays that leave on the other side.
    #[inline(always)]
    pub fn ray_origin_behind(&self) -> Vec3<L> {
        self.geometric.mul_add(-self.offset, self.point)
    }

    /// In `lanes` there is no surface.
    #[inline(always)]
    pub fn mask_out(&mut self, lanes: L::Mask) {
        self.has_bsdf = self.has_bsdf.and_not(lanes);
        self.direct_mask = self.direct_mask.and_not(lanes);
        self.highlight_mask = self.highlight_mask.and_not(lanes);
        self.reflecting = self.reflecting.and_not(lanes);
    }

    /// No light comes to `lanes`.
    #[inline(always)]
    pub fn shade(&mut self, lanes: L::Mask) {
        self.direct_mask = self.direct_mask.and_not(lanes);
    }

    /// What would go into the surface goes as steeply out of it.
    #[inline(always)]
    pub fn into_hemisphere(&self, direction: Vec3<L>) -> Vec3<L> {
        let height = direction.dot(self.geometric).min(L::zero());
        self.geometric.mul_add(height * L::from_f64(-2.0), direction)
    }

    /// Takes what is `other`'s in `lanes`, which have nothing yet.
    #[inline(always)]
    fn blend(&mut self, lanes: L::Mask, other: &Self) {
        self.normal = Vec3::select(lanes, other.normal, self.normal);
        self.geometric = Vec3::select(lanes, other.geometric, self.geometric);
        self.albedo_factor = Vec3::select(lanes, other.albedo_factor, self.albedo_factor);
        self.point = Vec3::select(lanes, other.point, self.point);
        self.offset = L::select(lanes, other.offset, self.offset);
        self.front = self.front | other.front;
        self.bsdf = L::select(lanes, other.bsdf, self.bsdf);
        self.diffuse = Vec3::select(lanes, other.diffuse, self.diffuse);
        self.has_bsdf = self.has_bsdf | other.has_bsdf;
        self.direct_mask = self.direct_mask | other.direct_mask;
        self.highlight_mask = self.highlight_mask | other.highlight_mask;
        self.reflecting = self.reflecting | other.reflecting;
    }
}

impl<L: SimdFloat> World<L> {
    /// Traces one packet of camera samples: `origin` and `direction` as [`crate::camera::PinholeCamera`] makes
    /// them. Lanes outside `active` stay black. `candidates`: what these rays and the shadow rays from
    /// where they end may meet, if that is known.
    #[inline(always)]
    pub fn trace(
        &self,
        (origin, direction): (Vec3<L>, Vec3<L>),
        candidates: Option<&TileCandidates>,
        draws: &PacketSampler<'_, L>,
        active: L::Mask,
        out: &mut Radiance<L>,
    ) -> Counts {
        for group in &mut out.groups[..self.groups()] {
            *group = Vec3::zero();
        }
        let ray = Ray { origin, direction };
        let candidates = candidates.unwrap_or(&self.all_candidates);
        if let Some(nested_dielectrics) = &self.nested_dielectrics {
            self.trace_transmissive(nested_dielectrics, ray, candidates, draws, active, out)
        } else if self.simple {
            self.trace_opaque::<true>(ray, candidates, draws, active, out)
        } else {
            self.trace_opaque::<false>(ray, candidates, draws, active, out)
        }
    }

    /// [`World::trace`] for a world without media. Here and below `SIMPLE` says that the world is
    /// [plain](World::simple).
    #[inline(never)]
    fn trace_opaque<'a, const SIMPLE: bool>(
        &'a self,
        ray: Ray<L>,
        mut candidates: &'a TileCandidates,
        draws: &PacketSampler<'_, L>,
        mut active: L::Mask,
        out: &mut Radiance<L>,
    ) -> Counts {
        let mut counts = Counts::default();
        let mut path = Path { ray, throughput: Vec3::of([1.0; 3]) };
        let mut bounce = 0;
        loop {
            counts.rays += u64::from(active.bits().count_ones());
            let hit = if SIMPLE {
                self.geometry.closest_linear(&path.ray, &candidates.primary, active)
            } else {
                self.geometry.closest_masked(&path.ray, &candidates.primary, active)
            };
            let ended = hit.t.lt(L::from_f64(L::MAX));
            if let Some(group) = self.background {
                out.groups[group] += path.throughput.masked(active.and_not(ended));
            }
            active = active & ended;
            let Some(met) = self.interact::<SIMPLE>(&path.ray, &hit, active) else { return counts };
            self.direct_lighting::<SIMPLE>(&path, &met, candidates, out, &mut counts);
            if bounce == self.depth || met.reflecting.none() {
                return counts;
            }
            active = self.sample_reflection::<SIMPLE>(&mut path, &met, draws, bounce, &mut counts);
            if active.none() {
                return counts;
            }
            bounce += 1;
            candidates = &self.all_candidates;
        }
    }

    /// The surfaces where the active rays end; `None`: there are no such rays.
    #[inline(always)]
    pub(crate) fn interact<const SIMPLE: bool>(
        &self,
        ray: &Ray<L>,
        hit: &Hit<L>,
        active: L::Mask,
    ) -> Option<SurfaceInteraction<L>> {
        let (item, here) = next_distinct(hit.item, active)?;
        let others = active.and_not(here);
        Some(if others.none() {
            self.interact_one::<SIMPLE>(ray, hit, item, here)
        } else {
            self.interact_mixed::<SIMPLE>(ray, hit, (item, here), others)
        })
    }

    /// The surfaces of lanes that met several items.
    #[inline(never)]
    fn interact_mixed<const SIMPLE: bool>(
        &self,
        ray: &Ray<L>,
        hit: &Hit<L>,
        (first, here): (u32, L::Mask),
        mut left: L::Mask,
    ) -> SurfaceInteraction<L> {
        let mut met = self.interact_one::<SIMPLE>(ray, hit, first, here);
        while let Some((item, here)) = next_distinct(hit.item, left) {
            met.blend(here, &self.interact_one::<SIMPLE>(ray, hit, item, here));
            left = left.and_not(here);
        }
        met
    }

    /// The surface of one item, which the rays of `lanes` meet at `hit`.
    #[inline(always)]
    fn interact_one<const SIMPLE: bool>(
        &self,
        ray: &Ray<L>,
        hit: &Hit<L>,
        item: u32,
        lanes: L::Mask,
    ) -> SurfaceInteraction<L> {
        let surface = self.geometry.surface(item, hit.triangle, ray.at(hit.t));
        let front = surface.normal.dot(ray.direction).lt(L::zero());
        let geometric = Vec3::select(front, surface.normal, -surface.normal);
        let number = self.bsdf_of[item as usize];
        let finish = &self.bsdfs[number as usize];
        let mut normal = geometric;
        let patch = || ShadingPoints { item, facet: hit.triangle, surface, lanes };
        if !SIMPLE && self.smooth {
            normal = self.shading_normal(&patch(), (front, geometric), ray.direction);
        }
        let mut tint = Vec3::of([1.0; 3]);
        let mut diffuse = Vec3::splat(finish.diffuse);
        if !SIMPLE
            && self.colored
            && let Some(color) = self.albedo_factor(&patch())
        {
            (tint, diffuse) = (color, diffuse.component_mul(color));
        }
        let finished = if finish.two_sided { lanes } else { lanes & front };
        let those = |having: bool| if having { finished } else { L::mask(false) };
        SurfaceInteraction {
            normal,
            geometric,
            albedo_factor: tint,
            point: surface.point,
            offset: surface.ray_offset(),
            front: front & lanes,
            item: hit.item,
            bsdf: L::from_id(number),
            diffuse,
            has_bsdf: finished,
            direct_mask: those(finish.has_direct),
            highlight_mask: those(finish.has_highlight()),
            reflecting: those(finish.reflection.is_some()),
        }
    }

    /// Adds what the surfaces return of ambient light and of every lamp.
    #[inline(always)]
    pub(crate) fn direct_lighting<const SIMPLE: bool>(
        &self,
        path: &Path<L>,
        met: &SurfaceInteraction<L>,
        candidates: &TileCandidates,
        out: &mut Radiance<L>,
        counts: &mut Counts,
    ) {
        if let Some(group) = self.ambient {
            for (finish, lanes) in met.bsdfs(met.has_bsdf) {
                let mut ambient = Vec3::splat(self.bsdfs[finish].ambient);
                if !SIMPLE && self.colored {
                    ambient = ambient.component_mul(met.albedo_factor);
                }
                out.groups[group] += path.throughput.component_mul(ambient).masked(lanes);
            }
        }
        if met.direct_mask.none() {
            return;
        }
        let start = met.ray_origin();
        for (number, (source, shading)) in
            self.sources.iter().zip(&candidates.occluders).enumerate()
        {
            let arrival = source.lamp.sample_li(start);
            let nl = met.normal.dot(arrival.wi);
            let mut lit = met.direct_mask & nl.gt(L::zero());
            if !SIMPLE && self.smooth {
                lit = lit & met.geometric.dot(arrival.wi).gt(L::zero());
            }
            if lit.none() {
                continue;
            }
            if self.shadows {
                counts.rays += u64::from(lit.bits().count_ones());
                let (direction, within) = match &source.on_surface {
                    None => (arrival.wi, arrival.distance),
                    Some(on) => on.end(start),
                };
                let ray = Ray { origin: start, direction };
                let blocked = if SIMPLE {
                    self.geometry.occluded_linear(&ray, within, lit, shading)
                } else if let Some(Some(buffer)) = self.light_buffers.get(number) {
                    let on = (met.item, met.front);
                    buffer.occluded(&self.geometry, &ray, on, within, lit, shading)
                } else {
                    self.geometry.occluded(&ray, within, lit, shading)
                };
                lit = lit.and_not(blocked);
                if lit.none() {
                    continue;
                }
            }
            let mut value = met.diffuse * (nl * L::from_f64(FRAC_1_PI));
            for (finish, lanes) in met.bsdfs(met.highlight_mask & lit) {
                let (finish, view) = (&self.bsdfs[finish], -path.ray.direction);
                let nv = met.normal.dot(view);
                let shine = finish.highlight(met.normal, view, arrival.wi, nl, nv);
                value += shine.masked(lanes);
            }
            let mut value = path.throughput.component_mul(value) * arrival.irradiance;
            if let Some(emission) = source.weight {
                value = value.component_mul(Vec3::splat(emission));
            }
            out.groups[source.group] += value.masked(lit);
        }
    }

    /// Turns the paths into the directions of reflections; returns the lanes that go on.
    #[inline(always)]
    pub(crate) fn sample_reflection<const SIMPLE: bool>(
        &self,
        path: &mut Path<L>,
        met: &SurfaceInteraction<L>,
        draws: &PacketSampler<'_, L>,
        sample_reflection: u32,
        counts: &mut Counts,
    ) -> L::Mask {
        let mut numbers = None;
        let Path { ray: Ray { direction: incident, .. }, throughput: weight } = *path;
        for (finish, lanes) in met.bsdfs(met.reflecting) {
            let finish = &self.bsdfs[finish];
            let Some((emission, spread)) = &finish.reflection else { continue };
            let uv = if matches!(spread, ReflectionLobe::Mirror) {
                (L::zero(), L::zero())
            } else {
                counts.glossy = true;
                *numbers.get_or_insert_with(|| draws.lobe_2d(sample_reflection))
            };
            let r = finish.sample(*emission, spread, incident, met.normal, uv, self.fold);
            let mut out = r.direction;
            if !SIMPLE && self.smooth {
                out = met.into_hemisphere(out);
            }
            path.ray.direction = Vec3::select(lanes, out, path.ray.direction);
            let weight = Path::bounded(weight.component_mul(r.weight));
            path.throughput = Vec3::select(lanes, weight, path.throughput);
        }
        path.ray.origin = met.ray_origin();
        let strongest = path.throughput.max_element();
        met.reflecting & strongest.gt(L::zero()) & strongest.ge(L::from_f64(self.min_weight))
    }
}
