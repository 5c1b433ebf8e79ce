//! zerkalo, part 1 of 5: SIMD lanes and what needs nothing else, which are sampling and BVHs.
//!
//! The source is in `src`, one folder per module. The crate is separate so that it is optimised for
//! speed and part 2, which reads scenes, for size.

#[path = "../../src/bvh/mod.rs"]
pub mod bvh;
#[path = "../../src/lanes/mod.rs"]
pub mod lanes;
#[path = "../../src/sampling/mod.rs"]
pub mod sampling;
