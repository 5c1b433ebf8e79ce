//! zerkalo, part 2 of 4: compiled worlds. All kernels, which are generic over the SIMD type, are
//! compiled here.
//!
//! The source is in `src`, one folder per module. The modules of part 1 are re-exported, so that
//! paths are the same in every part.

pub use zerkalo_scene::{
    asset, bvh, camera, disk, lanes, light, material, primitive, process_memory, sampling, scene,
    shape, value,
};

#[path = "../../src/world/mod.rs"]
pub mod world;
