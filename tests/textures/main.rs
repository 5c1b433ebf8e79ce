//! Textures and bumps: pictures against a direct evaluation, the files of the shipped scenes, and what is
//! refused.

mod files;
#[path = "../support/mod.rs"]
mod support;
