//! zerkalo: a progressive, accumulating ray tracer with a dashboard in the terminal.
//!
//! The application. ARCHITECTURE.md lists the crates of the library.

pub mod command;
pub mod dashboard;
pub mod measure;
