//! Random scenes of all kinds, each rendered in several ways that must agree.
//!
//! The tests without `#[ignore]` compare the same few scenes each time. Those with it, named `many`, compare
//! `ZERKALO_SCENES` scenes (200) from the seed `ZERKALO_FIRST` (0) on; `ZERKALO_SEED` has any test compare the
//! scene of that seed alone. CONTRIBUTING.md has examples.
//!
//! A scene that differs is written to target/tmp/random_scenes as it was drawn and made as small as still differs
//! within `ZERKALO_SHRINK` seconds (10).

mod accelerations;
#[path = "../common/mod.rs"]
mod common;
mod driver;
mod gaps;
mod layouts;
#[path = "../common/normal.rs"]
mod normal;
mod precisions;
mod samples;
mod scene;
mod shrink;
mod soundness;
mod statistics;
#[path = "../support/mod.rs"]
mod support;
mod things;
mod threads;
mod words;
