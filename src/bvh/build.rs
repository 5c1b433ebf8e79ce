//! A tree of boxes, up to eight a branch, each coordinate of the eight side by side, so that one ray, or
//! what bounds a packet of rays, meets eight of them at once.
//!
//! A binary tree by a library, its nodes joined so that branches are few and full.

use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use std::time::Duration;

/// Boxes of a branch.
pub const BVH_WIDTH: usize = 8;

/// Marks a child that is a leaf.
pub const LEAF_FLAG: u32 = 1 << 31;

/// Eight boxes of a tree. Places without one hold a box that nothing meets.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub struct Bvh8Node {
    /// Smallest coordinates of the boxes on the three axes, then the largest.
    pub bounds: [[f32; BVH_WIDTH]; 6],
    /// What is in each box: the number of a branch, or of a leaf and [`LEAF_FLAG`].
    pub child: [u32; BVH_WIDTH],
}

const EMPTY_NODE: Bvh8Node = Bvh8Node {
    bounds: [
        [f32::INFINITY; BVH_WIDTH],
        [f32::INFINITY; BVH_WIDTH],
        [f32::INFINITY; BVH_WIDTH],
        [f32::NEG_INFINITY; BVH_WIDTH],
        [f32::NEG_INFINITY; BVH_WIDTH],
        [f32::NEG_INFINITY; BVH_WIDTH],
    ],
    child: [LEAF_FLAG; BVH_WIDTH],
};

impl Bvh8Node {
    /// Numbers of the places that hold a box.
    pub fn children(&self) -> impl Iterator<Item = usize> {
        (0..BVH_WIDTH).filter(|i| self.bounds[0][*i] <= self.bounds[3][*i])
    }
}

/// The tree.
#[derive(Debug)]
pub struct Bvh8 {
    branches: Vec<Bvh8Node>,
    depth: usize,
}

/// What a tree was built into.
pub struct Bvh8Build {
    /// The tree.
    pub boxes: Bvh8,
    /// The things in the order of the leaves.
    pub order: Vec<u32>,
    /// For each leaf its first place in `order` and its number of things.
    pub leaves: Vec<(u32, u32)>,
}

impl Bvh8 {
    /// Over `count` things, at least one; `corners`: of the box around each. At most `in_leaf` of them
    /// share a leaf.
    pub fn build(
        count: usize,
        corners: impl Fn(usize) -> [[f32; 3]; 2],
        in_leaf: usize,
        quality: BvhBuildParams,
    ) -> Bvh8Build {
        let around = |i: usize| {
            let [low, high] = corners(i).map(Vec3A::from_array);
            Aabb::new(low, high)
        };
        let boxes: Vec<Aabb> = (0..count).map(around).collect();
        let params = BvhBuildParams { max_prims_per_leaf: in_leaf as u32, ..quality };
        let binary = build_bvh2(&boxes, params, &mut Duration::default());
        let mut built = Bvh8Build {
            boxes: Self { branches: Vec::new(), depth: 0 },
            order: Vec::new(),
            leaves: Vec::new(),
        };
        built.collapse(&binary);
        built.order = binary.primitive_indices;
        built
    }

    /// The branches; the first is the root.
    pub fn branches(&self) -> &[Bvh8Node] {
        &self.branches
    }

    /// The most branches on a way from the root to a leaf.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// Memory that it takes \[bytes\].
    pub fn bytes(&self) -> usize {
        size_of::<Bvh8Node>() * self.branches.len()
    }
}

impl Bvh8Build {
    /// Makes branches and leaves of the nodes of a binary tree.
    fn collapse(&mut self, binary: &Bvh2) {
        let nodes = &binary.nodes;
        let groups = CollapsePlan::of(nodes);
        let mut todo = vec![(0usize, 0usize, 1usize)];
        let branches = &mut self.boxes.branches;
        branches.push(EMPTY_NODE);
        let mut inside = Vec::with_capacity(BVH_WIDTH);
        while let Some((node, branch, depth)) = todo.pop() {
            self.boxes.depth = self.boxes.depth.max(depth);
            inside.clear();
            groups.inside(nodes, node, &mut inside);
            let mut new = EMPTY_NODE;
            for (i, node) in inside.iter().enumerate() {
                let n = &nodes[*node];
                let (low, high) = (n.aabb().min.to_array(), n.aabb().max.to_array());
                for axis in 0..3 {
                    new.bounds[axis][i] = low[axis];
                    new.bounds[axis + 3][i] = high[axis];
                }
                if n.is_leaf() {
                    new.child[i] = LEAF_FLAG | self.leaves.len() as u32;
                    self.leaves.push((n.first_index, n.prim_count));
                } else {
                    new.child[i] = branches.len() as u32;
                    todo.push((*node, branches.len(), depth + 1));
                    branches.push(EMPTY_NODE);
                }
            }
            branches[branch] = new;
        }
    }
}

/// How the nodes of a binary tree are joined to branches so that a random ray meets the fewest: the sum
/// of the areas of the boxes around branches is the least (Ylitie, Karras and Laine 2017, *Efficient
/// Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*, without their choice of leaves).
struct CollapsePlan {
    /// For each node and each number of boxes from 1 to [`BVH_WIDTH`], how many of these the first child's part
    /// of the tree takes, and how many the second's; none: the node's own box is one of them. For one box:
    /// the split of the branch that the node becomes.
    splits: Vec<[[u8; 2]; BVH_WIDTH]>,
}

impl CollapsePlan {
    fn of(nodes: &[Bvh2Node]) -> Self {
        let mut splits = vec![[[0; 2]; BVH_WIDTH]; nodes.len()];
        // The least sum of areas of a node's part of the tree in at most so many boxes.
        let mut costs = vec![[0.0f32; BVH_WIDTH]; nodes.len()];
        // Branches of boxes without an area are not for nothing.
        let least_area = 1e-7 * nodes[0].aabb().half_area() + f32::MIN_POSITIVE;
        let mut order = vec![0];
        for at in 0.. {
            let Some(node) = order.get(at) else { break };
            let node: &Bvh2Node = &nodes[*node];
            if !node.is_leaf() {
                let first = node.first_index as usize;
                order.extend([first, first + 1]);
            }
        }
        for number in order.into_iter().rev() {
            let node = &nodes[number];
            if node.is_leaf() {
                continue;
            }
            let first = node.first_index as usize;
            let least = |boxes: usize| {
                let splits = (1..boxes).map(|k| {
                    (costs[first][k - 1] + costs[first + 1][boxes - k - 1], [k, boxes - k])
                });
                let least = splits.min_by(|a, b| a.0.total_cmp(&b.0));
                least.map_or((f32::INFINITY, [0; 2]), |(cost, split)| {
                    (cost, split.map(|boxes| boxes as u8))
                })
            };
            let (inside, split) = least(BVH_WIDTH);
            let mut cost = [inside + node.aabb().half_area() + least_area; BVH_WIDTH];
            splits[number][0] = split;
            for boxes in 2..=BVH_WIDTH {
                let (apart, split) = least(boxes);
                (cost[boxes - 1], splits[number][boxes - 1]) =
                    if apart < cost[0] { (apart, split) } else { (cost[0], [0; 2]) };
            }
            costs[number] = cost;
        }
        Self { splits }
    }

    /// Collects the nodes whose boxes the branch holds that `node` becomes.
    fn inside(&self, nodes: &[Bvh2Node], node: usize, out: &mut Vec<usize>) {
        let mut todo = Vec::with_capacity(BVH_WIDTH);
        let split = |todo: &mut Vec<(usize, u8)>, node: usize, [left, right]: [u8; 2]| {
            let first = nodes[node].first_index as usize;
            todo.extend([(first + 1, right), (first, left)]);
        };
        if nodes[node].is_leaf() {
            out.push(node);
        } else {
            split(&mut todo, node, self.splits[node][0]);
        }
        while let Some((node, boxes)) = todo.pop() {
            match self.splits[node][usize::from(boxes) - 1] {
                both if boxes > 1 && both != [0; 2] => split(&mut todo, node, both),
                _ => out.push(node),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of about `size` along a spiral, some of them at one place.
    fn corners(i: usize, size: f32) -> [[f32; 3]; 2] {
        let at = (i - i % 3) as f32;
        let middle = [at.sin() * at, at.cos() * at, 0.3 * at];
        [middle.map(|x| x - size), middle.map(|x| x + size * (1.0 + (i % 5) as f32))]
    }

    /// Everything lies in one leaf, and in all the boxes on the way to it.
    fn holds(count: usize, size: f32, in_leaf: usize) {
        let built = Bvh8::build(count, |i| corners(i, size), in_leaf, BvhBuildParams::fast_build());
        let (boxes, mut met) = (&built.boxes, vec![0; count]);
        let mut todo = vec![(0u32, 1, Vec::new())];
        let mut deepest = 0;
        while let Some((branch, depth, around)) = todo.pop() {
            deepest = depth.max(deepest);
            let branch = &boxes.branches()[branch as usize];
            for place in branch.children() {
                let mut around: Vec<[f32; 6]> = around.clone();
                around.push(branch.bounds.map(|side| side[place]));
                let child = branch.child[place];
                if child & LEAF_FLAG == 0 {
                    todo.push((child, depth + 1, around));
                    continue;
                }
                let (first, things) = built.leaves[(child & !LEAF_FLAG) as usize];
                assert!((1..=in_leaf).contains(&(things as usize)), "{things} things in a leaf");
                for thing in &built.order[first as usize..][..things as usize] {
                    met[*thing as usize] += 1;
                    let [low, high] = corners(*thing as usize, size);
                    let inside =
                        |b: &[f32; 6]| (0..3).all(|a| b[a] <= low[a] && high[a] <= b[a + 3]);
                    assert!(around.iter().all(inside), "{thing} of {count}");
                }
            }
        }
        assert!(met.iter().all(|n| *n == 1), "{count} things, {in_leaf} a leaf: {met:?}");
        assert_eq!(deepest, boxes.depth());
    }

    #[test]
    fn everything_is_in_one_leaf_and_in_the_boxes_above_it() {
        for count in [1, 2, 3, 7, 8, 9, 64, 65, 1000] {
            for size in [0.0, 0.1, 30.0] {
                holds(count, size, 1);
                holds(count, size, 8);
            }
        }
    }
}
