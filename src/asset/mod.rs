//! Files that scenes name, read into plain data: meshes and images.
//!
//! Everything is checked before it is kept: counts against limits and against the length of the
//! file before anything is allocated for them, indices against the number of vertices, coordinates
//! against NaN and infinities. Whatever is wrong becomes an [`AssetError`] that names the file and
//! the place in it.
//!
//! A file may name others (the MTL of an OBJ, the buffers of a glTF): only such that lie in its own
//! folder or below, by relative paths without `..`. Nothing is ever fetched from elsewhere.
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
