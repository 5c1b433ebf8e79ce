//! zerkalo, part 3 of 4: films, image files and rendering.
//!
//! The source is in `src`, one folder per module. The modules of earlier parts are re-exported, so
//! that paths are the same in every part.

pub use zerkalo_world::{
    asset, bvh, camera, disk, lanes, light, material, primitive, process_memory, sampling, scene,
    shape, value, world,
};

#[path = "../../src/film/mod.rs"]
pub mod film;
#[path = "../../src/image_file/mod.rs"]
pub mod image_file;
#[path = "../../src/render/mod.rs"]
pub mod render;
