//! Tests of pictures: tracing, sampling, accumulation and files.
//!
//! They are one program, so that the kernels are compiled once for all of them. The program is in a
//! package of its own, which is optimised.

mod acceleration;
mod agreement;
mod big_picture;
mod clear_panes;
mod determinism;
mod emitters;
mod environment;
mod error_estimates;
mod extremes;
mod features;
mod film;
mod furnaces;
mod geometry;
mod harness;
mod limits;
mod linearity;
mod lobes;
mod mesh_scenes;
mod random_scenes;
mod reference;
mod scenes;
mod serving;
mod shards;
mod textures;
