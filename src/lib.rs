//! zerkalo: a progressive, accumulating ray tracer with a dashboard in the terminal.
//!
//! This crate is the application. ARCHITECTURE.md describes the crates below it.

pub mod command;
pub mod dashboard;
pub mod measure;
