//! Triangle meshes from OBJ, PLY, STL and glTF files.

mod builder;
mod gltf;
mod obj;
mod ply;
mod polygon;
mod stl;

use crate::asset::error::AssetError;
use crate::asset::file::FileContents;
use std::path::Path;
use zerkalo_kernel::primitive::TriangleMesh;

/// Largest number of triangles of a mesh: 64 Mi.
pub const MAX_TRIANGLES: usize = 1 << 26;

/// Largest number of vertices of a mesh: 128 Mi.
pub const MAX_VERTICES: usize = 1 << 27;

/// Crease angle of meshes without normals, except of formats in which these are flat \[degrees\].
pub(crate) const CREASE_ANGLE: f64 = 40.0;

/// Returns the estimated peak memory during parsing, in bytes per byte of the mesh file at
/// `path`. OBJ needs more than other formats, because its positions are read as doubles into
/// vectors that grow. Separate buffer files of glTF are not included.
pub(super) fn parse_bytes(path: &Path) -> u64 {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("obj")) { 10 } else { 6 }
}

/// Parses a mesh file in memory. The format is determined by the extension of the file name.
pub(crate) fn parse(source: &FileContents) -> Result<TriangleMesh, AssetError> {
    let extension = source.path.extension().and_then(|e| e.to_str()).unwrap_or("");
    match extension.to_ascii_lowercase().as_str() {
        "obj" => obj::parse(source),
        "ply" => ply::parse(source),
        "stl" => stl::parse(source),
        "gltf" | "glb" => gltf::parse(source),
        _ => {
            let found = format!("\"{extension}\" is not a kind of mesh file");
            Err(source.fault(found, "a name that ends in .obj, .ply, .stl, .gltf or .glb"))
        }
    }
}

/// Returns the corners of triangle `i` of a triangle strip. Every second one has the opposite sense
/// of rotation.
fn strip(i: usize) -> [usize; 3] {
    if i.is_multiple_of(2) { [i, i + 1, i + 2] } else { [i + 1, i, i + 2] }
}
