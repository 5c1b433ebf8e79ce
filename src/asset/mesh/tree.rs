//! The tree of boxes over a mesh's triangles, built once per mesh: up to eight boxes a branch, up to
//! eight triangles a leaf, each coordinate of the eight side by side, so that either one ray meets
//! eight of them at once or a packet one after the other.
//!
//! A binary tree by a library, its nodes joined as long as a branch has room, the largest first
//! (Wald, Benthin and Boulos 2008, *Getting Rid of Packets*).

use super::TriangleMesh;
use super::normals::smooth;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use std::fmt;
use std::sync::OnceLock;
use std::time::Duration;

/// Boxes of a branch, and triangles of a leaf.
pub const WIDE: usize = 8;

/// Eight boxes of the tree. Empty ones have their corners exchanged, at infinity.
#[derive(Clone, Debug, PartialEq)]
#[repr(align(32))]
pub struct Branch {
    /// Smallest coordinates of the boxes, by axis.
    pub low: [[f32; WIDE]; 3],
    /// Largest coordinates of the boxes, by axis.
    pub high: [[f32; WIDE]; 3],
    /// Number of the branch or leaf in each box.
    pub child: [u32; WIDE],
    /// Bit `i`: box `i` holds a leaf.
    pub leaves: u8,
    /// Number of boxes; the first ones.
    pub count: u8,
}

/// Up to eight triangles. The places without one hold NaN.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub struct Leaf {
    /// Corners, by number in the triangle and axis.
    pub corners: [[[f32; WIDE]; 3]; 3],
    /// Number of the first triangle in the mesh; the others follow it.
    pub first: u32,
    /// Number of triangles.
    pub count: u32,
}

const NO_BOX: Branch = Branch {
    low: [[f32::INFINITY; WIDE]; 3],
    high: [[f32::NEG_INFINITY; WIDE]; 3],
    child: [0; WIDE],
    leaves: 0,
    count: 0,
};

/// A mesh with the tree over it: about 75 bytes a triangle for the tree, 12 for its indices, and 12
/// to 32 for each vertex.
pub struct Mesh {
    mesh: TriangleMesh,
    branches: Vec<Branch>,
    leaves: Vec<Leaf>,
    depth: usize,
    smooth: OnceLock<Vec<[f32; 3]>>,
}

/// A mesh equals itself alone: two readings of a file are two meshes.
impl PartialEq for Mesh {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl fmt::Debug for Mesh {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Mesh")
            .field("triangles", &self.mesh.triangles.len())
            .field("bounds", &self.mesh.bounds)
            .finish_non_exhaustive()
    }
}

impl Mesh {
    /// Builds the tree; the triangles take the order of its leaves.
    pub fn new(mut mesh: TriangleMesh) -> Self {
        let boxes: Vec<Aabb> = mesh
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| Vec3A::from_array(mesh.positions[i as usize]));
                Aabb::new(a.min(b).min(c), a.max(b).max(c))
            })
            .collect();
        // Large leaves: a ray meets all of one at the price of one.
        let params = BvhBuildParams {
            max_prims_per_leaf: WIDE as u32,
            collapse_traversal_cost: 8.0,
            ..BvhBuildParams::fast_build()
        };
        let mut spent = Duration::ZERO;
        let binary = build_bvh2(&boxes, params, &mut spent);
        drop(boxes);
        let order = &binary.primitive_indices;
        mesh.triangles = order.iter().map(|i| mesh.triangles[*i as usize]).collect();
        if !mesh.color_of.is_empty() {
            mesh.color_of = order.iter().map(|i| mesh.color_of[*i as usize]).collect();
        }
        let mut out = Self {
            mesh,
            branches: Vec::new(),
            leaves: Vec::new(),
            depth: 0,
            smooth: OnceLock::new(),
        };
        out.join(&binary);
        out
    }

    /// Makes branches and leaves of the nodes of a binary tree.
    fn join(&mut self, binary: &Bvh2) {
        let nodes = &binary.nodes;
        let mut todo = vec![(0usize, 0usize, 1usize)];
        self.branches.push(NO_BOX);
        let mut inside = Vec::with_capacity(WIDE);
        while let Some((node, branch, depth)) = todo.pop() {
            self.depth = self.depth.max(depth);
            inside.clear();
            inside.push(node);
            while inside.len() < WIDE {
                let area = |i: usize| nodes[i].aabb().half_area();
                let opened = (0..inside.len())
                    .filter(|k| !nodes[inside[*k]].is_leaf())
                    .max_by(|a, b| area(inside[*a]).total_cmp(&area(inside[*b])));
                let Some(opened) = opened else { break };
                let first = nodes[inside[opened]].first_index as usize;
                inside[opened] = first;
                inside.push(first + 1);
            }
            let mut new = Branch { count: inside.len() as u8, ..NO_BOX };
            for (i, node) in inside.iter().enumerate() {
                let n = &nodes[*node];
                let (low, high) = (n.aabb().min.to_array(), n.aabb().max.to_array());
                for axis in 0..3 {
                    new.low[axis][i] = low[axis];
                    new.high[axis][i] = high[axis];
                }
                if n.is_leaf() {
                    new.leaves |= 1 << i;
                    new.child[i] = self.leaves.len() as u32;
                    let leaf = self.leaf(n.first_index, n.prim_count);
                    self.leaves.push(leaf);
                } else {
                    new.child[i] = self.branches.len() as u32;
                    todo.push((*node, self.branches.len(), depth + 1));
                    self.branches.push(NO_BOX);
                }
            }
            self.branches[branch] = new;
        }
    }

    fn leaf(&self, first: u32, count: u32) -> Leaf {
        let mut leaf = Leaf { corners: [[[f32::NAN; WIDE]; 3]; 3], first, count };
        let triangles = &self.mesh.triangles[first as usize..][..count as usize];
        for (i, triangle) in triangles.iter().enumerate() {
            for (corner, vertex) in leaf.corners.iter_mut().zip(triangle) {
                let position = self.mesh.positions[*vertex as usize];
                for (axis, x) in corner.iter_mut().zip(position) {
                    axis[i] = x;
                }
            }
        }
        leaf
    }

    /// The triangles, in the order of the leaves.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// The branches; the first is the root.
    pub fn branches(&self) -> &[Branch] {
        &self.branches
    }

    /// The leaves.
    pub fn leaves(&self) -> &[Leaf] {
        &self.leaves
    }

    /// The most branches on a way from the root to a leaf.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// A unit normal per vertex: the file's, or the mean over the triangles around it, computed when
    /// first asked for.
    pub fn smooth_normals(&self) -> &[[f32; 3]] {
        match &self.mesh.normals {
            Some(normals) => normals,
            None => self.smooth.get_or_init(|| smooth(&self.mesh.positions, &self.mesh.triangles)),
        }
    }

    /// The largest `direction . corner` of its triangles' corners.
    pub fn farthest(&self, direction: [f64; 3]) -> f64 {
        let along = |axis: usize, x: f32| direction[axis] * f64::from(x);
        let mut best = f64::NEG_INFINITY;
        let mut todo = vec![(0u32, f64::INFINITY)];
        while let Some((branch, bound)) = todo.pop() {
            if bound <= best {
                continue;
            }
            let branch = &self.branches[branch as usize];
            let first = todo.len();
            for i in 0..usize::from(branch.count) {
                let reach = |a| along(a, branch.low[a][i]).max(along(a, branch.high[a][i]));
                let bound: f64 = (0..3).map(reach).sum();
                if bound <= best {
                    continue;
                }
                if branch.leaves >> i & 1 == 0 {
                    todo.push((branch.child[i], bound));
                    continue;
                }
                let leaf = &self.leaves[branch.child[i] as usize];
                for [x, y, z] in &leaf.corners {
                    for ((x, y), z) in x.iter().zip(y).zip(z).take(leaf.count as usize) {
                        best = best.max(along(0, *x) + along(1, *y) + along(2, *z));
                    }
                }
            }
            todo[first..].sort_by(|a, b| a.1.total_cmp(&b.1));
        }
        best
    }

    /// Memory that it takes \[bytes\].
    pub fn bytes(&self) -> usize {
        self.mesh.bytes()
            + size_of::<Branch>() * self.branches.len()
            + size_of::<Leaf>() * self.leaves.len()
            + self.smooth.get().map_or(0, |n| 12 * n.len())
    }
}
