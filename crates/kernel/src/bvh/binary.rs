//! Binary BVH, which clustering builds and reinsertion optimises.

use glam::Vec3A;

/// Axis-aligned bounding box.
#[derive(Clone, Copy, Debug, Default)]
pub struct Aabb {
    pub min: Vec3A,
    pub max: Vec3A,
}

impl Aabb {
    /// Returns the smallest box that contains this box and `other`.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Returns half of the box's surface area.
    pub fn half_area(&self) -> f32 {
        let [x, y, z] = (self.max - self.min).to_array();
        x * y + y * z + z * x
    }
}

/// Leaf, or inner node with two children.
#[derive(Clone, Copy, Debug, Default)]
pub struct BinaryNode {
    pub aabb: Aabb,
    /// Number of primitives of a leaf; 0 for an inner node.
    pub primitives: u32,
    /// Leaf: position of its first primitive in [`BinaryBvh::order`]. Inner node: index of its
    /// first child, which its second child follows.
    pub first: u32,
}

impl BinaryNode {
    pub fn is_leaf(&self) -> bool {
        self.primitives > 0
    }

    /// Returns the indices of the children of an inner node.
    pub fn children(&self) -> [usize; 2] {
        [self.first as usize, self.first as usize + 1]
    }
}

/// Returns the index of the sibling of `node`, which must not be the root. The first of two
/// siblings has an odd index, and the second one the next even index.
pub fn sibling(node: usize) -> usize {
    ((node - 1) ^ 1) + 1
}

pub struct BinaryBvh {
    /// Nodes, each pair of siblings side by side. The root is the first node.
    pub nodes: Vec<BinaryNode>,
    /// Indices of the primitives, grouped by leaf.
    pub order: Vec<u32>,
}

impl BinaryBvh {
    /// Returns the indices of all nodes. Each node comes before its children.
    pub fn parents_first(&self) -> Vec<usize> {
        let mut order = vec![0];
        let mut position = 0;
        while let Some(node) = order.get(position) {
            let node = &self.nodes[*node];
            if !node.is_leaf() {
                order.extend(node.children());
            }
            position += 1;
        }
        order
    }

    /// Merges a subtree of at most `in_leaf` primitives into one leaf if this does not raise the
    /// tree's cost by the surface area heuristic. `traversal_cost` is as in `BuildQuality`.
    pub fn merge_leaves(&mut self, in_leaf: u32, traversal_cost: f32) {
        let mut counts = vec![0; self.nodes.len()];
        let mut costs = vec![0.0; self.nodes.len()];
        let mut becomes_leaf = vec![true; self.nodes.len()];
        for index in self.parents_first().into_iter().rev() {
            let node = &self.nodes[index];
            let area = node.aabb.half_area();
            counts[index] = node.primitives;
            let mut cost_as_inner = f32::INFINITY;
            if !node.is_leaf() {
                let [left, right] = node.children();
                counts[index] = counts[left] + counts[right];
                cost_as_inner = area * traversal_cost + costs[left] + costs[right];
            }
            let cost_as_leaf = area * counts[index] as f32;
            becomes_leaf[index] =
                node.is_leaf() || counts[index] <= in_leaf && cost_as_leaf <= cost_as_inner;
            costs[index] = if becomes_leaf[index] { cost_as_leaf } else { cost_as_inner };
        }
        let mut nodes = Vec::new();
        let mut order = Vec::with_capacity(self.order.len());
        // Index in `self.nodes` of each new node, level by level.
        let mut sources = vec![0];
        while let Some(source) = sources.get(nodes.len()) {
            let source: usize = *source;
            let mut node = self.nodes[source];
            if becomes_leaf[source] {
                (node.primitives, node.first) = (counts[source], order.len() as u32);
                self.append_primitives(source, &mut order);
            } else {
                let children = node.children();
                node.first = sources.len() as u32;
                sources.extend(children);
            }
            nodes.push(node);
        }
        *self = Self { nodes, order };
    }

    /// Appends the primitives of the subtree `node` to `order`.
    fn append_primitives(&self, node: usize, order: &mut Vec<u32>) {
        let mut todo = vec![node];
        while let Some(node) = todo.pop() {
            let node = &self.nodes[node];
            if node.is_leaf() {
                order.extend(&self.order[node.first as usize..][..node.primitives as usize]);
            } else {
                let [left, right] = node.children();
                todo.extend([right, left]);
            }
        }
    }
}
