//! Optimisation of a binary BVH by reinsertion (Meister and Bittner 2018, *Parallel Reinsertion for
//! Bounding Volume Hierarchy Optimization*), with a bound on the number of node visits.
//!
//! A subtree moves to the place where the sum of all surface areas becomes smallest. The search for
//! this place skips subtrees that cannot improve the sum. If boxes are nested, it can skip none,
//! and each search would visit all nodes: hence the bound.

use crate::bvh::binary::{Aabb, BinaryBvh, BinaryNode, sibling};

/// Largest total number of node visits per node of the tree. Boxes at random positions need 1 to 3
/// visits per node, boxes that overlap heavily up to 50.
const MAX_VISITS: usize = 64;

/// Move of the subtree `from`, which becomes the sibling of the node `to`.
struct Reinsertion {
    from: u32,
    to: u32,
    /// Half of the surface area that the move saves, greater than 0.
    saved: f32,
}

/// Search for the best new position of a subtree.
struct Search {
    /// Number of node visits left, over all searches.
    visits_left: usize,
    /// Candidates for the sibling of the moved subtree: a saving and a node. The saving is half of
    /// the area saved by the removal of the subtree, minus half of the area by which its insertion
    /// enlarges the candidate's ancestors.
    stack: Vec<(f32, u32)>,
}

/// Nodes of a binary BVH, with links from children to parents.
struct LinkedTree<'a> {
    nodes: &'a mut [BinaryNode],
    /// Index of the parent of each node; 0 for the root.
    parents: Vec<u32>,
}

impl<'a> LinkedTree<'a> {
    fn new(tree: &'a mut BinaryBvh) -> Self {
        let mut parents = vec![0; tree.nodes.len()];
        for (index, node) in tree.nodes.iter().enumerate().filter(|(_, node)| !node.is_leaf()) {
            node.children().iter().for_each(|child| parents[*child] = index as u32);
        }
        Self { nodes: &mut tree.nodes, parents }
    }

    /// Stores `node` at `index`.
    fn put(&mut self, index: usize, node: BinaryNode) {
        self.nodes[index] = node;
        if !node.is_leaf() {
            node.children().iter().for_each(|child| self.parents[*child] = index as u32);
        }
    }

    /// Moves the subtree `from`, which becomes the sibling of the node `to`. The node `to` must be
    /// neither in the subtree nor its present sibling or parent.
    fn reinsert(&mut self, from: usize, to: usize) {
        let (free, parent) = (sibling(from), self.parents[from] as usize);
        // The sibling takes the place of the parent, and `to` the former place of the sibling. The
        // former place of `to` then holds the common parent of `to` and `from`.
        self.put(parent, self.nodes[free]);
        self.put(free, self.nodes[to]);
        let first = from.min(free) as u32;
        self.put(to, BinaryNode { first, primitives: 0, ..self.nodes[to] });
        self.refit(to);
        if parent != 0 {
            self.refit(self.parents[parent] as usize);
        }
    }

    /// Recomputes the boxes of the inner node `node` and of its ancestors.
    fn refit(&mut self, mut node: usize) {
        loop {
            let [left, right] = self.nodes[node].children().map(|child| self.nodes[child].aabb);
            self.nodes[node].aabb = left.union(&right);
            if node == 0 {
                return;
            }
            node = self.parents[node] as usize;
        }
    }
}

/// Moves subtrees to better places, in 16 rounds. Round n, from 1, examines `ratio / (2n - 1)` of
/// all nodes: large ones near the root. `ratio` is a share from 0 to 1.
pub fn optimize(tree: &mut BinaryBvh, ratio: f32) {
    if ratio <= 0.0 || tree.nodes[0].is_leaf() {
        return;
    }
    let mut tree = LinkedTree::new(tree);
    let mut search =
        Search { visits_left: MAX_VISITS.saturating_mul(tree.nodes.len()), stack: Vec::new() };
    let mut touched = vec![false; tree.nodes.len()];
    for round in (1..32).step_by(2) {
        let share = ratio * tree.nodes.len() as f32;
        let count = ((share * (1.0 / round as f32)) as usize).clamp(1, tree.nodes.len() - 1);
        let mut found: Vec<Reinsertion> = largest_nodes(tree.nodes, count)
            .into_iter()
            .filter_map(|node| search.best_reinsertion(&tree, node))
            .collect();
        found.sort_unstable_by(|a, b| b.saved.total_cmp(&a.saved));
        touched.fill(false);
        for Reinsertion { from, to, .. } in found {
            let [from, to] = [from as usize, to as usize];
            let parent = |node: usize| tree.parents[node] as usize;
            let moved = [to, from, sibling(from), parent(to), parent(from)];
            if moved.iter().all(|node| !touched[*node]) {
                moved.iter().for_each(|node| touched[*node] = true);
                tree.reinsert(from, to);
            }
        }
        if search.visits_left == 0 {
            break;
        }
    }
}

/// Returns the `count` nodes with the largest surface areas among nodes 1 to `2 * count + 1`.
fn largest_nodes(nodes: &[BinaryNode], count: usize) -> Vec<usize> {
    let end = nodes.len().min(2 * (count + 1));
    let area = |node: usize| nodes[node].aabb.half_area();
    let mut nodes: Vec<(f32, usize)> = (1..end).map(|node| (area(node), node)).collect();
    nodes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    nodes.into_iter().take(count).map(|(_, node)| node).collect()
}

impl Search {
    /// Counts a node visit. Returns `true` until the limit of visits is reached.
    fn visit(&mut self) -> bool {
        self.visits_left = self.visits_left.saturating_sub(1);
        self.visits_left > 0
    }

    /// Returns the best move of the subtree `node`, which must not be the root; `None` if no move
    /// saves surface area, or if the limit of visits is reached.
    fn best_reinsertion(&mut self, tree: &LinkedTree, node: usize) -> Option<Reinsertion> {
        let nodes = &*tree.nodes;
        let area = |aabb: &Aabb| aabb.half_area();
        let aabb = &nodes[node].aabb;
        let parent = tree.parents[node] as usize;
        let (mut best, mut best_saved) = (0, 0.0);
        // The removal of `node` deletes its parent and shrinks the ancestors up to `pivot`, to the
        // box `pivot_box`. `removed` is half of the surface area that the removal saves.
        let mut removed = area(&nodes[parent].aabb);
        let mut beside = sibling(node);
        let mut pivot_box = nodes[beside].aabb;
        let mut pivot = parent;
        loop {
            self.stack.clear();
            self.stack.push((removed, beside as u32));
            while let Some((saved, place)) = self.stack.pop() {
                if saved - area(aabb) <= best_saved {
                    continue;
                }
                if !self.visit() {
                    return None;
                }
                let place_node = &nodes[place as usize];
                let saved = saved - area(&place_node.aabb.union(aabb));
                if saved > best_saved {
                    (best, best_saved) = (place, saved);
                }
                if !place_node.is_leaf() {
                    let below = saved + area(&place_node.aabb);
                    self.stack.extend([0, 1].map(|i| (below, place_node.first + i)));
                }
            }
            if pivot != parent {
                pivot_box = pivot_box.union(&nodes[beside].aabb);
                removed += area(&nodes[pivot].aabb) - area(&pivot_box);
            }
            if pivot == 0 {
                break;
            }
            if !self.visit() {
                return None;
            }
            beside = sibling(pivot);
            pivot = tree.parents[pivot] as usize;
        }
        let is_there = best as usize == sibling(node) || best as usize == parent;
        let moves = best_saved > 0.0 && !is_there;
        moves.then_some(Reinsertion { from: node as u32, to: best, saved: best_saved })
    }
}
