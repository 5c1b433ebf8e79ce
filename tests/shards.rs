//! Renders that are divided into shards: interruption, and the noise and rays of all rounds.

use crate::harness::*;
use zerkalo_render::film::file::EncodedFilm;
use zerkalo_render::film::{Estimator, Noise};
use zerkalo_render::plan::{ShardRender, TileReport};
use zerkalo_render::{Options, SyncRender};

const THREADS: usize = 2;

fn scene(name: &str, size: [u32; 2]) -> Scene {
    let mut scene = shipped(&format!("{name}.toml"));
    scene.film.size = size;
    scene
}

fn rendering(scene: &Scene) -> RenderState {
    RenderState::without_film(&Arc::new(scene.clone()), &options()).unwrap()
}

fn options() -> Options {
    render_options(sobol(0))
}

fn first_plan(scene: &Scene, noise: f64, shards: u32) -> Plan {
    let info = rendering(scene);
    let settings = PlanSettings {
        source: "test".into(),
        scene_hash: "test".into(),
        size: scene.film.size,
        seed: 0,
        sampler: SamplerKind::Sobol,
        precision: info.world.info().precision,
        display: Display::default(),
        rays_per_pixel: scene.film.rays_per_pixel,
        noise_levels: noise,
        shards,
        round: 1,
        base_plan: None,
        base_rays: 0,
        total_rays: 0.0,
    };
    Plan::first(settings, info.world.info().light_period)
}

#[test]
fn interrupted_shard_equals_uninterrupted() {
    let scene = scene("reflecting-tracks", [96, 64]);
    let mut plan = first_plan(&scene, 0.4, 2);
    plan.tiles.iter_mut().for_each(|tile| tile.end = 600);
    let start = || ShardRender::new(rendering(&scene), &plan, plan.share(2), THREADS).unwrap();
    let file = |render: &ShardRender| {
        let mut header = zerkalo_render::film::testing::header(&render.state.film);
        render.record(&mut header, false);
        EncodedFilm::new(&header, &render.state.film, None).pieces.concat()
    };
    let reader = |bytes: &[u8]| {
        let length = bytes.len() as u64;
        FilmReader::new(Path::new("a.zk"), std::io::Cursor::new(bytes.to_vec()), length).unwrap()
    };
    let mut whole = start();
    while whole.step() {}
    let (mut saved, mut starts) = (file(&start()), 0);
    loop {
        let mut render = start();
        render.resume(reader(&saved)).unwrap();
        if !render.step() {
            break;
        }
        starts += 1;
        saved = file(&render);
    }
    assert!(starts > 1, "the shard ended in its first step");
    assert!(saved == file(&whole));
    // A film of another shard is refused.
    let mut other = ShardRender::new(rendering(&scene), &plan, plan.share(1), THREADS).unwrap();
    assert!(other.resume(reader(&saved)).is_err());
}

/// Traces all rounds to the noise `target` in one process. Returns the last noise, as a share of the
/// target, and the rays, as a share of those of an adaptive render.
fn planned(name: &str, size: [u32; 2], target: f64) -> [f64; 2] {
    let scene = scene(name, size);
    let until = Settings::until(noise_stop(target));
    let mut adaptive = SyncRender::new(&scene, &options(), until, THREADS).unwrap();
    while adaptive.step().is_none() {}
    let mut plan = first_plan(&scene, target, 8);
    let mut rounds = String::new();
    let (noise, rays): (Noise, u64) = loop {
        let mut render = ShardRender::new(rendering(&scene), &plan, plan.whole(), THREADS).unwrap();
        while render.step() {}
        let state = &render.state;
        let estimator =
            Estimator::new(&state.film.header.scales, &state.weights, &Display::default());
        let error = |(i, report): (usize, &TileReport)| TileReport {
            error: state.film.tile(i).and_then(|tile| estimator.tile(tile)),
            ..*report
        };
        let reports: Vec<_> = render.reports().iter().enumerate().map(error).collect();
        let noise = Noise::of_tiles(reports.iter().map(|report| report.error)).unwrap();
        rounds += &format!(" {:.3}", noise.rmse.levels / target);
        let rays = plan.settings.base_rays + render.rays();
        match plan.next(&reports, target).unwrap() {
            Some(next) => plan = next,
            None => break (noise, rays),
        }
    };
    let result = [noise.rmse.levels / target, rays as f64 / adaptive.schedule.rays as f64];
    println!(
        "{name:18} noise after each round{rounds} of the target, {:.3} of the adaptive rays",
        result[1]
    );
    result
}

#[test]
fn last_round_meets_the_target_with_the_rays_of_an_adaptive_render() {
    for name in ["mirror-room", "reflecting-tracks"] {
        let [noise, rays] = planned(name, [240, 180], 0.5);
        assert!((0.95..=1.03).contains(&noise), "{name}: {noise}");
        assert!(rays <= 1.12, "{name}: {rays}");
    }
}

#[test]
#[ignore = "takes minutes"]
fn all_rounds_meet_the_target_in_larger_pictures() {
    for name in ["mirror-room", "reflecting-tracks", "glass-solids", "triptych"] {
        let [noise, rays] = planned(name, [320, 240], 0.25);
        assert!((0.95..=1.03).contains(&noise), "{name}: {noise}");
        assert!(rays <= 1.1, "{name}: {rays}");
    }
}
