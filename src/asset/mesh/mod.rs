//! Triangle meshes from OBJ, PLY, STL and glTF files.

mod builder;
mod bvh;
mod gltf;
mod normals;
mod obj;
mod ply;
mod stl;

pub use bvh::{Mesh, TriangleBlock};

use crate::asset::error::{AssetError, FileLocation};
use crate::asset::file::FileContents;

/// The most triangles of a mesh: 64 Mi.
pub const MAX_TRIANGLES: usize = 1 << 26;

/// The most vertices of a mesh: 128 Mi.
pub const MAX_VERTICES: usize = 1 << 27;

/// A mesh of triangles, checked: at least one triangle, all indices in range, all numbers finite, no
/// triangle without area.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleMesh {
    /// Vertices relative to `center`.
    pub positions: Vec<[f32; 3]>,
    /// What was subtracted from every vertex: zero unless the mesh stands far from the origin for
    /// its size, where single precision would lose its shape.
    pub center: [f64; 3],
    /// Three vertices each; the front is where they turn counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// A unit vector per vertex, if the file has normals; where it has none for a vertex, that of the
    /// triangles around it.
    pub normals: Option<Vec<[f32; 3]>>,
    /// A pair per vertex, if the file has texture coordinates: u to the right, v upwards.
    pub uvs: Option<Vec<[f32; 2]>>,
    /// The different base colours, linear; empty: the file names none.
    pub colors: Vec<[f32; 3]>,
    /// For each triangle, which of `colors`; empty if there are fewer than two.
    pub color_of: Vec<u16>,
    /// Corners of the box around the triangles, relative to `center`.
    pub bounds: [[f32; 3]; 2],
    /// What was left out or replaced, in sentences without a full stop.
    pub notes: Vec<String>,
}

impl TriangleMesh {
    /// From a file in memory; its name's extension says what it is.
    pub(super) fn parse(source: FileContents) -> Result<Self, AssetError> {
        let extension = source.path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "obj" => obj::parse(&source),
            "ply" => ply::parse(&source),
            "stl" => stl::parse(source),
            "gltf" | "glb" => gltf::parse(&source),
            _ => {
                let found = format!("\"{extension}\" is not a kind of mesh file");
                Err(source.error(
                    FileLocation::Whole,
                    found,
                    "a name that ends in .obj, .ply, .stl, .gltf or .glb",
                ))
            }
        }
    }

    /// Memory that the mesh takes \[bytes\].
    pub fn bytes(&self) -> usize {
        12 * (self.positions.len() + self.triangles.len())
            + self.normals.as_ref().map_or(0, |n| 12 * n.len())
            + self.uvs.as_ref().map_or(0, |n| 8 * n.len())
            + 2 * self.color_of.len()
    }

    /// Base colour of a triangle, if the file names any.
    pub fn color(&self, triangle: usize) -> Option<[f32; 3]> {
        let which = self.color_of.get(triangle).copied().unwrap_or(0);
        self.colors.get(usize::from(which)).copied()
    }
}
