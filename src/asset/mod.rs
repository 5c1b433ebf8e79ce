//! Asset files of scenes, read into plain data: meshes and images.
//!
//! All content is checked: counts against limits and against the length of the file before memory is
//! allocated, indices against the number of vertices, coordinates against NaN and infinities. Every error
//! becomes an [`AssetError`] with the file and the place in it.
//!
//! A file may name others (the MTL of an OBJ, the buffers of a glTF) in its own folder or below, by
//! relative paths without `..`. Other files and URLs are never read.

mod cache;
mod error;
mod file;
mod image;
mod mesh;

pub use cache::{Assets, LoadProgress};
pub use error::{AssetError, FileLocation};
pub use file::MAX_BYTES;
pub use image::{Image, MAX_PIXELS, MAX_SIDE};
pub use mesh::{MAX_TRIANGLES, MAX_VERTICES, Mesh, TriangleBlock, TriangleMesh};
