//! Render plans with given sample counts, for tests.

use crate::film::Display;
use crate::plan::{Plan, PlanSettings, PlannedTile};
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_world::Precision;

/// Creates the plan of a picture with one row of tiles, divided into `shards` parts. Each entry of
/// `tiles` has two sample counts of a tile, per pixel and replicate: in the base and in the merged
/// picture.
pub fn plan(shards: u32, tiles: &[[u32; 2]]) -> Plan {
    let tile = |[base, end]: &[u32; 2]| PlannedTile {
        base: *base,
        end: *end,
        rays_per_sample: 2.25,
        glossy: base % 2 == 0,
        earlier: Default::default(),
    };
    Plan {
        settings: PlanSettings {
            source: "scenes/room one.toml".into(),
            scene_hash: "fnv1a64:0123456789abcdef".into(),
            size: [16 * tiles.len() as u32, 16],
            seed: 7,
            sampler: SamplerKind::Sobol,
            precision: Precision::Single,
            display: Display::default(),
            rays_per_pixel: 0,
            noise_levels: 0.25,
            shards,
            round: 1,
            base_plan: None,
            base_rays: 0,
            total_rays: 0.0,
        },
        predicted_levels: 0.248,
        slopes: [0.5, 0.75],
        tiles: tiles.iter().map(tile).collect(),
    }
}
