//! Measurement of speed against accuracy on one scene: errors against a reference, seconds to a given
//! noise, cost and bias of each setting.
//!
//! Errors are those of a seeded picture and repeat exactly. Seconds are medians of repetitions. Settings
//! take turns, so that a slow moment of the machine affects all of them alike; repetitions in which
//! other programs used the processors are left out.

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
