//! Random scenes of all kinds, each rendered in several ways that must agree.
//!
//! Tests without `#[ignore]` compare a fixed, small set of scenes. Ignored tests, named `many_*`,
//! compare `ZERKALO_SCENES` scenes (default 200) from the seed `ZERKALO_FIRST` (default 0) on. With
//! `ZERKALO_SEED` every test compares the scene of that seed only. CONTRIBUTING.md has examples.
//!
//! A scene that differs is written to target/tmp/random_scenes, as drawn and as reduced within
//! `ZERKALO_SHRINK` seconds (default 10) to the smallest scene that still differs.

mod accelerations;
mod driver;
mod gaps;
mod layouts;
mod objects;
mod precisions;
mod samples;
mod scene;
mod shrink;
mod soundness;
mod statistics;
mod threads;
mod words;
