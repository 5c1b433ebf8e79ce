//! Lights of a compiled scene: light groups, the choice among many lights, emitters, and lights on
//! surfaces.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

pub(crate) mod choice;
pub(crate) mod emissive_forms;
pub(crate) mod emissive_sheets;
pub(crate) mod emitter_choice;
pub(crate) mod emitters;
pub(crate) mod groups;
pub(crate) mod mirror_images;
pub(crate) mod on_surfaces;
