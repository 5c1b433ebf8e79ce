//! Asset files of scenes: meshes and images, read into plain data.
//!
//! All content is checked. Before memory is allocated, counts are compared with limits and with the
//! length of the file. Indices must be below the number of vertices, and coordinates must be
//! finite. Every error is reported as an [`AssetError`] with the file and the location in the file.
//!
//! A file may name other files: an OBJ its MTL files, a glTF its buffers. The named files must be
//! in the folder of the file that names them or below it. Their names must be relative paths
//! without `..`. Other files and URLs are never read.

mod cache;
mod error;
mod exr;
mod file;
mod hdr;
mod image;
mod loaded;
mod memory;
mod mesh;
mod primaries;
mod radiance_map;
mod text;

pub use cache::{Assets, LoadProgress};
pub use error::{AssetError, FileLocation};
pub(crate) use file::FileContents;
pub use file::MAX_BYTES;
pub use image::{Image, MAX_PIXELS, MAX_SIDE};
pub use loaded::{Loaded, Reading};
pub use memory::AssetKind;
pub(crate) use mesh::{CREASE_ANGLE, parse as parse_mesh};
pub use mesh::{MAX_TRIANGLES, MAX_VERTICES};
pub use radiance_map::{DirectionSample, RadianceMap};
