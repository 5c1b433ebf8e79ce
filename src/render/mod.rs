//! From a scene to a growing film: what to trace next, and the threads that do it.

pub mod export;
pub mod pass;
mod rendering;
pub mod schedule;
pub mod session;
pub mod wave;

pub use rendering::{Options, Rendering};
