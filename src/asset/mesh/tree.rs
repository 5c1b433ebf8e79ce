//! The tree of boxes over a mesh's triangles, built once per mesh.

use super::TriangleMesh;
use super::normals::smooth;
use glam::Vec3A;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::builder::build_bvh2;
use std::fmt;
use std::sync::OnceLock;
use std::time::Duration;

/// A box of the tree and what is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Corner with the smallest coordinates.
    pub low: [f32; 3],
    /// First of two neighbouring children, or first triangle of a leaf.
    pub first: u32,
    /// Corner with the largest coordinates.
    pub high: [f32; 3],
    /// Number of triangles of a leaf; 0: an inner node.
    pub count: u32,
}

/// A mesh with the tree over it; about 60 bytes a triangle, and 12 a vertex for normals.
pub struct Mesh {
    mesh: TriangleMesh,
    nodes: Vec<Node>,
    depth: usize,
    smooth: OnceLock<Vec<[f32; 3]>>,
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
        let mut spent = Duration::ZERO;
        let bvh = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut spent);
        drop(boxes);
        let order = &bvh.primitive_indices;
        mesh.triangles = order.iter().map(|i| mesh.triangles[*i as usize]).collect();
        if !mesh.color_of.is_empty() {
            mesh.color_of = order.iter().map(|i| mesh.color_of[*i as usize]).collect();
        }
        let nodes: Vec<Node> = bvh
            .nodes
            .iter()
            .map(|n| Node {
                low: n.aabb().min.to_array(),
                first: n.first_index,
                high: n.aabb().max.to_array(),
                count: n.prim_count,
            })
            .collect();
        let depth = bvh.depth(0);
        Self { mesh, nodes, depth, smooth: OnceLock::new() }
    }

    /// The triangles, in the order of the leaves.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.mesh
    }

    /// The boxes; the first is the root.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// The most nodes on a way from the root to a leaf.
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

    /// Memory that it takes [bytes].
    pub fn bytes(&self) -> usize {
        self.mesh.bytes()
            + size_of::<Node>() * self.nodes.len()
            + self.smooth.get().map_or(0, |n| 12 * n.len())
    }
}
