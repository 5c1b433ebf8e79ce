//! Stories of the dashboard: a scene, what somebody presses, and what became of the scene. No
//! terminal, no renderer, no disk.

mod actions;
mod desk;
mod editing;
mod files;
mod mouse;
mod random;
mod recovery;
mod roughness;
#[path = "../support/mod.rs"]
mod support;
mod table;
