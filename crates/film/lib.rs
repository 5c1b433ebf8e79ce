//! zerkalo, part 2 of 4: films, and the pictures and film files that are written from them.
//!
//! The source is in `src`, one folder per module. The crate is separate so that it compiles beside
//! part 3, which contains the kernels.

use zerkalo_scene::{disk, lanes, value};

#[path = "../../src/film/mod.rs"]
pub mod film;
