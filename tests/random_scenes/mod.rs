//! Random scenes of all kinds, each rendered in several ways whose pictures must agree.
//!
//! Tests without `#[ignore]` compare a fixed, small set of scenes. Ignored tests, named `many_*`,
//! compare `ZERKALO_SCENES` scenes (default 200), starting with the seed `ZERKALO_FIRST` (default
//! 0). If `ZERKALO_SEED` is set, every test compares only the scene of that seed. CONTRIBUTING.md
//! has examples.
//!
//! A scene whose pictures differ is written to target/tmp/random_scenes in two forms: complete, and
//! reduced to a smaller scene that still fails. The reduction takes at most `ZERKALO_SHRINK`
//! seconds (default 10).

/// Defines a test that compares random scenes, and an ignored one of more scenes.
macro_rules! scene_tests {
    ($name:ident, $seeds:expr, $many:ident, $many_seeds:expr, $check:ident) => {
        #[test]
        fn $name() {
            compare(stringify!($name), $seeds, $check);
        }

        #[test]
        #[ignore = "long: ZERKALO_SCENES scenes"]
        fn $many() {
            compare(stringify!($name), $many_seeds, $check);
        }
    };
}

mod accelerations;
mod divisions;
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
