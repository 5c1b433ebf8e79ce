//! From a scene to a growing film: what to trace next, and the threads that do it.

mod course;
pub mod export;
mod first;
mod guide;
mod lighting;
pub mod pass;
mod rendering;
pub mod schedule;
pub mod session;
mod sites;
pub mod wave;

pub use course::Course;
pub use guide::Guide;
pub use lighting::Lighting;
pub use rendering::{Options, Rendering};
