//! The trade of speed for accuracy, measured on one scene: errors against a reference, seconds to a
//! given noise, what each setting costs and what it gets wrong.
//!
//! Errors are those of a seeded picture and come out the same each time; seconds are medians of
//! repetitions, taken in turns so that a slow moment of the machine hits all settings alike, and those
//! in which other programs took the processors are left out.

mod calm;
mod curve;
mod picture;
mod plan;
pub mod plot;
mod result;
mod run;
mod slope;

pub use curve::Point;
pub use picture::{Bias, Errors, Reference};
pub use plan::{Plan, Topic, Variation};
pub use result::{Crossing, Expected, Measured, Measurement, Steadiness, median, spread};
pub use run::{Progress, measure};
pub use slope::Slope;
