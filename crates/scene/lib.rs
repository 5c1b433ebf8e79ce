//! zerkalo, part 1 of 4: descriptions of scenes, their files, and the kernels that intersect and
//! shade.
//!
//! The source is in `src`, one folder per module. The library is divided into several crates so
//! that they compile in parallel.

// On other systems the modules are left out, so that this is the only error.
#[cfg(not(unix))]
compile_error!(
    "zerkalo needs a Unix system (Linux, macOS, BSD): it uses POSIX terminals, signals and file locks."
);

#[cfg(unix)]
#[path = "../../src/asset/mod.rs"]
pub mod asset;
#[cfg(unix)]
#[path = "../../src/bvh/mod.rs"]
pub mod bvh;
#[cfg(unix)]
#[path = "../../src/camera/mod.rs"]
pub mod camera;
#[cfg(unix)]
#[path = "../../src/disk/mod.rs"]
pub mod disk;
#[cfg(unix)]
#[path = "../../src/lanes/mod.rs"]
pub mod lanes;
#[cfg(unix)]
#[path = "../../src/light/mod.rs"]
pub mod light;
#[cfg(unix)]
#[path = "../../src/material/mod.rs"]
pub mod material;
#[cfg(unix)]
#[path = "../../src/primitive/mod.rs"]
pub mod primitive;
#[cfg(unix)]
#[path = "../../src/process_memory.rs"]
pub mod process_memory;
#[cfg(unix)]
#[path = "../../src/sampling/mod.rs"]
pub mod sampling;
#[cfg(unix)]
#[path = "../../src/scene/mod.rs"]
pub mod scene;
#[cfg(unix)]
#[path = "../../src/shape/mod.rs"]
pub mod shape;
#[cfg(unix)]
#[path = "../../src/value/mod.rs"]
pub mod value;
