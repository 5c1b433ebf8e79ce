//! zerkalo: a progressive, accumulating ray tracer that lives in a terminal.
//!
//! The map of the rooms, and who may import whom, stands in ARCHITECTURE.md; a test holds it.

#[cfg(not(unix))]
compile_error!(
    "zerkalo needs a Unix system (Linux, macOS, BSD): it uses POSIX terminals, signals and file locks."
);

pub mod asset;
pub mod bvh;
pub mod camera;
pub mod command;
pub mod dashboard;
pub mod film;
pub mod lanes;
pub mod light;
pub mod material;
pub mod measure;
pub mod primitive;
pub mod render;
pub mod sampling;
pub mod scene;
pub mod shape;
pub mod terminal;
pub mod value;
pub mod world;
