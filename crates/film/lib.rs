//! zerkalo, part 3 of 5: films, and the pictures and film files that are written from them.
//!
//! The source is in `src`, one folder per module. The crate is separate so that it compiles beside
//! part 4, which contains the kernels.

use zerkalo_scene::{disk, lanes, value};

#[path = "../../src/film/mod.rs"]
pub mod film;
