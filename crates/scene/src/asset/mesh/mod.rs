//! Triangle meshes from OBJ, PLY, STL and glTF files.

mod builder;
mod bvh;
mod gltf;
mod normals;
mod obj;
mod ply;
mod stl;

pub use bvh::{Mesh, TriangleBlock};

use crate::asset::error::AssetError;
use crate::asset::file::FileContents;
use crate::value::Fnv1a64;
use std::path::Path;

/// Largest number of triangles of a mesh: 64 Mi.
pub const MAX_TRIANGLES: usize = 1 << 26;

/// Largest number of vertices of a mesh: 128 Mi.
pub const MAX_VERTICES: usize = 1 << 27;

/// Triangle mesh that was checked: it has at least one triangle, all indices are in range, all
/// numbers are finite, and every triangle has an area.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// Vertex positions relative to `center`.
    pub positions: Vec<[f32; 3]>,
    /// Offset that was subtracted from every vertex. It is nonzero only for a mesh so far from the
    /// origin, relative to its size, that single precision would lose its shape.
    pub center: [f64; 3],
    /// Vertex indices, three per triangle, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normal per vertex. `None` if the file has no normals. If only some vertices have one,
    /// the others have the mean normal of their triangles.
    pub normals: Option<Vec<[f32; 3]>>,
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
    /// Adds all data of the mesh that affects pictures to `hash`.
    pub fn hash_contents(&self, hash: &mut Fnv1a64) {
        let Self {
            positions,
            center,
            triangles,
            normals,
            uvs,
            colors,
            color_of,
            bounds: _,
            notes: _,
        } = self;
        let mut floats = |list: &[f32]| list.iter().for_each(|x| hash.update(&x.to_le_bytes()));
        floats(positions.as_flattened());
        floats(normals.as_deref().unwrap_or_default().as_flattened());
        floats(uvs.as_deref().unwrap_or_default().as_flattened());
        floats(colors.as_flattened());
        center.iter().for_each(|x| hash.update(&x.to_le_bytes()));
        triangles.as_flattened().iter().for_each(|i| hash.update(&i.to_le_bytes()));
        color_of.iter().for_each(|i| hash.update(&i.to_le_bytes()));
        // With the lengths of the lists in the hash, two meshes whose numbers are divided
        // differently among the lists have different hashes.
        let lengths = [positions.len(), triangles.len(), colors.len()];
        lengths.iter().for_each(|n| hash.update(&(*n as u64).to_le_bytes()));
        hash.update(&[u8::from(normals.is_some()), u8::from(uvs.is_some())]);
    }

    /// Returns the estimated peak memory during parsing, in bytes per byte of the mesh file at
    /// `path`. OBJ needs more than other formats, because its positions are read as doubles into
    /// vectors that grow. Separate buffer files of glTF are not included.
    pub(super) fn parse_bytes(path: &Path) -> u64 {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) { 10 } else { 6 }
    }

    /// Parses a mesh file in memory. The format is determined by the extension of the file name.
    ///
    /// # Errors
    /// Fails if the file is not a valid mesh.
    pub(super) fn parse(source: FileContents) -> Result<Self, AssetError> {
        let extension = source.path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "obj" => obj::parse(&source),
            "ply" => ply::parse(&source),
            "stl" => stl::parse(source),
            "gltf" | "glb" => gltf::parse(&source),
            _ => {
                let found = format!("\"{extension}\" is not a kind of mesh file");
                Err(source.fault(found, "a name that ends in .obj, .ply, .stl, .gltf or .glb"))
            }
        }
    }

    /// Returns the memory of the mesh in bytes.
    pub fn bytes(&self) -> usize {
        12 * (self.positions.len() + self.triangles.len())
            + self.normals.as_ref().map_or(0, |n| 12 * n.len())
            + self.uvs.as_ref().map_or(0, |n| 8 * n.len())
            + 2 * self.color_of.len()
    }

    /// Returns the linear base colour of triangle number `triangle`. Returns `None` if the file has
    /// no colours.
    pub fn color(&self, triangle: usize) -> Option<[f32; 3]> {
        let index = self.color_of.get(triangle).copied().unwrap_or(0);
        self.colors.get(usize::from(index)).copied()
    }
}
