//! World: a scene compiled for one SIMD type, and the integrators that trace paths in it.

mod analysis;
mod any_world;
mod compile;
mod culling;
mod integrator;
mod lights;
mod pixel_block;
mod tile_tracer;
#[allow(clippy::module_inception, reason = "the file of `World`, in the folder of the same name")]
mod world;

pub use any_world::{AnyWorld, Options, Precision, requires_double};
pub use integrator::KERNELS;
pub use integrator::first_hit::FirstHit;
pub use integrator::path::{Counts, MAX_ORDER, Path, Radiance};
pub use lights::groups::{LightGroupSource, LightGroups, MAX_GROUPS};
pub use pixel_block::MAX_BLOCK_PIXELS;
pub use tile_tracer::{CameraTracer, CulledTile, TileTracer};
pub use world::{World, WorldInfo};
