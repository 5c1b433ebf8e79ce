//! zerkalo: a progressive, accumulating ray tracer that lives in a terminal.
//!
//! The map of the rooms, and who may import whom, stands in ARCHITECTURE.md; a test holds it.

// The modules are left out elsewhere, so that this is the only error.
#[cfg(not(unix))]
compile_error!(
    "zerkalo needs a Unix system (Linux, macOS, BSD): it uses POSIX terminals, signals and file locks."
);

#[cfg(unix)]
pub mod asset;
#[cfg(unix)]
pub mod bvh;
#[cfg(unix)]
pub mod camera;
#[cfg(unix)]
pub mod command;
#[cfg(unix)]
pub mod dashboard;
#[cfg(unix)]
pub mod disk;
#[cfg(unix)]
pub mod film;
#[cfg(unix)]
pub mod lanes;
#[cfg(unix)]
pub mod light;
#[cfg(unix)]
pub mod material;
#[cfg(unix)]
pub mod measure;
#[cfg(unix)]
pub mod primitive;
#[cfg(unix)]
pub mod render;
#[cfg(unix)]
pub mod sampling;
#[cfg(unix)]
pub mod scene;
#[cfg(unix)]
pub mod shape;
#[cfg(unix)]
pub mod terminal;
#[cfg(unix)]
pub mod value;
#[cfg(unix)]
pub mod world;
