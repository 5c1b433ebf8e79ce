//! Measurement of speed against accuracy on one scene: errors against a reference picture, seconds
//! to a given noise, cost and bias of each setting.
//!
//! Errors are exactly reproducible, because the random seed is fixed. Seconds are medians of
//! repetitions. The repetitions of all settings take turns, so that a slow moment of the machine
//! affects all settings alike.

#![allow(missing_docs, reason = "fields and functions whose names say it")]

mod convergence_order;
mod error_curve;
mod experiment;
pub mod plot;
mod reference_image;
mod result;
mod run;

pub use convergence_order::Slope;
pub use error_curve::Point;
pub use experiment::{DEFAULT, EXPERIMENTS, Experiment, Plan, Variant};
pub use reference_image::{Bias, Errors, Reference};
pub use result::{Expected, Measured, Measurement, Median, TimeToTarget, median, spread};
pub use run::{Observer, measure};
