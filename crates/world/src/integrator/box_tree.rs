//! Binary tree of bounding boxes, in which the boxes that meet another one are found.

use glam::DVec3;
use zerkalo_kernel::primitive::Bounds;
use zerkalo_scene::value::total_order;

/// Bounding box of all boxes of a subtree, and their number. The left child of a node is the next
/// one; the right child follows the subtree of the left one.
struct Node(Bounds, usize);

/// Boxes with numbers, in the order of the leaves of a balanced tree.
pub(super) struct BoxTree {
    nodes: Vec<Node>,
    numbers: Vec<usize>,
}

impl BoxTree {
    pub fn new(boxes: &[Bounds], mut numbers: Vec<usize>) -> Self {
        let mut nodes = Vec::with_capacity(2 * numbers.len());
        if !numbers.is_empty() {
            divide(boxes, &mut numbers, &mut nodes);
        }
        Self { nodes, numbers }
    }

    /// Calls `visit` with the number of each box that meets the box of `low` and `high`, until it
    /// returns `false`.
    pub fn visit(&self, (low, high): Bounds, mut visit: impl FnMut(usize) -> bool) {
        let (mut node, mut leaf) = (0, 0);
        while let Some(Node((l, h), count)) = self.nodes.get(node) {
            let disjoint = l.cmpgt(high).any() || h.cmplt(low).any();
            if !disjoint && *count == 1 && !visit(self.numbers[leaf]) {
                return;
            }
            let is_passed = disjoint || *count == 1;
            node += if is_passed { 2 * count - 1 } else { 1 };
            leaf += if is_passed { *count } else { 0 };
        }
    }
}

/// Appends the tree of `numbers` to `nodes`, and sorts them. Boxes are divided at the median of
/// their middles along the longest side of the common box.
fn divide(boxes: &[Bounds], numbers: &mut [usize], nodes: &mut Vec<Node>) {
    let around = |(low, high): Bounds, n: &usize| (low.min(boxes[*n].0), high.max(boxes[*n].1));
    let empty = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = numbers.iter().fold(empty, around);
    nodes.push(Node((low, high), numbers.len()));
    if numbers.len() > 1 {
        let axis = (high - low).max_position();
        let middle = numbers.len() / 2;
        numbers.select_nth_unstable_by_key(middle, |n| {
            let (low, high) = boxes[*n];
            (total_order(low[axis] + high[axis]), *n)
        });
        let (left, right) = numbers.split_at_mut(middle);
        divide(boxes, left, nodes);
        divide(boxes, right, nodes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_kernel::primitive::UNBOUNDED;

    #[test]
    fn tree_finds_the_boxes_that_meet_another() {
        let boxes: Vec<Bounds> = (0..100)
            .map(|i| {
                let low = DVec3::new(f64::from(i * 37 % 100), f64::from(i * 61 % 10), 0.0);
                if i == 50 { UNBOUNDED } else { (low, low + f64::from(i % 7)) }
            })
            .collect();
        let numbers: Vec<usize> = (0..100).filter(|n| n % 3 != 0).collect();
        let tree = BoxTree::new(&boxes, numbers.clone());
        for (low, high) in &boxes {
            let mut found = Vec::new();
            tree.visit((*low, *high), |n| {
                found.push(n);
                true
            });
            found.sort_unstable();
            let meets =
                |n: &usize| !boxes[*n].0.cmpgt(*high).any() && !boxes[*n].1.cmplt(*low).any();
            assert_eq!(found, numbers.iter().copied().filter(meets).collect::<Vec<_>>());
        }
        BoxTree::new(&boxes, Vec::new()).visit(UNBOUNDED, |_| unreachable!());
    }
}
