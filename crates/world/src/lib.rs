//! World: a scene compiled for one SIMD type, and the integrators that trace paths in it.

mod any_world;
mod clearance;
mod compile;
mod culling;
mod emissive_sheets;
mod integrator;
mod light_choice;
mod light_groups;
mod lights_on_surfaces;
mod pixel_block;
mod precision;
mod radiance_range;
mod sample_reuse;
mod scene_inventory;
mod surface_emission;
mod tile_tracer;
mod truncation_bias;
#[allow(clippy::module_inception, reason = "the file of `World`, in the folder of the same name")]
mod world;

pub use any_world::{AnyWorld, Options, Precision, requires_double};
pub use integrator::first_hit::FirstHit;
pub use integrator::path::{Counts, Path, Radiance};
pub use light_groups::{LightGroupSource, LightGroups, MAX_GROUPS};
pub use pixel_block::MAX_BLOCK_PIXELS;
pub use tile_tracer::{CameraTracer, TileTracer, TracedPacket};
pub use world::{KERNELS, World};
