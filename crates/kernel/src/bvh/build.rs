//! Eight-wide BVH (BVH8): node layout and build. A node stores the bounds of its eight children as
//! a structure of arrays. The build clusters the primitives into a binary BVH, optimises it by
//! reinsertion, and collapses it into wide nodes.

use crate::bvh::binary::{Aabb, BinaryBvh, BinaryNode};
use crate::bvh::clustering::{SearchWindow, cluster};
use crate::bvh::reinsertion::optimize;
use glam::Vec3A;

/// Number of children of a node.
pub const BVH_WIDTH: usize = 8;

/// Bit of a child index that marks a leaf.
pub const LEAF_FLAG: u32 = 1 << 31;

/// Inner node of a BVH8. An unused slot holds an empty box, which no ray intersects.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub struct Bvh8Node {
    /// Bounds of the children: lowest x, y and z, then highest x, y and z, one number per child.
    pub bounds: [[f32; BVH_WIDTH]; 6],
    /// Children: index of an inner node, or [`LEAF_FLAG`] | index of a leaf.
    pub child: [u32; BVH_WIDTH],
}

const EMPTY_NODE: Bvh8Node = {
    let (low, high) = ([f32::INFINITY; BVH_WIDTH], [f32::NEG_INFINITY; BVH_WIDTH]);
    Bvh8Node { bounds: [low, low, low, high, high, high], child: [LEAF_FLAG; BVH_WIDTH] }
};

impl Bvh8Node {
    /// Iterates over the slots that hold a child.
    pub fn children(&self) -> impl Iterator<Item = usize> {
        (0..BVH_WIDTH).filter(|i| self.bounds[0][*i] <= self.bounds[3][*i])
    }
}

/// Eight-wide bounding volume hierarchy.
#[derive(Debug)]
pub struct Bvh8 {
    /// Inner nodes; the first one is the root.
    pub nodes: Vec<Bvh8Node>,
    /// Largest number of inner nodes on a path from the root to a leaf.
    pub depth: usize,
}

/// Effort of a BVH build.
#[derive(Clone, Copy, Debug)]
pub struct BuildQuality {
    /// Window in which the clustering searches for the nearest node of each node.
    pub window: SearchWindow,
    /// Share of the nodes, 0 to 1, that reinsertion may move before small leaves are merged.
    pub reinsertion: f32,
    /// Share of the nodes, 0 to 1, that reinsertion may move after small leaves have been merged.
    pub second_reinsertion: f32,
    /// Cost of a node visit divided by the cost of a primitive's intersection test, for the surface
    /// area heuristic. A higher cost gives larger leaves.
    pub traversal_cost: f32,
}

impl BuildQuality {
    /// Short build, for a million triangles or more. Leaves may be large, because SIMD tests all
    /// triangles of a leaf at once.
    pub const FAST: Self = Self {
        window: SearchWindow { narrow_passes: 2, distance: 6 },
        reinsertion: 0.02,
        second_reinsertion: 0.0,
        traversal_cost: 8.0,
    };
    /// Longer build, for primitives whose intersection tests take much time.
    pub const MEDIUM: Self = Self {
        window: SearchWindow { narrow_passes: 3, distance: 14 },
        reinsertion: 0.05,
        second_reinsertion: 0.1,
        traversal_cost: 3.0,
    };
}

/// Result of a BVH build.
pub struct Bvh8Build {
    /// Hierarchy, whose leaf indices refer to `leaves`.
    pub bvh: Bvh8,
    /// Indices of all primitives, grouped by leaf.
    pub order: Vec<u32>,
    /// Primitives of each leaf: position of the first one in `order`, and their number.
    pub leaves: Vec<(u32, u32)>,
}

impl Bvh8 {
    /// Builds the BVH of `count` primitives, at least one. `corners(i)` is the low and the high
    /// corner of the bounding box of primitive `i`. A leaf holds at most `in_leaf` primitives.
    pub fn build(
        count: usize,
        corners: impl Fn(usize) -> [[f32; 3]; 2],
        in_leaf: usize,
        quality: BuildQuality,
    ) -> Bvh8Build {
        let bounds_of = |i: usize| {
            let [min, max] = corners(i).map(Vec3A::from_array);
            Aabb { min, max }
        };
        let bounds: Vec<Aabb> = (0..count).map(bounds_of).collect();
        let (mut binary, _) = cluster(&bounds, quality.window);
        drop(bounds);
        optimize(&mut binary, quality.reinsertion);
        binary.merge_leaves(in_leaf as u32, quality.traversal_cost);
        optimize(&mut binary, quality.second_reinsertion);
        Bvh8Build::collapse(binary)
    }

    /// Returns the memory of the inner nodes in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<Bvh8Node>() * self.nodes.len()
    }
}

impl Bvh8Build {
    /// Collapses `binary` into eight-wide nodes. Leaves keep their primitives.
    fn collapse(binary: BinaryBvh) -> Self {
        let plan = CollapsePlan::new(&binary);
        let mut todo = vec![(0usize, 0usize, 1usize)];
        let (mut wide_nodes, mut leaves, mut max_depth) = (vec![EMPTY_NODE], Vec::new(), 0);
        let mut children = Vec::with_capacity(BVH_WIDTH);
        while let Some((binary_index, wide_index, depth)) = todo.pop() {
            max_depth = depth.max(max_depth);
            children.clear();
            plan.children(&binary.nodes, binary_index, &mut children);
            let mut new = EMPTY_NODE;
            for (i, child) in children.iter().enumerate() {
                let n = &binary.nodes[*child];
                let (low, high) = (n.aabb.min.to_array(), n.aabb.max.to_array());
                for axis in 0..3 {
                    new.bounds[axis][i] = low[axis];
                    new.bounds[axis + 3][i] = high[axis];
                }
                if n.is_leaf() {
                    new.child[i] = LEAF_FLAG | leaves.len() as u32;
                    leaves.push((n.first, n.primitives));
                } else {
                    new.child[i] = wide_nodes.len() as u32;
                    todo.push((*child, wide_nodes.len(), depth + 1));
                    wide_nodes.push(EMPTY_NODE);
                }
            }
            wide_nodes[wide_index] = new;
        }
        let bvh = Bvh8 { nodes: wide_nodes, depth: max_depth };
        Self { bvh, order: binary.order, leaves }
    }
}

/// Optimal collapse of a binary BVH into wide nodes. It minimises the sum of the surface areas of
/// the wide nodes, and thus the expected number of node visits of a random ray (Ylitie, Karras and
/// Laine 2017, *Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs*).
struct CollapsePlan {
    /// Numbers of child slots of a wide node for the two children of each binary node i.
    /// `splits[i][0]` applies if node i becomes a wide node, and divides its eight slots.
    /// `splits[i][n - 1]`, n from 2 to 8, applies if the subtree of node i takes n slots of a wide
    /// node above; `[0, 0]` means that node i itself takes one slot.
    splits: Vec<[[u8; 2]; BVH_WIDTH]>,
}

impl CollapsePlan {
    /// Computes the optimal division of slots for each node of `binary`.
    fn new(binary: &BinaryBvh) -> Self {
        let nodes = &binary.nodes;
        let mut splits = vec![[[0; 2]; BVH_WIDTH]; nodes.len()];
        // `costs[i][n - 1]` is the smallest sum of the areas of wide nodes in the subtree of node
        // i, if this subtree may take n slots of a wide node.
        let mut costs = vec![[0.0f32; BVH_WIDTH]; nodes.len()];
        // Constant that is added to the area of every wide node, so that none is free of cost.
        let least_area = 1e-7 * nodes[0].aabb.half_area() + f32::MIN_POSITIVE;
        for number in binary.parents_first().into_iter().rev() {
            let node = &nodes[number];
            if node.is_leaf() {
                continue;
            }
            let first = node.first as usize;
            let best_split = |slots: usize| {
                let splits = (1..slots).map(|k| {
                    (costs[first][k - 1] + costs[first + 1][slots - k - 1], [k, slots - k])
                });
                let best = splits.min_by(|a, b| a.0.total_cmp(&b.0));
                best.map_or((f32::INFINITY, [0; 2]), |(cost, split)| {
                    (cost, split.map(|slots| slots as u8))
                })
            };
            let (children_cost, split) = best_split(BVH_WIDTH);
            let mut cost = [children_cost + node.aabb.half_area() + least_area; BVH_WIDTH];
            splits[number][0] = split;
            for slots in 2..=BVH_WIDTH {
                let (split_cost, split) = best_split(slots);
                (cost[slots - 1], splits[number][slots - 1]) =
                    if split_cost < cost[0] { (split_cost, split) } else { (cost[0], [0; 2]) };
            }
            costs[number] = cost;
        }
        Self { splits }
    }

    /// Appends to `out` the binary nodes that become the children of the wide node for `node`.
    fn children(&self, nodes: &[BinaryNode], node: usize, out: &mut Vec<usize>) {
        let mut todo = Vec::with_capacity(BVH_WIDTH);
        let split = |todo: &mut Vec<(usize, u8)>, node: usize, [left, right]: [u8; 2]| {
            let first = nodes[node].first as usize;
            todo.extend([(first + 1, right), (first, left)]);
        };
        if nodes[node].is_leaf() {
            out.push(node);
        } else {
            split(&mut todo, node, self.splits[node][0]);
        }
        while let Some((node, slots)) = todo.pop() {
            match self.splits[node][usize::from(slots) - 1] {
                both if slots > 1 && both != [0; 2] => split(&mut todo, node, both),
                _ => out.push(node),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the low and the high corner of test box `i`. Its sides are 2 to 6 times `size`.
    /// Boxes 3k, 3k + 1 and 3k + 2 contain the same point of a spiral.
    fn corners(i: usize, size: f32) -> [[f32; 3]; 2] {
        let angle = (i - i % 3) as f32;
        let center = [angle.sin() * angle, angle.cos() * angle, 0.3 * angle];
        [center.map(|x| x - size), center.map(|x| x + size * (1.0 + (i % 5) as f32))]
    }

    /// Builds the hierarchy of `count` boxes with sides of 2 to 6 times `size`, and at most
    /// `in_leaf` boxes in a leaf. Checks that every box is in exactly one leaf, and inside all
    /// nodes on the path to that leaf.
    fn check_build(count: usize, size: f32, in_leaf: usize) {
        check_family(|i| corners(i, size), count, in_leaf, BuildQuality::FAST);
    }

    /// Checks the hierarchy of `count` boxes as [`check_build`] does. `corners(i)` is the low and
    /// the high corner of box `i`. `quality` is the effort of the build.
    fn check_family(
        corners: impl Fn(usize) -> [[f32; 3]; 2],
        count: usize,
        in_leaf: usize,
        quality: BuildQuality,
    ) {
        let built = Bvh8::build(count, &corners, in_leaf, quality);
        let (bvh, mut visits) = (&built.bvh, vec![0; count]);
        let mut todo = vec![(0u32, 1, Vec::new())];
        let mut deepest = 0;
        while let Some((node, depth, ancestors)) = todo.pop() {
            deepest = depth.max(deepest);
            let node = &bvh.nodes[node as usize];
            for slot in node.children() {
                let mut boxes: Vec<[f32; 6]> = ancestors.clone();
                boxes.push(node.bounds.map(|side| side[slot]));
                let child = node.child[slot];
                if child & LEAF_FLAG == 0 {
                    todo.push((child, depth + 1, boxes));
                    continue;
                }
                let (first, primitives) = built.leaves[(child & !LEAF_FLAG) as usize];
                assert!((1..=in_leaf).contains(&(primitives as usize)), "{primitives} in a leaf");
                for primitive in &built.order[first as usize..][..primitives as usize] {
                    visits[*primitive as usize] += 1;
                    let [low, high] = corners(*primitive as usize);
                    let inside =
                        |b: &[f32; 6]| (0..3).all(|a| b[a] <= low[a] && high[a] <= b[a + 3]);
                    assert!(boxes.iter().all(inside), "{primitive} of {count}");
                }
            }
        }
        assert!(visits.iter().all(|n| *n == 1), "{count}, {in_leaf} a leaf: {visits:?}");
        assert_eq!(deepest, bvh.depth);
    }

    #[test]
    fn bvh_holds_every_primitive_in_one_leaf_and_in_all_ancestor_boxes() {
        for count in [1, 2, 3, 7, 8, 9, 64, 65, 1000] {
            for size in [0.0, 0.1, 30.0] {
                check_build(count, size, 1);
                check_build(count, size, 8);
            }
        }
    }

    /// Set of test boxes: a function that returns the low and the high corner of the box with the
    /// given number.
    type Family = fn(usize) -> [[f32; 3]; 2];

    /// Sets of test boxes, each with a name, for which clustering by nearest neighbours alone is
    /// slow, because the distances between neighbours are equal or grow steadily.
    const FAMILIES: [(&str, Family); 8] = [
        ("one box", |_| [[0.0; 3], [1.0; 3]]),
        ("one point", |_| [[0.5; 3]; 2]),
        ("two boxes", |i| [[(i % 2) as f32 * 9.0; 3], [(i % 2) as f32 * 9.0 + 1.0; 3]]),
        ("a row", |i| [[i as f32, 0.0, 0.0], [i as f32 + 0.5, 0.5, 0.5]]),
        ("nested, growing", |i| [[-1.0 - i as f32; 3], [1.0 + i as f32; 3]]),
        ("nested, shrinking", |i| [[i as f32 - 1e6; 3], [1e6 - i as f32; 3]]),
        ("common corner", |i| [[0.0; 3], [1.0, i as f32 * 1e-6, 0.0]]),
        ("doubling gaps", |i| {
            let x = (i as f32 * 4e-3).exp2();
            [[x, 0.0, 0.0], [x * 1.1, 1.0, 1.0]]
        }),
    ];

    fn boxes(family: Family, count: usize) -> Vec<Aabb> {
        let aabb = |i: usize| {
            let [min, max] = family(i).map(Vec3A::from_array);
            Aabb { min, max }
        };
        (0..count).map(aabb).collect()
    }

    /// Checks that the clustering of 4,000 boxes of each set in [`FAMILIES`] takes at most 95
    /// passes. Each pass takes time proportional to the number of remaining nodes. Without merges
    /// of neighbours on the Morton curve, 2,000 to 4,000 passes would be needed.
    #[test]
    fn clustering_of_coincident_boxes_takes_few_passes() {
        for (name, family) in FAMILIES {
            for quality in [BuildQuality::FAST, BuildQuality::MEDIUM] {
                let (_, passes) = cluster(&boxes(family, 4000), quality.window);
                assert!(passes <= 95, "{name}: {passes} passes");
            }
        }
    }

    #[test]
    fn bvh_of_coincident_boxes_holds_every_primitive() {
        for (_, family) in FAMILIES {
            check_family(family, 700, 1, BuildQuality::MEDIUM);
            check_family(family, 700, 8, BuildQuality::FAST);
        }
    }

    /// Returns the processor time of this thread in seconds.
    fn cpu_seconds() -> f64 {
        let times = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
        times.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
    }

    /// Checks that a build with twice as many boxes takes at most 2.3 times as long, up to a
    /// million boxes, and that a million equal boxes take less than two seconds. Clustering by
    /// nearest neighbours alone takes quadratic time for most sets in [`FAMILIES`]: over a minute
    /// for 100,000 boxes.
    ///
    /// cargo test --release --test kernel -- --ignored --nocapture builds_of_coincident_boxes
    #[test]
    #[ignore = "takes a minute, and needs an optimised build"]
    fn builds_of_coincident_boxes_take_linear_time() {
        for (name, family) in FAMILIES {
            for (in_leaf, quality) in [(8, BuildQuality::FAST), (1, BuildQuality::MEDIUM)] {
                let seconds = [125_000, 250_000, 500_000, 1_000_000].map(|count| {
                    let least = (0..3).map(|_| {
                        let start = cpu_seconds();
                        Bvh8::build(count, family, in_leaf, quality);
                        cpu_seconds() - start
                    });
                    least.fold(f64::INFINITY, f64::min)
                });
                println!("{name:20} leaves of {in_leaf}: {seconds:.3?} s");
                assert!(!name.starts_with("one ") || seconds[3] < 2.0, "{name}: {seconds:?}");
                let growth = (seconds[3] / seconds[0]).cbrt();
                assert!(growth < 2.3, "{name}: {growth} for twice the boxes, {seconds:?}");
            }
        }
    }
}
