//! Shapes: what users describe, one kind a file, and what rays meet, one batch per form.

mod form;

pub use form::{Form, HalfSpace};
