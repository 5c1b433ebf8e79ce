//! zerkalo: a progressive, accumulating ray tracer with a dashboard in the terminal.
//!
//! ARCHITECTURE.md lists the folders and the imports that are allowed between them; a test checks
//! the imports. The library consists of four crates: `zerkalo-scene`, `zerkalo-world`,
//! `zerkalo-render` and this one. This crate re-exports the modules of the others.

pub use zerkalo_render::{
    asset, bvh, camera, disk, film, image_file, lanes, light, material, primitive, process_memory,
    render, sampling, scene, shape, value, world,
};

pub mod command;
pub mod dashboard;
pub mod measure;
pub mod terminal;
