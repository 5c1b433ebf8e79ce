//! A bounding volume hierarchy for scenes with many items, walked by whole packets.

use super::batch::Ray;
use crate::lanes::{Lanes, Mask, Real, V3};
use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{BvhBuildParams, bvh2::Bvh2};
use std::time::Duration;

/// One box of the tree.
struct Node<S> {
    low: [S; 3],
    high: [S; 3],
    /// First child, or first entry of `order` for a leaf.
    first: u32,
    /// Number of items in a leaf; 0: an inner node with children `first` and `first + 1`.
    count: u32,
}

/// A binary tree of boxes over items.
pub struct Tree<L: Lanes> {
    nodes: Vec<Node<L::Scalar>>,
    /// Items in the order of the leaves.
    order: Vec<u32>,
    depth: usize,
}

/// The boxes of the builder are single precision: rounded outward by a few units in the last place
/// of the largest coordinate, which is also what an item's own test may err by, in any direction.
fn padded(low: DVec3, high: DVec3) -> Aabb {
    let reach = low.abs().max(high.abs()).max_element();
    let pad = DVec3::splat(reach * f64::from(4.0 * f32::EPSILON));
    Aabb::new(Vec3A::from((low - pad).as_vec3()), Vec3A::from((high + pad).as_vec3()))
}

impl<L: Lanes> Tree<L> {
    /// Over the boxes of all items, in item order.
    pub fn new(bounds: &[(DVec3, DVec3)]) -> Self {
        let boxes: Vec<Aabb> = bounds.iter().map(|(low, high)| padded(*low, *high)).collect();
        let mut spent = Duration::ZERO;
        let bvh: Bvh2 = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut spent);
        let corner = |v: Vec3A| v.to_array().map(|c| L::Scalar::of(f64::from(c)));
        let nodes = bvh
            .nodes
            .iter()
            .map(|n| Node {
                low: corner(n.aabb().min),
                high: corner(n.aabb().max),
                first: n.first_index,
                count: n.prim_count,
            })
            .collect();
        let depth = bvh.max_depth.max(96);
        Self { nodes, order: bvh.primitive_indices, depth }
    }

    /// Calls `leaf(item, limit)` for the items whose boxes the packet may meet, nearer ones first as
    /// far as the tree knows; `leaf` returns the distance beyond which nothing matters any more.
    /// Items at that very distance are still called for.
    #[inline(always)]
    pub fn walk(&self, ray: &Ray<L>, mut limit: L, mut leaf: impl FnMut(usize, L) -> L) {
        let safe = |d: L| L::one() / d.abs().max(L::of(1e-30)).copysign(d);
        let inverse = V3::new(safe(ray.direction.x), safe(ray.direction.y), safe(ray.direction.z));
        // What an item's own test rounds off of a distant origin must not be cut off by its box: the
        // boxes grow by a few roundings of the origin.
        let pad = ray.origin.max_abs() * L::of(4.0 * L::EPSILON);
        let pad = V3::new(pad, pad, pad);
        let line = Line { above: ray.origin + pad, below: ray.origin - pad, inverse };
        let mut stack: Vec<u32> = Vec::with_capacity(self.depth);
        if self.nodes.is_empty() || entry(&self.nodes[0], &line, limit).is_none() {
            return;
        }
        stack.push(0);
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at as usize];
            if node.count > 0 {
                for i in node.first..node.first + node.count {
                    limit = leaf(self.order[i as usize] as usize, limit);
                }
                continue;
            }
            let left = entry(&self.nodes[node.first as usize], &line, limit);
            let right = entry(&self.nodes[node.first as usize + 1], &line, limit);
            match (left, right) {
                (Some(l), Some(r)) => {
                    let (near, far) = if l <= r { (0, 1) } else { (1, 0) };
                    stack.push(node.first + far);
                    stack.push(node.first + near);
                }
                (Some(_), None) => stack.push(node.first),
                (None, Some(_)) => stack.push(node.first + 1),
                (None, None) => {}
            }
        }
    }
}

/// A packet as the box test wants it.
struct Line<L> {
    /// Origins, moved up and down by their rounding.
    above: V3<L>,
    below: V3<L>,
    /// One over the direction, never infinite.
    inverse: V3<L>,
}

/// Where the first of the lanes that meet a box no farther than `limit` enters it; `None` if none
/// does.
///
/// The far side is moved out by two roundings, so that no hit is lost (Ize 2013, *Robust BVH Ray
/// Traversal*).
#[inline(always)]
fn entry<L: Lanes>(node: &Node<L::Scalar>, line: &Line<L>, limit: L) -> Option<f64> {
    let t0 = (V3::splat(node.low) - line.above).times(line.inverse);
    let t1 = (V3::splat(node.high) - line.below).times(line.inverse);
    let near = t0.x.min(t1.x).max(t0.y.min(t1.y)).max(t0.z.min(t1.z)).max(L::zero());
    let far = t0.x.max(t1.x).min(t0.y.max(t1.y)).min(t0.z.max(t1.z));
    let far = far * L::of(1.0 + 4.0 * L::EPSILON);
    let meets = near.le(far) & near.le(limit);
    let bits = meets.bits();
    if bits == 0 {
        return None;
    }
    Some(near.lane(bits.trailing_zeros() as usize).to_f64())
}
