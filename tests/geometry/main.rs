//! Ray intersection against closed forms and exact arithmetic.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/rays.rs"]
mod rays;

mod bits;
mod light;
mod mirror;
mod torus;
mod transforms;
mod tree;
