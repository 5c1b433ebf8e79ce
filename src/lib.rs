//! zerkalo: a progressive, accumulating ray tracer with a dashboard in the terminal.
//!
//! ARCHITECTURE.md has the map of the folders and the allowed imports, which a test guards. The
//! library consists of four crates, whose modules are all found here: `zerkalo-scene`,
//! `zerkalo-world`, `zerkalo-render` and this one.

pub use zerkalo_render::{
    asset, bvh, camera, disk, film, lanes, light, material, primitive, process_memory, render,
    sampling, scene, shape, value, world,
};

pub mod command;
pub mod dashboard;
pub mod measure;
pub mod terminal;
