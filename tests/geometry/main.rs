//! What rays meet, against closed forms, exact arithmetic and the extremes of sizes and places.

#[path = "../common/mod.rs"]
mod common;

mod bits;
mod camera;
mod cauchy;
mod coincident;
mod compound;
mod degenerate;
mod light;
mod mirror;
mod rays;
mod shadow;
mod sphere;
mod tapered;
mod transforms;
mod tree;
