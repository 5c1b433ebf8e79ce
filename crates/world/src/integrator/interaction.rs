//! Surface interactions: normals, ray offsets and BSDFs at the hit points of a packet.

use crate::integrator::surface_textures::{ShadingPoints, albedo_factor, shading_normal};
use crate::world::World;
use zerkalo_kernel::bvh::{Hit, Ray};
use zerkalo_kernel::lanes::{Mask, SimdFloat, Vec3, distinct};

/// Surface properties at the hit points of a packet.
pub(crate) struct SurfaceInteraction<L: SimdFloat> {
    /// Unit shading normal, on the side from which the rays arrive.
    pub normal: Vec3<L>,
    /// Unit geometric normal, on the side from which the rays arrive. It differs from `normal` only
    /// on smooth meshes and bump-mapped surfaces.
    pub geometric: Vec3<L>,
    /// Vector from the origins of secondary rays to those of shadow rays, see
    /// [`Aggregate::shading_normal`](zerkalo_kernel::primitive::Aggregate::shading_normal). `None`
    /// without smooth meshes, so that other scenes do not pay for it.
    pub lift: Option<Vec3<L>>,
    pub point: Vec3<L>,
    /// Distance of the origins of secondary rays from the surface.
    pub offset: L,
    /// Lanes whose rays hit the side to which the normal of the primitive points.
    pub front: L::Mask,
    /// Ids of the primitives that are hit.
    pub primitive: L,
    /// Index of the BSDF in each lane, stored as an id (see [`SimdFloat::from_id`]).
    pub bsdf: L,
    /// Factor of the albedo from textures and vertex colours.
    pub albedo_factor: Vec3<L>,
    /// Diffuse albedo.
    pub diffuse: Vec3<L>,
    /// Lanes with a BSDF: all except for the back of one-sided surfaces.
    pub has_bsdf: L::Mask,
    /// Lanes whose BSDF has a diffuse part or highlights.
    pub direct_mask: L::Mask,
    /// Lanes whose BSDF has highlights.
    pub highlight_mask: L::Mask,
    /// Lanes whose BSDF reflects rays to what its highlight shows.
    pub reflected_highlight: L::Mask,
    /// Lanes whose BSDF has a reflection lobe.
    pub reflecting: L::Mask,
    /// Lanes whose surface no light reaches, because a coincident surface is in front of it.
    pub covered: L::Mask,
}

impl<L: SimdFloat> SurfaceInteraction<L> {
    /// Iterates over the BSDFs in `lanes`: the index of each, and the lanes that have it.
    #[inline(always)]
    pub fn bsdfs(&self, lanes: L::Mask) -> impl Iterator<Item = (usize, L::Mask)> {
        distinct(self.bsdf, lanes).map(|(index, lanes)| (index as usize, lanes))
    }

    /// Returns the origins of rays that leave on the side of the incoming rays.
    #[inline(always)]
    pub fn ray_origin(&self) -> Vec3<L> {
        self.geometric.mul_add(self.offset, self.point)
    }

    /// Returns the origins of rays that leave on the side opposite to the incoming rays.
    #[inline(always)]
    pub fn ray_origin_behind(&self) -> Vec3<L> {
        self.geometric.mul_add(-self.offset, self.point)
    }

    /// Removes the BSDF from the hit points in `lanes`.
    #[inline(always)]
    pub fn mask_out(&mut self, lanes: L::Mask) {
        self.has_bsdf = self.has_bsdf.and_not(lanes);
        self.direct_mask = self.direct_mask.and_not(lanes);
        self.highlight_mask = self.highlight_mask.and_not(lanes);
        self.reflecting = self.reflecting.and_not(lanes);
    }

    /// Covers the hit points in `lanes`: no lights are sampled for them.
    #[inline(always)]
    pub fn cover(&mut self, lanes: L::Mask) {
        self.direct_mask = self.direct_mask.and_not(lanes);
        self.covered = self.covered | lanes;
    }

    /// Returns the mirror image of `direction` at the geometric surface.
    #[inline(always)]
    pub fn mirrored(&self, direction: Vec3<L>) -> Vec3<L> {
        let height = direction.dot(self.geometric);
        self.geometric.mul_add(height * L::from_f64(-2.0), direction)
    }

    /// Returns `direction`, mirrored at the geometric surface where it points into this surface.
    #[inline(always)]
    pub fn reflect_into_hemisphere(&self, direction: Vec3<L>) -> Vec3<L> {
        let height = direction.dot(self.geometric).min(L::zero());
        self.geometric.mul_add(height * L::from_f64(-2.0), direction)
    }

    /// Replaces the hit points in `lanes` by the hit points of `other`. All masks of `self` must be
    /// `false` in these lanes, and both must have the primitives of the whole packet.
    #[inline(always)]
    fn blend(&mut self, lanes: L::Mask, other: &Self) {
        *self = Self {
            normal: Vec3::select(lanes, other.normal, self.normal),
            geometric: Vec3::select(lanes, other.geometric, self.geometric),
            lift: match (self.lift, other.lift) {
                (None, None) => None,
                (own, other) => {
                    let [own, other] = [own, other].map(|lift| lift.unwrap_or(Vec3::zero()));
                    Some(Vec3::select(lanes, other, own))
                }
            },
            point: Vec3::select(lanes, other.point, self.point),
            offset: L::select(lanes, other.offset, self.offset),
            front: self.front | other.front,
            primitive: self.primitive,
            bsdf: L::select(lanes, other.bsdf, self.bsdf),
            albedo_factor: Vec3::select(lanes, other.albedo_factor, self.albedo_factor),
            diffuse: Vec3::select(lanes, other.diffuse, self.diffuse),
            has_bsdf: self.has_bsdf | other.has_bsdf,
            direct_mask: self.direct_mask | other.direct_mask,
            highlight_mask: self.highlight_mask | other.highlight_mask,
            reflected_highlight: self.reflected_highlight | other.reflected_highlight,
            reflecting: self.reflecting | other.reflecting,
            covered: self.covered | other.covered,
        };
    }
}

/// Computes the surface properties at the hits of the active rays. `first` is the first result of
/// [`distinct`] for the primitives that are hit.
#[inline(always)]
pub(crate) fn interact<L: SimdFloat, const SIMPLE: bool>(
    world: &World<L>,
    ray: &Ray<L>,
    hit: &Hit<L>,
    first: (u32, L::Mask),
    active: L::Mask,
) -> SurfaceInteraction<L> {
    let (primitive, lanes) = first;
    let remaining = active.and_not(lanes);
    if remaining.none() {
        interact_one::<_, SIMPLE>(world, ray, hit, primitive, lanes)
    } else {
        interact_mixed::<_, SIMPLE>(world, ray, hit, first, remaining)
    }
}

/// Computes the surface properties if rays hit several primitives. The lanes `remaining` hit other
/// primitives than the first.
#[inline(never)]
fn interact_mixed<L: SimdFloat, const SIMPLE: bool>(
    world: &World<L>,
    ray: &Ray<L>,
    hit: &Hit<L>,
    (first, first_lanes): (u32, L::Mask),
    remaining: L::Mask,
) -> SurfaceInteraction<L> {
    let mut interaction = interact_one::<_, SIMPLE>(world, ray, hit, first, first_lanes);
    for (primitive, lanes) in distinct(hit.primitive, remaining) {
        interaction.blend(lanes, &interact_one::<_, SIMPLE>(world, ray, hit, primitive, lanes));
    }
    interaction
}

/// Computes the surface properties at the hits of `lanes`, all on `primitive`.
#[inline(always)]
fn interact_one<L: SimdFloat, const SIMPLE: bool>(
    world: &World<L>,
    ray: &Ray<L>,
    hit: &Hit<L>,
    primitive: u32,
    lanes: L::Mask,
) -> SurfaceInteraction<L> {
    let surface = world.geometry.surface(primitive, hit.triangle, ray.at(hit.t));
    // At a silhouette edge, rounding of the hit point may select a face that points away from the
    // ray. If rays hit the primitive only from outside, the hit counts as a hit on the front in any
    // case.
    let outside_only = L::mask(world.outside_only[primitive as usize]);
    let front = outside_only | surface.normal.dot(ray.direction).lt(L::zero());
    let geometric = Vec3::select(front, surface.normal, -surface.normal);
    let index = world.bsdf_of[primitive as usize];
    let bsdf = &world.bsdfs[index as usize];
    let (mut normal, mut lift) = (geometric, None);
    // The points are built at each use, because a shared instance would be spilled to memory in
    // worlds without textures.
    let shading_points = || ShadingPoints { primitive, triangle: hit.triangle, surface, lanes };
    if !SIMPLE && world.smooth {
        (normal, lift) =
            shading_normal(world, &shading_points(), (front, geometric), ray.direction);
    }
    let mut factor = Vec3::of([1.0; 3]);
    let mut diffuse = Vec3::splat(bsdf.diffuse);
    if !SIMPLE
        && world.colored
        && let Some(color) = albedo_factor(world, &shading_points())
    {
        (factor, diffuse) = (color, diffuse.component_mul(color));
    }
    let has_bsdf = if bsdf.two_sided { lanes } else { lanes & front };
    let lanes_if = |has_lobe: bool| if has_lobe { has_bsdf } else { L::mask(false) };
    SurfaceInteraction {
        normal,
        geometric,
        lift,
        albedo_factor: factor,
        point: surface.point,
        offset: surface.ray_offset(),
        front: front & lanes,
        primitive: hit.primitive,
        bsdf: L::from_id(index),
        diffuse,
        has_bsdf,
        direct_mask: lanes_if(bsdf.has_direct),
        highlight_mask: lanes_if(bsdf.has_highlight()),
        reflected_highlight: lanes_if(bsdf.reflects_highlight()),
        reflecting: lanes_if(bsdf.reflection.is_some()),
        covered: L::mask(false),
    }
}
