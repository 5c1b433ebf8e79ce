//! zerkalo, part 3 of 4: compiled worlds and rendering. All kernels are compiled here.
//!
//! The source is in `src`, one folder per module. The modules of parts 1 and 2 are re-exported, so that
//! paths are the same in every part.

pub use zerkalo_film::film;
pub use zerkalo_scene::{
    asset, bvh, camera, disk, lanes, light, material, primitive, sampling, scene, shape, value,
};

#[path = "../../src/render/mod.rs"]
pub mod render;
#[path = "../../src/world/mod.rs"]
pub mod world;
