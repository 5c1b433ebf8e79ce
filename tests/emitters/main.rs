//! Lights with a size against closed forms, in single and double precision.

#[path = "../common/normal.rs"]
mod normal;

mod forms;
mod irradiance;
mod mirrors;
mod setup;
