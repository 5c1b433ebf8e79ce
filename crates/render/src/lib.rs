//! Progressive rendering: the schedule of samples, the passes that trace them, and the session that
//! runs both in the background.

#![allow(missing_docs, reason = "fields and functions whose names say it")]

pub mod film;
pub mod image_file;

mod bounce_shares;
mod checkpoint;
mod error_parts;
mod error_probe;
pub mod export;
mod file_error;
mod first_hit_buffer;
mod first_pass;
pub mod memory_budget;
pub mod pass;
pub mod plan;
mod region_render;
mod relighting;
mod render_state;
mod roughness_mix;
pub mod schedule;
pub mod session;
mod sync_render;
mod threads;
pub mod wave;

pub use bounce_shares::BOUNCE_SHARES;
pub use checkpoint::{Checkpoint, SampleInputs};
pub use error_parts::{ErrorParts, ErrorTarget, ROUNDING_TO_8_BITS};
pub use file_error::FileError;
pub use first_hit_buffer::FirstHitBuffer;
pub use region_render::RegionRender;
pub use relighting::Relighting;
pub use render_state::{Options, RenderState};
pub use sync_render::SyncRender;
