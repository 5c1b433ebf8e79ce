//! Renderings that tests drive wave by wave, without a clock or channels.
#![allow(dead_code, reason = "each of the two test programs uses a part")]

use crate::common::NAME;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use zerkalo::film::{Display, Film, Replicates};
use zerkalo::render::schedule::{Criterion, Settings, Step, Stop, StoppedBy};
use zerkalo::render::session::Session;
use zerkalo::render::wave::{Job, Wave, WaveReport};
use zerkalo::render::{Options, RenderState};
use zerkalo::sampling::{SampleSettings, SamplerKind};
use zerkalo::scene::{Acceleration, Filter, Scene};
use zerkalo::world::{self, Precision};

/// The shipped scene `name` of the folder `scenes`.
pub fn shipped(name: &str) -> Scene {
    let path = Path::new(env!("ZERKALO_ROOT")).join("scenes").join(name);
    Scene::read(&path).unwrap_or_else(|e| panic!("{e}"))
}

/// Every shipped scene of the folder `scenes`, sorted by file name.
pub fn all_shipped() -> Vec<(String, Scene)> {
    let folder = Path::new(env!("ZERKALO_ROOT")).join("scenes");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> =
        files.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    paths.sort();
    assert!(paths.len() >= 30, "only {} scenes", paths.len());
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_string();
    paths.iter().map(|path| (name(path), shipped(&name(path)))).collect()
}

/// `scene` with a film of `size` pixels. The view angle stays.
pub fn sized(mut scene: Scene, size: [u32; 2]) -> Scene {
    scene.film.size = size;
    scene
}

/// The scene in `text`; panics if it has faults.
pub fn parsed(text: &str) -> Scene {
    Scene::parse(text, NAME).unwrap_or_else(|e| panic!("{e}"))
}

/// Render state without samples.
pub fn begin(scene: &Scene, seed: u64, precision: Precision) -> RenderState {
    begin_with(scene, SampleSettings { seed, kind: SamplerKind::Sobol }, precision)
}

/// A rendering without samples, with the given sampler settings.
pub fn begin_with(scene: &Scene, sampling: SampleSettings, precision: Precision) -> RenderState {
    let world = world::Options { precision, ..world::Options::default() };
    RenderState::new(scene, &Options { world, sampling, display: Display::default() }, None)
}

/// A session that traces with `threads` threads until `stop`.
pub fn session(threads: usize, seed: u64, stop: Stop, adaptive: bool) -> Session {
    let options = Options {
        world: world::Options::default(),
        sampling: SampleSettings { seed, kind: SamplerKind::Sobol },
        display: Display::default(),
    };
    let settings = Settings { adaptive, criterion: Criterion::Codes, rays_per_pixel: 0, stop };
    Session::new(threads, options, settings).unwrap()
}

/// A pool of `threads` threads.
pub fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// A wave of samples `first .. first + count` in every tile, in film order.
pub fn wave(film: &Film, replicate: usize, first: u32, count: u32) -> Wave {
    let jobs = (0..film.tile_count() as u32).map(|tile| Job { tile, first, count }).collect();
    Wave { replicate, jobs, estimate: false }
}

/// Traces a whole wave.
pub fn trace(rendering: &mut RenderState, wave: &Wave, pool: &rayon::ThreadPool) -> WaveReport {
    rendering.trace_wave(wave, pool, &AtomicBool::new(false))
}

/// Traces samples `first .. first + count` of both replicates in every pixel.
pub fn uniform(rendering: &mut RenderState, first: u32, count: u32, pool: &rayon::ThreadPool) {
    for replicate in [0, 1] {
        let wave = wave(&rendering.film, replicate, first, count);
        trace(rendering, &wave, pool);
    }
}

/// A rendering of `scene` with `count` samples in each of both replicates, traced by two threads.
pub fn rendered(scene: &Scene, seed: u64, precision: Precision, count: u32) -> RenderState {
    let mut rendering = begin(scene, seed, precision);
    uniform(&mut rendering, 0, count, &pool(2));
    rendering
}

/// A rendering of `scene` with the given acceleration structure, `count` samples in each of both replicates,
/// traced by one thread.
pub fn accelerated(
    scene: &Scene,
    acceleration: Acceleration,
    precision: Precision,
    count: u32,
) -> RenderState {
    let mut scene = scene.clone();
    scene.trace.acceleration = acceleration;
    let mut rendering = begin(&scene, 5, precision);
    uniform(&mut rendering, 0, count, &pool(1));
    rendering
}

/// Removes all random choices from a scene: anti-aliasing, the lens, blurred lobes, lights with a size,
/// emission, diffuse bounces, the choice among many point lights, and the choice between reflection and refraction,
/// which begins behind the second transmitting surface.
pub fn without_chance(scene: &mut Scene) {
    scene.film.filter = Filter::Point;
    scene.camera.aperture = None;
    scene.trace.max_diffuse_depth = 0;
    scene.lights.retain(|light| {
        light.sphere.is_none()
            && light.rectangle.is_none()
            && light.disk.is_none()
            && light.environment.is_none()
    });
    // Of 16 point lights or more, each surface chooses some.
    scene.lights.truncate(15);
    for material in scene.materials.values_mut() {
        (material.roughness, material.alpha, material.emission) = (0.0, None, 0.0);
        if material.transmission > 0.0 {
            scene.trace.max_depth = scene.trace.max_depth.min(2);
        }
    }
}

/// Runs a schedule until it stops, with a clock that stands at 0.
pub fn follow(
    rendering: &mut RenderState,
    settings: Settings,
    pool: &rayon::ThreadPool,
) -> StoppedBy {
    let mut schedule = rendering.schedule(settings);
    loop {
        match schedule.next(0.0) {
            Step::Finished(reason) => return reason,
            Step::Trace(wave) => {
                let report = trace(rendering, &wave, pool);
                schedule.complete(&wave, &report);
            }
        }
    }
}

/// Settings that minimise the error in 8-bit levels.
pub fn settings(adaptive: bool, rays_per_pixel: u32, stop: Stop) -> Settings {
    Settings { adaptive, criterion: Criterion::Codes, rays_per_pixel, stop }
}

/// Radiance of every pixel, `[row][column]`.
pub fn picture(rendering: &RenderState, replicates: Replicates) -> Vec<[f64; 3]> {
    let mut row = Vec::new();
    let mut all = Vec::new();
    for y in 0..rendering.film.height() {
        rendering.film.row(y, replicates, &rendering.mix, &mut row);
        all.extend_from_slice(&row);
    }
    all
}
