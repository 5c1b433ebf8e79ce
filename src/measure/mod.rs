//! The trade of speed for accuracy, measured on one scene: errors against a reference, seconds to a
//! given noise, what each setting costs and what it gets wrong.
//!
//! Errors are those of a seeded picture and come out the same each time; seconds are medians of
//! repetitions, taken in turns so that a slow moment of the machine hits all settings alike, and those
//! in which other programs took the processors are left out.

mod contention;
mod convergence_order;
mod error_curve;
mod experiment;
pub mod plot;
mod reference;
mod result;
mod run;

pub use convergence_order::Slope;
pub use error_curve::Point;
pub use experiment::{Experiment, Plan, Variant};
pub use reference::{Bias, Errors, Reference};
pub use result::{Expected, Measured, Measurement, Steadiness, TimeToTarget, median, spread};
pub use run::{Progress, measure};
