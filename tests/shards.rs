//! Renders that are divided into shards: equality with a render by one process, interruption, and
//! the noise that a plan promises.

use crate::harness::*;
use zerkalo_render::film::Noise;
use zerkalo_render::plan::ShardRender;
use zerkalo_render::schedule::USUAL_SLOPE;
use zerkalo_render::{Options, SyncRender};

const THREADS: usize = 2;

fn scene(name: &str, size: Option<[u32; 2]>) -> Scene {
    let mut scene = shipped(&format!("{name}.toml"));
    scene.film.size = size.unwrap_or(scene.film.size);
    scene
}

fn rendering(scene: &Scene, seed: u64) -> RenderState {
    RenderState::new(&Arc::new(scene.clone()), &options(seed), None).unwrap()
}

fn options(seed: u64) -> Options {
    render_options(sobol(seed))
}

fn until(noise: f64) -> Settings {
    let stop = noise_stop(noise);
    Settings { adaptive: true, criterion: Criterion::Levels, rays_per_pixel: 0, stop }
}

/// Renders a scene adaptively until its noise is at most `noise` 8-bit levels.
fn adaptive(scene: &Scene, seed: u64, noise: f64) -> SyncRender {
    let mut render = SyncRender::new(scene, &options(seed), until(noise), THREADS).unwrap();
    while render.step().is_none() {}
    render
}

fn plan(scene: &Scene, pilot: &SyncRender, seed: u64, noise: f64, shards: u32) -> Plan {
    let settings = PlanSettings {
        source: "test".into(),
        scene_hash: "test".into(),
        size: scene.film.size,
        seed,
        sampler: SamplerKind::Sobol,
        precision: pilot.state.world.info().precision,
        display: Display::default(),
        rays_per_pixel: scene.film.rays_per_pixel,
        noise_levels: noise,
        shards,
        base_plan: None,
    };
    let mut schedule = pilot.schedule.clone();
    schedule.settings.stop = until(noise).stop;
    Plan::of_schedule(&schedule, [USUAL_SLOPE; 2], settings).unwrap()
}

fn shard(scene: &Scene, plan: &Plan, number: u32) -> (RenderState, u64) {
    let state = rendering(scene, plan.settings.seed);
    let mut render = ShardRender::new(state, &plan.ranges(number), 0, THREADS).unwrap();
    while render.step() {}
    assert_eq!(render.progress(), 1.0);
    let rays = render.rays;
    (render.state, rays)
}

/// Returns the sum of the films of the pilot and of all shards. Also returns the number of rays of
/// each shard.
fn merged(scene: &Scene, plan: &Plan, pilot: SyncRender) -> (RenderState, Vec<u64>) {
    let mut state = rendering(scene, plan.settings.seed);
    state.film.add(&pilot.state.film).unwrap();
    let mut rays = Vec::new();
    for number in 1..=plan.settings.shards {
        let (part, shard_rays) = shard(scene, plan, number);
        state.film.add(&part.film).unwrap();
        rays.push(shard_rays);
    }
    (state, rays)
}

fn noise(state: &RenderState) -> Noise {
    state.film.noise(&state.weights, &Display::default()).expect("an estimate of every tile")
}

#[test]
fn interrupted_shard_equals_uninterrupted() {
    let scene = scene("reflecting-tracks", Some([96, 64]));
    let pilot = adaptive(&scene, 0, 4.0);
    let plan = plan(&scene, &pilot, 0, 0.4, 2);
    let ranges = plan.ranges(2);
    let (whole, whole_rays) = shard(&scene, &plan, 2);
    let (mut film, mut rays, mut starts) = (Film::new(whole.film.header.clone()), 0, 0);
    loop {
        let mut state = rendering(&scene, 0);
        state.film.add(&film).unwrap();
        let mut render = ShardRender::new(state, &ranges, rays, THREADS).unwrap();
        if !render.step() {
            break;
        }
        starts += 1;
        rays = render.rays;
        film = render.state.film;
    }
    assert!(starts > 1, "the shard ended in its first step");
    assert!(film.bytes() == whole.film.bytes());
    assert_eq!(rays, whole_rays);
    // A film of another shard is refused.
    let mut state = rendering(&scene, 0);
    state.film.add(&film).unwrap();
    assert!(ShardRender::new(state, &plan.ranges(0), rays, THREADS).is_err());
}

/// Results of a render that is planned for eight shards. The noise is divided by the noise target,
/// and the number of rays by that of an adaptive render with this target. `pilot` is the fraction
/// of the rays in the pilot. `imbalance` is the excess of the largest shard's rays over the mean,
/// as a fraction.
struct Planned {
    noise: f64,
    rays: f64,
    pilot: f64,
    imbalance: f64,
}

fn planned(name: &str, size: Option<[u32; 2]>, seed: u64, target: f64) -> Planned {
    let scene = scene(name, size);
    let reference = adaptive(&scene, seed, target).schedule.rays as f64;
    let pilot = adaptive(&scene, seed, 2.0 * target);
    let plan = plan(&scene, &pilot, seed, target, 8);
    let pilot_rays = pilot.schedule.rays as f64;
    let (sum, shards) = merged(&scene, &plan, pilot);
    let total: u64 = shards.iter().sum();
    let largest = shards.iter().max().copied().unwrap_or(0) as f64;
    let result = Planned {
        noise: noise(&sum).rmse.levels / target,
        rays: (pilot_rays + total as f64) / reference,
        pilot: pilot_rays / (pilot_rays + total as f64),
        imbalance: 8.0 * largest / total.max(1) as f64 - 1.0,
    };
    println!(
        "{name:18} seed {seed}: noise {:.3} of the target, rays {:.3} of the adaptive render, \
         pilot {:.2} of the rays, largest shard {:.1} % above the mean",
        result.noise,
        result.rays,
        result.pilot,
        100.0 * result.imbalance
    );
    result
}

#[test]
fn planned_noise_is_near_the_target() {
    for (name, size) in [("mirror-room", [320, 240]), ("reflecting-tracks", [320, 240])] {
        let result = planned(name, Some(size), 0, 0.25);
        // The picture has a quarter of the usual number of pixels. The bounds are wide, because the
        // noise estimate of so few pixels is twice as uncertain as usual.
        assert!((0.8..=1.1).contains(&result.noise), "{name}: {}", result.noise);
        assert!(result.rays < 1.15, "{name}: {}", result.rays);
        // A shard gets 40 to 110 blocks. Their numbers of rays differ by a factor of three. The
        // largest shard may therefore have 25 % more rays than the mean.
        assert!(result.imbalance < 0.25, "{name}: {}", result.imbalance);
    }
}

#[test]
#[ignore = "takes minutes"]
fn planned_runs_of_eight_shards_meet_their_target() {
    for name in ["mirror-room", "reflecting-tracks", "glass-solids"] {
        for seed in 0..if name == "glass-solids" { 1 } else { 3 } {
            let result = planned(name, None, seed, 0.25);
            assert!(result.noise <= 1.1, "{name}, seed {seed}: {}", result.noise);
            assert!(result.rays <= 1.1, "{name}, seed {seed}: {}", result.rays);
        }
    }
}
