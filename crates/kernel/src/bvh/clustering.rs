//! Binary BVH by locally ordered clustering (Meister and Bittner 2018, *Parallel Locally-Ordered
//! Clustering for Bounding Volume Hierarchy Construction*), in O(n log n) for every input.
//!
//! A pass over the nodes, in the order of the Morton curve, merges every pair of nodes that are
//! nearest to each other. A pass may find only one such pair if many distances are equal, as with
//! coincident boxes, boxes in a row or the triangles of a fan. After [`PATIENT_VISITS`], passes
//! that find few pairs merge neighbours on the curve instead.

use crate::bvh::binary::{Aabb, BinaryBvh, BinaryNode};
use crate::bvh::morton::morton_code;
use glam::{DVec3, Vec3A};

/// Number of node visits per primitive, summed over all passes, after which a slow pass merges
/// neighbours on the Morton curve: the 1st and 2nd node, the 3rd and 4th, and so on. Boxes at
/// random positions need 3 visits per primitive in total.
const PATIENT_VISITS: usize = 8;

/// Number of nodes per merged pair above which a pass counts as slow.
const SLOW: usize = 16;

/// Index in [`Nearest`] that stands for "no nearest node found".
const NONE: u32 = u32::MAX;

/// Window on the Morton curve in which a pass searches for the nearest node of each node.
#[derive(Clone, Copy, Debug)]
pub struct SearchWindow {
    /// Number of initial passes that search only the previous and the next node.
    pub narrow_passes: usize,
    /// Number of nodes on each side of a node that the later passes search.
    pub distance: usize,
}

/// Nearest node of a node: half the surface area of the box around both, and the index of the
/// nearest node among the nodes of the present pass.
type Nearest = (f32, u32);

/// Builds a binary BVH of the boxes `bounds`, at least one, with one primitive in each leaf.
/// Returns the BVH and the number of passes.
pub fn cluster(bounds: &[Aabb], window: SearchWindow) -> (BinaryBvh, usize) {
    let count = bounds.len();
    let mut nodes = sorted_leaves(bounds);
    let mut merged = Vec::with_capacity(count);
    let mut nearest_of = vec![(f32::INFINITY, NONE); count];
    let mut tree = vec![BinaryNode::default(); 2 * count - 1];
    let (mut free, mut passes, mut visits) = (tree.len(), 0, 0);
    while nodes.len() > 1 {
        let distance = if passes < window.narrow_passes { 1 } else { window.distance };
        let nearest = &mut nearest_of[..nodes.len()];
        find_nearest(&nodes, distance, nearest);
        visits += nodes.len();
        if visits > PATIENT_VISITS * count && mutual_pairs(nearest) * SLOW < nodes.len() {
            pair_neighbours(nearest);
        }
        for (i, node) in nodes.iter().enumerate() {
            let partner = nearest[i].1;
            if partner == NONE || nearest[partner as usize].1 as usize != i {
                merged.push(*node);
            } else if (partner as usize) < i {
                let other = nodes[partner as usize];
                free -= 2;
                (tree[free], tree[free + 1]) = (*node, other);
                let aabb = node.aabb.union(&other.aabb);
                merged.push(BinaryNode { aabb, primitives: 0, first: free as u32 });
            }
        }
        std::mem::swap(&mut nodes, &mut merged);
        merged.clear();
        passes += 1;
    }
    tree[0] = nodes[0];
    (BinaryBvh { nodes: tree, order: (0..count as u32).collect() }, passes)
}

/// Returns a leaf for each box, in the order of the Morton codes of the boxes' centres.
fn sorted_leaves(bounds: &[Aabb]) -> Vec<BinaryNode> {
    let low = bounds.iter().map(|b| b.min).fold(Vec3A::INFINITY, Vec3A::min);
    let high = bounds.iter().map(|b| b.max).fold(Vec3A::NEG_INFINITY, Vec3A::max);
    let scale: DVec3 = 1.0 / (high - low).as_dvec3();
    let code = |aabb: &Aabb| {
        let from_low = 0.5 * (aabb.min + aabb.max).as_dvec3() - low.as_dvec3();
        morton_code((from_low * scale).to_array())
    };
    let mut codes: Vec<(u64, u64)> =
        bounds.iter().enumerate().map(|(i, aabb)| (code(aabb), i as u64)).collect();
    codes.sort_unstable_by_key(|(code, _)| *code);
    let leaf = |i: u64| BinaryNode { aabb: bounds[i as usize], primitives: 1, first: i as u32 };
    codes.iter().map(|(_, i)| leaf(*i)).collect()
}

/// Writes to `nearest` the nearest node of each node among the `distance` nodes before and after
/// it: the one for which the box around both has the smallest surface area. Of several with equal
/// areas, the last one counts.
fn find_nearest(nodes: &[BinaryNode], distance: usize, nearest: &mut [Nearest]) {
    nearest.fill((f32::INFINITY, NONE));
    for (i, node) in nodes.iter().enumerate() {
        let end = nodes.len().min(i + distance + 1);
        let mut best = nearest[i];
        for j in i + 1..end {
            let area = node.aabb.union(&nodes[j].aabb).half_area();
            if area <= best.0 {
                best = (area, j as u32);
            }
            if area <= nearest[j].0 {
                nearest[j] = (area, i as u32);
            }
        }
        nearest[i] = best;
    }
}

/// Returns the number of pairs of nodes that are nearest to each other.
fn mutual_pairs(nearest: &[Nearest]) -> usize {
    let ends_pair = |(i, (_, j)): &(usize, &Nearest)| {
        (*j as usize) < *i && nearest[*j as usize].1 as usize == *i
    };
    nearest.iter().enumerate().filter(ends_pair).count()
}

/// Pairs successive nodes: 0 and 1, 2 and 3, and so on. The last of an odd number has no partner.
fn pair_neighbours(nearest: &mut [Nearest]) {
    let paired = nearest.len() & !1;
    for (i, (_, partner)) in nearest.iter_mut().enumerate() {
        *partner = if i < paired { (i ^ 1) as u32 } else { NONE };
    }
}
