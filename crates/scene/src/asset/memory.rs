//! Estimates of the memory of assets from the headers of their files.

use crate::asset::file::FileContents;
use crate::asset::{Image, RadianceMap, mesh};
use std::path::Path;

/// Type of an asset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AssetKind {
    /// Mesh.
    Mesh,
    /// Image of a texture or a bump map.
    Texture,
    /// Image of an environment light.
    Environment,
}

/// Memory of an image \[bytes\].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImageMemory {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Memory after decoding.
    pub kept: u64,
    /// Further memory during decoding.
    pub decoding: u64,
}

/// Least memory of a mesh \[bytes per byte of its file\].
const MESH_BYTES: u64 = 2;

/// Lengths \[bytes\] of the beginnings of a file that are read in turn, until one has the whole
/// header.
const START_BYTES: [u64; 2] = [1 << 18, 1 << 26];

/// Returns two estimates for the asset in the file at `path` of `length` bytes \[bytes\]: its memory
/// after decoding, and the further memory during decoding, with up to two copies of the file. Both
/// are 0 if the header cannot be read.
pub fn asset_memory(kind: AssetKind, path: &Path, length: u64) -> [u64; 2] {
    let memory = |start: &FileContents| match kind {
        AssetKind::Mesh => {
            let (kept, all) = (MESH_BYTES * length, mesh::parse_bytes(path).saturating_mul(length));
            Ok(ImageMemory { size: [0; 2], kept, decoding: all.saturating_sub(kept) })
        }
        AssetKind::Texture => Image::memory(start),
        AssetKind::Environment => RadianceMap::memory(start),
    };
    let found = START_BYTES
        .into_iter()
        .find_map(|bytes| memory(&FileContents::read_start(path, bytes).ok()?).ok());
    found.map_or([0; 2], |memory| [memory.kept, memory.decoding.saturating_add(2 * length)])
}
