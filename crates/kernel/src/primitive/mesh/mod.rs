//! Triangle meshes: data, BVH, intersection, and meshes as primitives.

mod bvh;
pub(super) mod instance;
pub mod intersection;
mod normals;

pub use bvh::{Mesh, TriangleBlock};
pub use normals::CornerNormals;

/// Triangle mesh that was checked: it has at least one triangle, all indices are in range, all
/// numbers are finite, and every triangle has an area.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions relative to `center`.
    pub positions: Vec<[f32; 3]>,
    /// Offset that was subtracted from every vertex; nonzero only if single precision would lose
    /// the shape of the mesh, because it is far from the origin.
    pub center: [f64; 3],
    /// Vertex indices, three per triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normal per vertex; zero at vertices without a triangle. `None` if the file has no
    /// normals.
    pub normals: Option<Vec<[f32; 3]>>,
    /// `true` if a mesh without normals is flat by the rules of its format.
    pub is_flat: bool,
    /// Texture coordinates per vertex, u to the right and v upwards. `None` if the file has none.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// Distinct linear base colours of triangles. Empty if the file has no colours.
    pub colors: Vec<[f32; 3]>,
    /// Index into `colors` for each triangle. Empty if there are fewer than two colours.
    pub color_of: Vec<u16>,
    /// Lowest and highest corner of the bounding box, relative to `center`.
    pub bounds: [[f32; 3]; 2],
    /// Notes for the user about parts of the file that were omitted or replaced: sentences without
    /// a full stop.
    pub notes: Vec<String>,
}

impl TriangleMesh {
    /// Passes all data of the mesh that affects pictures to `update`, piece by piece, to be hashed.
    pub fn hash_contents(&self, mut update: impl FnMut(&[u8])) {
        let Self {
            positions,
            center,
            triangles,
            normals,
            is_flat,
            uvs,
            colors,
            color_of,
            bounds: _,
            notes: _,
        } = self;
        let mut floats = |list: &[f32]| list.iter().for_each(|x| update(&x.to_le_bytes()));
        floats(positions.as_flattened());
        floats(normals.as_deref().unwrap_or_default().as_flattened());
        floats(uvs.as_deref().unwrap_or_default().as_flattened());
        floats(colors.as_flattened());
        center.iter().for_each(|x| update(&x.to_le_bytes()));
        triangles.as_flattened().iter().for_each(|i| update(&i.to_le_bytes()));
        color_of.iter().for_each(|i| update(&i.to_le_bytes()));
        // Lengths, because two meshes may divide the same numbers differently among the lists.
        let lengths = [positions.len(), triangles.len(), colors.len()];
        lengths.iter().for_each(|n| update(&(*n as u64).to_le_bytes()));
        update(&[u8::from(normals.is_some()), u8::from(uvs.is_some()), u8::from(*is_flat)]);
    }

    /// Returns the memory of the mesh in bytes.
    pub fn bytes(&self) -> usize {
        12 * (self.positions.len() + self.triangles.len())
            + self.normals.as_ref().map_or(0, |n| 12 * n.len())
            + self.uvs.as_ref().map_or(0, |n| 8 * n.len())
            + 2 * self.color_of.len()
    }

    /// Returns the linear base colour of a triangle; `None` if the file has no colours.
    pub fn color(&self, triangle: usize) -> Option<[f32; 3]> {
        let index = self.color_of.get(triangle).copied().unwrap_or(0);
        self.colors.get(usize::from(index)).copied()
    }
}
