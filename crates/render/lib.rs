//! zerkalo, part 2 of 3: compiled worlds, films and rendering. All kernels are compiled here.
//!
//! The source is in `src`, one folder per module. The modules of part 1 are re-exported, so that
//! paths are the same in every part.

pub use zerkalo_scene::{
    asset, bvh, camera, disk, lanes, light, material, primitive, sampling, scene, shape, value,
};

#[path = "../../src/film/mod.rs"]
pub mod film;
#[path = "../../src/render/mod.rs"]
pub mod render;
#[path = "../../src/world/mod.rs"]
pub mod world;
