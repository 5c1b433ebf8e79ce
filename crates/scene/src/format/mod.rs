//! Scene files: TOML read into a scene, and written back with comments and order kept.

pub(crate) mod comments;
pub(crate) mod emit;
pub(crate) mod list_diff;
pub(crate) mod parts;
pub(crate) mod patch;
pub(crate) mod read;
pub(crate) mod schema;
pub(crate) mod source_map;
pub mod suggest;

pub use read::TomlText;
