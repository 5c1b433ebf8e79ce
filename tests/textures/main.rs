//! Textures and bumps: pictures against a direct evaluation, the files of the shipped scenes, rejected
//! files.

mod cases;
#[path = "../common/mod.rs"]
mod common;
mod direct;
mod files;
mod limits;
mod pictures;
#[path = "../support/mod.rs"]
mod support;
