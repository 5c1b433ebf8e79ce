//! Scenes and simulated reports of the renderer for tests.

use zerkalo_render::film::{ByMeasure, Noise};
use zerkalo_render::schedule::Spp;
use zerkalo_render::session::{QUALITIES, Report, State};
use zerkalo_scene::Scene;
use zerkalo_world::Precision;

/// Text of the scene that `zerkalo new` writes.
pub const STARTER: &str = include_str!("../command/starter.toml");

/// Returns the scene `scenes/mirror-room.toml`.
pub fn mirror_room() -> Scene {
    let text = include_str!("../../scenes/mirror-room.toml");
    Scene::parse(text, "mirror-room.toml").unwrap_or_else(|e| panic!("{e}"))
}

/// Creates a report of the renderer after `spp` samples in each of ten thousand pixels.
/// `generation` is the number of the scene's version, and `noise_levels` the estimated noise in
/// 8-bit levels.
pub fn report(generation: u64, spp: u64, noise_levels: Option<f64>) -> Report {
    Report {
        generation,
        state: State::Tracing,
        spp: Spp { min: spp as u32, mean: spp as f64, max: spp as u32 },
        samples: spp * 10_000,
        rays: spp * 20_000,
        seconds: spp as f64 * 1e-3,
        compile_seconds: 1e-4,
        first_picture_seconds: Some(0.02),
        noise: noise_levels.map(|levels| Noise {
            rmse: ByMeasure { linear: levels / 255.0, levels },
            p95_levels: 2.0 * levels,
            effective_pixels: ByMeasure { linear: 1e4, levels: 1e4 },
        }),
        error: None,
        probe_seconds: [0.0; 2],
        rounding_avoided: None,
        mixed: false,
        eta_seconds: None,
        quality_seconds: [None; QUALITIES.len()],
        progress: None,
        bad_samples: 0,
        saturated_samples: 0,
        saturated_pixels: 0,
        recent_samples_per_second: 1e7,
        threads: 2,
        precision: Some(Precision::Single),
        lanes: "f32x8",
        inventory: "1 sphere (list)".into(),
    }
}
