//! Intersection of rays with the triangles of one mesh, in the space of the mesh.
//!
//! The rays of a coherent packet traverse the BVH together; the rays of other packets traverse it
//! separately. Both ways test a triangle by the same operations, so that they find the same hits.

use crate::bvh::packet::{
    PacketBounds, SlabPacket, broadcast, load_wide, traverse_packet, valid_lanes, with_stack,
};
use crate::bvh::single::traverse_rays;
use crate::bvh::{BVH_WIDTH, Ray};
use crate::lanes::{Float, Frame, MAX_WIDTH, Mask, SimdFloat, Vec3, prefetch};
use crate::primitive::mesh::{Mesh, TriangleBlock};

/// Coherence limit of a mesh with one triangle. With n triangles, the argument `turn` of
/// [`Ray::is_coherent`] is this limit divided by sqrt(n), and `shift` is `turn` times the size of
/// the mesh.
///
/// Measured by `benches/mesh.rs` (lines `together or apart`): packets of eight rays are faster than
/// single rays up to differences of 0.3 with 1,000 triangles, 0.1 with 70,000, 0.02 with a million.
/// For packets of four rays, these limits are at most half as large.
const COHERENCE_LIMIT: f64 = 2.5;

/// Upper limit of `turn` of [`Ray::is_coherent`]. It takes effect for meshes of fewer than about
/// 3900 triangles.
const MAX_COHERENT_SPREAD: f64 = 0.04;

/// Closest hit of each ray with the triangles of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct TriangleHit<L> {
    /// Distance of the hit; the distance limit of the search without a hit.
    pub t: L,
    /// Id of the triangle; undefined without a hit.
    pub triangle: L,
}

/// Rays with the frames of the watertight triangle test: the rays of a packet, or one ray repeated
/// in every lane.
#[derive(Clone, Copy)]
struct ShearedRay<L> {
    origin: Vec3<L>,
    frame: Frame<L>,
}

/// Prepares slab tests that enlarge boxes by the rounding errors of the triangle tests.
#[inline(always)]
fn slab_packet<L: SimdFloat>(ray: &Ray<L>, mesh: &Mesh) -> SlabPacket<L> {
    let [low, high] = mesh.mesh.bounds;
    let reach = low.iter().chain(&high).fold(0.0f32, |m, x| m.max(x.abs()));
    let pad = (ray.origin.max_abs() + broadcast(reach)) * L::from_f64(8.0 * L::EPSILON);
    SlabPacket::new(ray, Vec3::new(pad, pad, pad))
}

impl<L: SimdFloat> ShearedRay<L> {
    #[inline(always)]
    fn new(ray: &Ray<L>) -> Self {
        Self { origin: ray.origin, frame: Frame::around(ray.direction) }
    }

    /// Returns the origin and the three frame axes of each ray.
    #[inline(always)]
    fn each(&self) -> [[[L::Scalar; 3]; 4]; MAX_WIDTH] {
        let Frame { t, b, n } = self.frame;
        let mut each = [[[L::Scalar::default(); 3]; 4]; MAX_WIDTH];
        for (lane, one) in each.iter_mut().enumerate().take(L::WIDTH) {
            *one = [self.origin, t, b, n].map(|v| v.lane(lane));
        }
        each
    }

    /// Repeats one ray, an element of [`ShearedRay::each`], in every lane.
    #[inline(always)]
    fn only(one: &[[L::Scalar; 3]; 4]) -> Self {
        let [origin, t, b, n] = one.map(Vec3::splat);
        Self { origin, frame: Frame { t, b, n } }
    }

    /// Returns the distance at which each ray hits either side of the triangle with these corners,
    /// and the lanes that hit it.
    ///
    /// The corners are projected along the ray. A corner has the same projection in all triangles
    /// that share it, and the area that an edge spans with the ray's origin is computed with the
    /// exact sign, or as 0. Hence no ray passes between two triangles that share an edge or a
    /// corner (after Woop, Benthin and Wald 2013, *Watertight Ray/Triangle Intersection*, with an
    /// orthonormal frame for the shear).
    ///
    /// In a [`thin`](Mesh::thin) mesh `t` comes from the triangle's plane, because the areas at the
    /// edges have an error of their length squared.
    #[inline(always)]
    fn intersect<const THIN: bool>(&self, corners: [Vec3<L>; 3]) -> (L, L::Mask) {
        let p = corners.map(|c| self.frame.to_local(c - self.origin));
        // The products are rounded separately, without fused multiply-add, so that the difference
        // never has the wrong sign.
        let area = |a: Vec3<L>, b: Vec3<L>| a.x * b.y - a.y * b.x;
        let (u, v, w) = (area(p[1], p[2]), area(p[2], p[0]), area(p[0], p[1]));
        let zero = L::zero();
        let left = u.ge(zero) & v.ge(zero) & w.ge(zero);
        let right = u.le(zero) & v.le(zero) & w.le(zero);
        let inside = left | right;
        if THIN {
            if inside.none() {
                return (zero, inside);
            }
            let normal = (p[1] - p[0]).exact_cross(p[2] - p[0]);
            let t = normal.dot(p[0]) / normal.z;
            return (t, inside & t.gt(zero));
        }
        // The t of an edge-on triangle, without area, is 0 / 0, which counts as no hit.
        let t = (u * p[0].z + v * p[1].z + w * p[2].z) / (u + v + w);
        (t, inside & t.gt(zero))
    }

    /// Returns the corners of consecutive triangles of a leaf, one triangle per lane. The first one
    /// has the index `part` times the number of lanes.
    #[inline(always)]
    fn corners(leaf: &TriangleBlock, part: usize) -> [Vec3<L>; 3] {
        leaf.corners.each_ref().map(|c| {
            let axis = |a: usize| load_wide(&c[a], part);
            Vec3::new(axis(0), axis(1), axis(2))
        })
    }
}

/// Traversal of a mesh's BVH. If `ANY` is `true`, a ray ends at the first triangle found. `THIN` is
/// the mesh's [`thin`](Mesh::thin): as a constant it costs other meshes nothing.
struct MeshTraversal<'a, const ANY: bool, const THIN: bool> {
    mesh: &'a Mesh,
}

impl<const ANY: bool, const THIN: bool> MeshTraversal<'_, ANY, THIN> {
    /// Traverses the mesh's BVH with the packet as a whole.
    #[inline(always)]
    fn traverse_as_packet<L: SimdFloat>(
        &self,
        ray: &Ray<L>,
        packet: &SlabPacket<L>,
        limit: L,
    ) -> TriangleHit<L> {
        let sheared_ray = ShearedRay::new(ray);
        let wanted = limit.gt(L::zero()).bits();
        let mut found = TriangleHit { t: limit, triangle: L::from_id(0) };
        if wanted == 0 {
            return found;
        }
        let bounds = PacketBounds::around(packet, wanted);
        let boxes = &self.mesh.boxes;
        let leaf = |number: usize, _| {
            let leaf = &self.mesh.leaves[number];
            let first = self.mesh.firsts[number];
            for part in 0..BVH_WIDTH.div_ceil(L::WIDTH) {
                let [a, b, c] = ShearedRay::<L>::corners(leaf, part);
                // Bounding boxes of the triangles, one per lane. A triangle is tested only if the
                // packet may enter its box.
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                let sides = [low.x, low.y, low.z, high.x, high.y, high.z];
                let bits = match &bounds {
                    Some(bounds) => {
                        bounds.enters::<false, L>(|k| sides[k], L::from_f64(L::MAX)).1.bits()
                    }
                    None => valid_lanes(),
                };
                let mut bits = bits & valid_lanes() & ((1 << L::WIDTH) - 1);
                while bits != 0 {
                    let i = part * L::WIDTH + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    let broadcast_corner = |c: &[[f32; BVH_WIDTH]; 3]| {
                        Vec3::new(broadcast(c[0][i]), broadcast(c[1][i]), broadcast(c[2][i]))
                    };
                    let corners = leaf.corners.each_ref().map(broadcast_corner);
                    let (t, hit_mask) = sheared_ray.intersect::<THIN>(corners);
                    let tie = hit_mask & t.le(found.t);
                    if tie.none() {
                        continue;
                    }
                    let number = L::from_id(first + i as u32);
                    let nearer = tie & (t.lt(found.t) | number.lt(found.triangle));
                    let t = if ANY { L::from_f64(-1.0) } else { t };
                    found.t = L::select(nearer, t, found.t);
                    found.triangle = L::select(nearer, number, found.triangle);
                }
            }
            found.t
        };
        with_stack::<_, _, 128, 512>(BVH_WIDTH, boxes, |stack| {
            traverse_packet(boxes, packet, bounds.as_ref(), limit, stack, leaf)
        });
        found
    }

    /// Traverses the mesh's BVH with the packet as a whole if it is coherent, otherwise with each
    /// ray separately.
    #[inline(always)]
    fn run<L: SimdFloat>(&self, ray: &Ray<L>, limit: L) -> TriangleHit<L> {
        let packet = slab_packet(ray, self.mesh);
        let [low, high] = self.mesh.mesh.bounds;
        let size = (0..3).map(|i| f64::from(high[i]) - f64::from(low[i])).fold(0.0, f64::max);
        let turn = COHERENCE_LIMIT / (self.mesh.mesh.triangles.len() as f64).sqrt();
        let turn = turn.min(MAX_COHERENT_SPREAD);
        if ray.is_coherent(limit.gt(L::zero()).bits(), turn, turn * size) {
            return self.traverse_as_packet(ray, &packet, limit);
        }
        self.traverse_separately(ray, &packet, limit)
    }

    /// Traverses the mesh's BVH with each ray of the packet separately.
    #[inline(always)]
    fn traverse_separately<L: SimdFloat>(
        &self,
        ray: &Ray<L>,
        packet: &SlabPacket<L>,
        limit: L,
    ) -> TriangleHit<L> {
        let rays = ShearedRay::new(ray).each();
        let mut found = [(L::Scalar::default(), 0u32); MAX_WIDTH];
        for (lane, found) in found.iter_mut().enumerate().take(L::WIDTH) {
            *found = (limit.lane(lane), 0);
        }
        let leaf = |lane: usize, number: usize, limit: L::Scalar| {
            let leaf = &self.mesh.leaves[number];
            let sheared_ray = ShearedRay::<L>::only(&rays[lane]);
            let (best, triangle) = &mut found[lane];
            for part in 0..BVH_WIDTH.div_ceil(L::WIDTH) {
                let corners = ShearedRay::corners(leaf, part);
                let (t, hit_mask) = sheared_ray.intersect::<THIN>(corners);
                let mut bits = (hit_mask & t.le(L::splat(*best))).bits() & valid_lanes();
                while bits != 0 {
                    let lane = bits.trailing_zeros();
                    bits &= bits - 1;
                    let t = t.lane(lane as usize);
                    let number = self.mesh.firsts[number] + (part * L::WIDTH) as u32 + lane;
                    if t < *best || t == *best && number < *triangle {
                        (*best, *triangle) = (t, number);
                    }
                }
            }
            if ANY && *best < limit { L::Scalar::from_f64(-1.0) } else { *best }
        };
        let soon = |number: usize| {
            let rows = self.mesh.leaves[number].corners.as_flattened();
            rows.iter().step_by(2).for_each(prefetch);
        };
        let boxes = &self.mesh.boxes;
        with_stack::<_, _, 64, 128>(L::WIDTH, boxes, |stack| {
            traverse_rays(boxes, packet, limit, stack, soon, leaf)
        });
        let t = L::from_fn(|i| found[i].0);
        let t = if ANY { L::select(t.lt(limit), L::from_f64(-1.0), limit) } else { t };
        TriangleHit { t, triangle: L::from_fn(|i| L::from_id(found[i].1).lane(i)) }
    }
}

/// Returns the closest triangle that each ray hits within the distance `limit`; at equal distances
/// the triangle with the lowest number. Lanes with a limit of 0 or less are inactive.
#[inline(never)]
pub fn closest<L: SimdFloat>(mesh: &Mesh, ray: &Ray<L>, limit: L) -> TriangleHit<L> {
    match mesh.thin {
        true => MeshTraversal::<false, true> { mesh }.run(ray, limit),
        false => MeshTraversal::<false, false> { mesh }.run(ray, limit),
    }
}

/// Returns the lanes whose ray hits a triangle of the mesh nearer than `limit`.
#[inline(never)]
pub fn occluded<L: SimdFloat>(mesh: &Mesh, ray: &Ray<L>, limit: L) -> L::Mask {
    let hit = match mesh.thin {
        true => MeshTraversal::<true, true> { mesh }.run(ray, limit),
        false => MeshTraversal::<true, false> { mesh }.run(ray, limit),
    };
    hit.t.lt(limit)
}

/// Returns the result of [`closest`], for tests and benches. The rays traverse the BVH as a packet
/// if `all` is `true`, otherwise separately.
#[inline(never)]
pub fn closest_with<L: SimdFloat>(
    mesh: &Mesh,
    ray: &Ray<L>,
    limit: L,
    all: bool,
) -> TriangleHit<L> {
    let (packet, walk) = (slab_packet(ray, mesh), MeshTraversal::<false, false> { mesh });
    if all {
        walk.traverse_as_packet(ray, &packet, limit)
    } else {
        walk.traverse_separately(ray, &packet, limit)
    }
}
