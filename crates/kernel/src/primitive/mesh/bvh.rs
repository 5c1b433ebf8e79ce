//! BVH over the triangles of a mesh. A leaf has up to eight triangles as a structure of arrays. A
//! single ray is intersected with all eight at once, a packet with one triangle after the other.

use crate::bvh::{BVH_WIDTH, BuildQuality, Bvh8, Bvh8Build, LEAF_FLAG};
use crate::primitive::canonical::Bounds;
use crate::primitive::mesh::instance::EXTENT_PER_DETAIL;
use crate::primitive::mesh::normals::{creased, tangent_depth};
use crate::primitive::mesh::{CornerNormals, TriangleMesh};
use glam::DVec3;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// Leaf of a mesh's BVH. The coordinates of unused slots are NaN.
#[derive(Clone, Debug)]
#[repr(align(32))]
pub struct TriangleBlock {
    /// Coordinates, indexed by `[corner][axis][triangle]`.
    pub corners: [[[f32; BVH_WIDTH]; 3]; 3],
}

/// Triangle mesh with its BVH. Memory: about 58 bytes per triangle for the BVH, 12 per triangle for
/// vertex indices, and 12 to 32 per vertex.
pub struct Mesh {
    /// Triangles of the mesh, in the order of the BVH's leaves.
    pub mesh: TriangleMesh,
    /// Inner nodes of the mesh's BVH.
    pub boxes: Bvh8,
    /// Leaves of the mesh's BVH.
    pub leaves: Vec<TriangleBlock>,
    /// Index of the first triangle of each leaf.
    pub firsts: Vec<u32>,
    /// `true` if some triangle is long and thin, so that rays need the more exact test.
    pub thin: bool,
    /// Largest ratio of length to height of the triangles that are not small in the mesh.
    pub aspect: f64,
    /// Tangent depth of the normals in the file; 0 without any.
    pub depth: f64,
    /// Computed normals by crease angle \[degrees\].
    creased: Mutex<Vec<(f64, Arc<CornerNormals>)>>,
}

/// Largest ratio of a triangle's length to its height at which the rounding errors of the simple test
/// are within the ray offset.
const MAX_ASPECT: f64 = 64.0;

/// Two meshes are equal only if they are the same allocation.
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
    /// Builds the BVH of a mesh. The triangles are reordered: those of a leaf are consecutive.
    pub fn new(mut mesh: TriangleMesh) -> Self {
        let corners = |i: usize| {
            let [a, b, c] = mesh.triangles[i].map(|v| mesh.positions[v as usize]);
            let reduce = |f: fn(f32, f32) -> f32| std::array::from_fn(|k| f(f(a[k], b[k]), c[k]));
            [reduce(f32::min), reduce(f32::max)]
        };
        let Bvh8Build { bvh: boxes, order, leaves } =
            Bvh8::build(mesh.triangles.len(), corners, BVH_WIDTH, BuildQuality::FAST);
        mesh.triangles = order.iter().map(|i| mesh.triangles[*i as usize]).collect();
        if !mesh.color_of.is_empty() {
            mesh.color_of = order.iter().map(|i| mesh.color_of[*i as usize]).collect();
        }
        let firsts = leaves.iter().map(|(first, _)| *first).collect();
        let leaves =
            leaves.iter().map(|(first, count)| TriangleBlock::new(&mesh, *first, *count)).collect();
        let size = (0..3).map(|k| mesh.bounds[1][k] - mesh.bounds[0][k]).fold(0.0, f32::max);
        let (mut thin, mut aspect) = (false, 0.0f64);
        for triangle in &mesh.triangles {
            let [a, b, c] =
                triangle.map(|v| DVec3::from(mesh.positions[v as usize].map(f64::from)));
            let longest = [b - a, c - b, a - c].into_iter().map(DVec3::length).fold(0.0, f64::max);
            let own = longest * longest / (b - a).cross(c - a).length();
            thin |= own > MAX_ASPECT;
            if longest * EXTENT_PER_DETAIL >= f64::from(size) {
                aspect = aspect.max(own);
            }
        }
        let depth = mesh.normals.as_ref().map_or(0.0, |normals| {
            tangent_depth(&mesh.positions, &mesh.triangles, normals, &mesh.triangles)
        });
        Self { mesh, boxes, leaves, firsts, thin, aspect, depth, creased: Mutex::default() }
    }

    /// Returns normals that are smooth except at creases above an angle, which the first call
    /// computes. The last few angles are kept.
    pub fn creased_normals(&self, degrees: f64) -> Arc<CornerNormals> {
        let mut known = self.creased.lock().unwrap_or_else(PoisonError::into_inner);
        let found = known.iter().position(|(angle, _)| *angle == degrees);
        let entry = found.map(|i| known.remove(i)).unwrap_or_else(|| {
            (degrees, Arc::new(creased(&self.mesh.positions, &self.mesh.triangles, degrees)))
        });
        let normals = Arc::clone(&entry.1);
        known.truncate(3);
        known.insert(0, entry);
        normals
    }

    /// Returns the largest dot product of `direction` with a corner of a triangle: the support
    /// function of the mesh.
    pub fn support(&self, direction: DVec3) -> f64 {
        -self.least(
            |(low, high)| -(direction * low).max(direction * high).element_sum(),
            |corners| -corners.map(|c| direction.dot(c)).into_iter().fold(f64::NAN, f64::max),
        )
    }

    /// Returns the least value of `of_triangle` over all triangles. `lower_bound` returns a lower
    /// bound of the values of all triangles in a box.
    pub fn least(
        &self,
        lower_bound: impl Fn(Bounds) -> f64,
        of_triangle: impl Fn([DVec3; 3]) -> f64,
    ) -> f64 {
        let mut least = f64::INFINITY;
        let mut stack = vec![(0u32, f64::NEG_INFINITY)];
        while let Some((index, bound)) = stack.pop() {
            if bound >= least {
                continue;
            }
            let node = &self.boxes.nodes[index as usize];
            let first = stack.len();
            for i in node.children() {
                let corner = |from: usize| {
                    DVec3::from([0, 1, 2].map(|a| f64::from(node.bounds[a + from][i])))
                };
                let bound = lower_bound((corner(0), corner(3)));
                if bound >= least {
                    continue;
                }
                if node.child[i] & LEAF_FLAG == 0 {
                    stack.push((node.child[i], bound));
                    continue;
                }
                let leaf = &self.leaves[(node.child[i] & !LEAF_FLAG) as usize];
                for slot in 0..BVH_WIDTH {
                    let corner = |c: &[[f32; BVH_WIDTH]; 3]| {
                        DVec3::from(c.each_ref().map(|axis| f64::from(axis[slot])))
                    };
                    // `min` ignores the NaNs of unused slots.
                    least = least.min(of_triangle(leaf.corners.each_ref().map(corner)));
                }
            }
            // The box with the least bound is last and popped first.
            stack[first..].sort_by(|(_, a), (_, b)| b.total_cmp(a));
        }
        least
    }

    /// Returns the memory of the mesh and its BVH in bytes.
    pub fn bytes(&self) -> usize {
        self.mesh.bytes()
            + self.boxes.bytes()
            + (size_of::<TriangleBlock>() + size_of::<u32>()) * self.leaves.len()
            + self.creased.try_lock().map_or(0, |known| {
                known.iter().map(|(_, n)| 12 * (n.normals.len() + n.corners.len())).sum()
            })
    }
}
