//! The tree of boxes over a mesh's triangles, built once per mesh: up to eight triangles a leaf, each
//! coordinate of the eight side by side, so that either one ray meets eight of them at once or a packet
//! one after the other.

use crate::asset::mesh::TriangleMesh;
use crate::asset::mesh::normals::smooth;
use crate::bvh::build::{BVH_WIDTH, Bvh8, Bvh8Build, LEAF_FLAG};
use obvhs::BvhBuildParams;
use std::fmt;
use std::sync::OnceLock;

/// Up to eight triangles. The places without one hold NaN.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub struct TriangleBlock {
    /// Corners, by number in the triangle and axis.
    pub corners: [[[f32; BVH_WIDTH]; 3]; 3],
}

/// A mesh with the tree over it: about 58 bytes a triangle for the tree, 12 for its indices, and 12
/// to 32 for each vertex.
pub struct Mesh {
    mesh: TriangleMesh,
    boxes: Bvh8,
    leaves: Vec<TriangleBlock>,
    /// Number of the first triangle in each leaf; the others follow it.
    firsts: Vec<u32>,
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

impl TriangleBlock {
    fn new(mesh: &TriangleMesh, first: u32, count: u32) -> Self {
        let mut leaf = Self { corners: [[[f32::NAN; BVH_WIDTH]; 3]; 3] };
        let triangles = &mesh.triangles[first as usize..][..count as usize];
        for (i, triangle) in triangles.iter().enumerate() {
            for (corner, vertex) in leaf.corners.iter_mut().zip(triangle) {
                let position = mesh.positions[*vertex as usize];
                for (axis, x) in corner.iter_mut().zip(position) {
                    axis[i] = x;
                }
            }
        }
        leaf
    }
}

impl Mesh {
    /// Builds the tree; the triangles take the order of its leaves.
    pub fn new(mut mesh: TriangleMesh) -> Self {
        let corners = |i: usize| {
            let [a, b, c] = mesh.triangles[i].map(|v| mesh.positions[v as usize]);
            let of = |f: fn(f32, f32) -> f32| std::array::from_fn(|k| f(f(a[k], b[k]), c[k]));
            [of(f32::min), of(f32::max)]
        };
        // Large leaves: a ray meets all of one at the price of one.
        let quality =
            BvhBuildParams { collapse_traversal_cost: 8.0, ..BvhBuildParams::fast_build() };
        let Bvh8Build { bvh: boxes, order, leaves } =
            Bvh8::build(mesh.triangles.len(), corners, BVH_WIDTH, quality);
        mesh.triangles = order.iter().map(|i| mesh.triangles[*i as usize]).collect();
        if !mesh.color_of.is_empty() {
            mesh.color_of = order.iter().map(|i| mesh.color_of[*i as usize]).collect();
        }
        let firsts = leaves.iter().map(|(first, _)| *first).collect();
        let leaves =
            leaves.iter().map(|(first, count)| TriangleBlock::new(&mesh, *first, *count)).collect();
        Self { mesh, boxes, leaves, firsts, smooth: OnceLock::new() }
    }

    /// The triangles, in the order of the leaves.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// The tree over the leaves.
    pub fn boxes(&self) -> &Bvh8 {
        &self.boxes
    }

    /// The leaves.
    pub fn leaves(&self) -> &[TriangleBlock] {
        &self.leaves
    }

    /// Number of the first triangle in a leaf; the others follow it.
    pub fn first_triangle(&self, leaf: usize) -> u32 {
        self.firsts[leaf]
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
    pub fn support(&self, direction: [f64; 3]) -> f64 {
        let along = |axis: usize, x: f32| direction[axis] * f64::from(x);
        let mut best = f64::NEG_INFINITY;
        let mut todo = vec![(0u32, f64::INFINITY)];
        while let Some((branch, bound)) = todo.pop() {
            if bound <= best {
                continue;
            }
            let branch = &self.boxes.nodes()[branch as usize];
            let first = todo.len();
            for i in branch.children() {
                let reach =
                    |a| along(a, branch.bounds[a][i]).max(along(a, branch.bounds[a + 3][i]));
                let bound: f64 = (0..3).map(reach).sum();
                if bound <= best {
                    continue;
                }
                if branch.child[i] & LEAF_FLAG == 0 {
                    todo.push((branch.child[i], bound));
                    continue;
                }
                let leaf = &self.leaves[(branch.child[i] & !LEAF_FLAG) as usize];
                for [x, y, z] in &leaf.corners {
                    for ((x, y), z) in x.iter().zip(y).zip(z) {
                        // Of NaN and a number the number.
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
            + self.boxes.bytes()
            + (size_of::<TriangleBlock>() + size_of::<u32>()) * self.leaves.len()
            + self.smooth.get().map_or(0, |n| 12 * n.len())
    }
}
