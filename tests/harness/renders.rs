//! Renders that tests drive wave by wave, without a clock or channels.
use super::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::Deref;
use zerkalo_render as render;
use zerkalo_render::wave::{Job, Wave, WaveReport};

/// Folders of scene files.
const FOLDERS: [&str; 2] = ["scenes", "scenes/features"];

/// Returns the path of the scene file `name`.
pub fn shipped_path(name: &str) -> PathBuf {
    let folders = FOLDERS.map(|folder| Path::new(env!("ZERKALO_ROOT")).join(folder).join(name));
    folders.into_iter().find(|path| path.exists()).unwrap_or_else(|| panic!("no scene {name}"))
}

pub fn shipped(name: &str) -> Scene {
    Scene::read(&shipped_path(name)).unwrap_or_else(|e| panic!("{e}"))
}

/// Returns every scene of the folders of scenes with its file name, sorted by name.
pub fn all_shipped() -> Vec<(String, Scene)> {
    let folders = FOLDERS.map(|folder| Path::new(env!("ZERKALO_ROOT")).join(folder));
    let files = folders.iter().flat_map(|folder| fs::read_dir(folder).unwrap());
    let files = files.map(|entry| entry.unwrap().path());
    let mut paths: Vec<PathBuf> =
        files.filter(|p| p.extension().is_some_and(|e| e == "toml")).collect();
    paths.sort_by_key(|path| path.file_name().map(|name| name.to_owned()));
    assert!(paths.len() >= 30, "only {} scenes", paths.len());
    let name = |path: &Path| path.file_name().unwrap().to_str().unwrap().to_string();
    paths.iter().map(|path| (name(path), shipped(&name(path)))).collect()
}

/// Returns `scene` with a film of `size` pixels. The view angle stays the same.
pub fn sized(mut scene: Scene, size: [u32; 2]) -> Scene {
    scene.film.size = size;
    scene
}

/// Returns the scene in `text`. Panics if it has errors.
pub fn parsed(text: &str) -> Scene {
    Scene::parse(text, NAME).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

pub fn sobol(seed: u64) -> SampleSettings {
    SampleSettings { seed, kind: SamplerKind::Sobol }
}

pub fn render_options(sampling: SampleSettings) -> render::Options {
    render::Options { world: Options::default(), sampling, display: Display::default() }
}

pub fn begin(scene: &Scene, seed: u64, precision: Precision) -> RenderState {
    begin_with(scene, sobol(seed), precision)
}

pub fn begin_with(scene: &Scene, sampling: SampleSettings, precision: Precision) -> RenderState {
    let mut options = render_options(sampling);
    options.world.precision = precision;
    RenderState::new(&Arc::new(scene.clone()), &options, None).unwrap()
}

pub fn new_session(threads: usize, seed: u64, stop: Stop, adaptive: bool) -> Session {
    let settings = settings(adaptive, 0, stop);
    Session::new(threads, render_options(sobol(seed)), settings).unwrap()
}

/// Returns the stop criterion of `spp` samples per pixel.
pub fn spp_stop(spp: u32) -> Stop {
    Stop { spp: Some(spp), ..Stop::default() }
}

/// Returns the stop criterion of a noise of at most `levels` 8-bit levels.
pub fn noise_stop(levels: f64) -> Stop {
    Stop { noise_levels: Some(levels), ..Stop::default() }
}

static FREE_POOLS: Mutex<Vec<ThreadPool>> = Mutex::new(Vec::new());

/// Thread pool that other tests reuse after it is dropped. Starting and ending threads takes longer
/// than tracing a small picture, because each end of a thread unmaps its stack in all threads of
/// the process.
pub struct Pool(Option<ThreadPool>);

pub fn pool(threads: usize) -> Pool {
    let mut free = FREE_POOLS.lock().unwrap();
    let found = free.iter().position(|pool| pool.current_num_threads() == threads);
    let pool = found.map(|i| free.swap_remove(i));
    let new = || ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    Pool(Some(pool.unwrap_or_else(new)))
}

impl Deref for Pool {
    type Target = ThreadPool;

    fn deref(&self) -> &ThreadPool {
        self.0.as_ref().unwrap()
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        FREE_POOLS.lock().unwrap().extend(self.0.take());
    }
}

/// Returns a wave with one job for each tile, in the order of the film. The jobs trace the samples
/// `first .. first + count` of one replicate.
pub fn wave(film: &Film, replicate: usize, first: u32, count: u32) -> Wave {
    let jobs = (0..film.tile_count() as u32).map(|tile| Job { tile, first, count }).collect();
    Wave { replicate, jobs, estimate: false }
}

pub fn trace(rendering: &mut RenderState, wave: &Wave, pool: &ThreadPool) -> WaveReport {
    rendering.trace_wave(wave, pool, &AtomicBool::new(false))
}

/// Traces the samples `first .. first + count` of both replicates in every pixel.
pub fn uniform(rendering: &mut RenderState, first: u32, count: u32, pool: &ThreadPool) {
    for replicate in [0, 1] {
        let wave = wave(&rendering.film, replicate, first, count);
        trace(rendering, &wave, pool);
    }
}

/// Renders `scene` by two threads, with `count` samples per pixel in each replicate.
pub fn rendered(scene: &Scene, seed: u64, precision: Precision, count: u32) -> RenderState {
    let mut rendering = begin(scene, seed, precision);
    uniform(&mut rendering, 0, count, &pool(2));
    rendering
}

/// Renders `scene` by one thread with the given acceleration structure. Each of the two replicates
/// gets `count` samples per pixel.
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

/// Removes all random choices from a scene: anti-aliasing, the lens, blurred lobes, lights with a
/// size, emission, diffuse bounces, and the choice among many point lights. Also limits the depth
/// to 2 if a material transmits light, because paths choose between reflection and refraction at
/// random behind the second transmitting surface.
pub fn without_chance(scene: &mut Scene) {
    scene.film.filter = Filter::Point;
    scene.camera.aperture = None;
    scene.trace.max_diffuse_depth = 0;
    scene.lights.retain(|light| !light.has_radiance());
    // With 16 point lights or more, a path traces shadow rays from each surface to a random few of
    // them.
    scene.lights.truncate(15);
    for material in scene.materials.values_mut() {
        (material.roughness, material.alpha, material.emission) = (0.0, None, 0.0);
        if material.transmission > 0.0 {
            scene.trace.max_depth = scene.trace.max_depth.min(2);
        }
    }
}

/// Renders by a schedule until it stops, with a clock that always shows 0. Returns the criterion
/// that stopped the render.
pub fn follow(rendering: &mut RenderState, settings: Settings, pool: &ThreadPool) -> StoppedBy {
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

/// Returns the settings of a schedule that minimises the error in 8-bit levels.
pub fn settings(adaptive: bool, rays_per_pixel: u32, stop: Stop) -> Settings {
    Settings { adaptive, criterion: Criterion::Levels, rays_per_pixel, stop }
}

/// Returns the radiance of every pixel, row by row.
pub fn picture(rendering: &RenderState, replicates: Replicates) -> Vec<[f64; 3]> {
    let RenderState { film, weights, .. } = rendering;
    (0..film.header.height).flat_map(|y| film.row(y, replicates, weights)).collect()
}
