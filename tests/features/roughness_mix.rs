//! Renders that begin with the picture of a smaller roughness: they agree with fresh renders, their
//! errors are honest, and they do not depend on threads or pieces.

use crate::features::row::*;
use crate::harness::*;
use zerkalo_render::SyncRender;

const SIZE: [u32; 2] = [64, 48];

fn with_mirror(lobe: Lobe, roughness: f64) -> Scene {
    let mut scene = sized(shipped("roughness-mix.toml"), SIZE);
    let mirror = material(&mut scene, "mirror");
    (mirror.lobe, mirror.roughness) = (lobe, roughness);
    scene
}

fn render(scene: &Scene, seed: u64, stop: Stop, threads: usize) -> SyncRender {
    let options = render_options(sobol(seed));
    finished(SyncRender::new(scene, &options, settings(true, 0, stop), threads).unwrap())
}

fn finished(mut render: SyncRender) -> SyncRender {
    while render.step().is_none() {}
    render
}

fn turned(render: SyncRender, scene: &Scene, seed: u64) -> SyncRender {
    finished(render.turn(scene, &render_options(sobol(seed))).expect("samples are reused"))
}

/// Renders of a lobe that are compared, each with another seed.
const SEEDS: u64 = 12;

/// Returns means of blocks.
fn blocks(render: &SyncRender) -> Vec<f64> {
    let mut sums = vec![0.0; 16 * 12 * 3];
    for (i, pixel) in picture(&render.state, Replicates::Both).iter().enumerate() {
        let block = i / 64 / 4 * 16 + i % 64 / 4;
        (0..3).for_each(|c| sums[3 * block + c] += pixel[c] / 16.0);
    }
    sums
}

/// Compares means of blocks over all seeds: `fresh`, and renders of `scene` that begin with the picture
/// of `base`. Student's t of 22 degrees of freedom exceeds 5.5 once in 60,000 values; each lobe has 576.
fn begins_with(base: &Scene, scene: &Scene, fresh: &[Vec<f64>]) -> Verdict {
    let scene = sized(scene.clone(), SIZE);
    let mut mixed = Vec::new();
    for seed in 0..SEEDS {
        let turned = render(base, seed, spp_stop(32), 1).turn(&scene, &render_options(sobol(seed)));
        mixed.push(blocks(&finished(turned.ok_or("no samples are reused")?)));
    }
    let n = SEEDS as f64;
    let moments = |all: &[Vec<f64>], i: usize| {
        let mean = all.iter().map(|b| b[i]).sum::<f64>() / n;
        (mean, all.iter().map(|b| (b[i] - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
    };
    let z = |i| {
        let ((a, var_a), (b, var_b)) = (moments(&mixed, i), moments(fresh, i));
        if var_a + var_b > 0.0 { (a - b) / (var_a + var_b).sqrt() } else { 0.0 }
    };
    let z: Vec<f64> = (0..mixed[0].len()).map(z).collect();
    let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
    let worst = z.iter().fold(0.0, |worst: f64, z| worst.max(z.abs()));
    ensure(worst < 5.5 && rms < 1.15, || format!("worst z {worst:.2}, rms {rms:.2}"))
}

#[test]
fn d16_roughness_mix() {
    for lobe in [Lobe::Cone, Lobe::Square, Lobe::Ggx, Lobe::Beckmann] {
        let (smooth, rough) = (with_mirror(lobe, 0.2), with_mirror(lobe, 0.25));
        let seeds = 1000..1000 + SEEDS;
        let fresh = seeds.map(|seed| blocks(&render(&rough, seed, spp_stop(32), 1)));
        let fresh: Vec<_> = fresh.collect();
        if lobe != Lobe::Cone {
            begins_with(&smooth, &rough, &fresh).unwrap_or_else(|e| panic!("{lobe:?}: {e}"));
            continue;
        }
        row(
            "roughness-mix.toml",
            |tested| begins_with(&smooth, tested, &fresh),
            &[
                ("a smaller step", &|s| material(s, "mirror").roughness = 0.22),
                ("a larger one", &|s| material(s, "mirror").roughness = 0.3),
                ("another lobe", &|s| material(s, "mirror").lobe = Lobe::Square),
            ],
        );
    }
}

#[test]
fn roughness_mix_does_not_depend_on_threads() {
    let (smooth, rough) = (with_mirror(Lobe::Cone, 0.2), with_mirror(Lobe::Cone, 0.25));
    let film = |threads| {
        let base = render(&smooth, 1, noise_stop(1.5), threads);
        turned(base, &rough, 1).state.film.bytes()
    };
    assert!(film(1) == film(3));
}

/// Checks that tiles whose order grows late keep all their samples, and that a picture without a noise
/// estimate is no base.
#[test]
fn roughness_mix_keeps_its_samples() {
    let (smooth, rough) = (with_mirror(Lobe::Cone, 0.2), with_mirror(Lobe::Cone, 0.25));
    let options = render_options(sobol(1));
    assert!(render(&smooth, 1, spp_stop(2), 1).turn(&rough, &options).is_none());
    let mut mixed = render(&smooth, 1, spp_stop(96), 1).turn(&rough, &options).unwrap();
    while mixed.step().is_none() {
        let film = &mixed.state.film;
        assert!((0..film.tile_count()).all(|i| film.counts(i)[0] == film.counts(i)[1]));
    }
}

/// Checks that a turn and its reversal cost no sample, and that a restart has no mix.
#[test]
fn roughness_mix_returns_to_its_base() {
    let (smooth, rough) = (with_mirror(Lobe::Cone, 0.2), with_mirror(Lobe::Cone, 0.25));
    let mut session = new_session(2, 3, noise_stop(1.5), true);
    let mut finish = |scene: Option<&Scene>| {
        let generation = match scene {
            Some(scene) => session.set_scene(Arc::new(scene.clone())),
            None => session.restart(),
        };
        let end = Instant::now() + Duration::from_secs(60);
        loop {
            assert!(Instant::now() < end, "not finished in time");
            let Some(snapshot) = session.wait(Duration::from_millis(100)) else { continue };
            let report = snapshot.report;
            if report.generation == generation && matches!(report.state, State::Finished(_)) {
                let bytes = session.with(|picture, _| picture.film.bytes()).unwrap();
                return (report.mixed, report.samples, bytes);
            }
        }
    };
    let before = finish(Some(&smooth));
    let (mixed, samples, film) = finish(Some(&rough));
    assert!(mixed && samples < before.1, "{samples} of {}", before.1);
    let base = render(&smooth, 3, noise_stop(1.5), 1);
    assert!(
        film == turned(base, &rough, 3).state.film.bytes(),
        "pieces of rounds have no influence"
    );
    assert!(finish(Some(&smooth)) == before);
    let again = finish(Some(&rough));
    assert!(again.0 && again.2 == film);
    let (mixed, _, afresh) = finish(None);
    assert!(!mixed && afresh == render(&rough, 3, noise_stop(1.5), 1).state.film.bytes());
}

/// Prints the figures of `docs/decisions/roughness-mix.md`.
#[test]
#[ignore = "figures: cargo test --release --test engine roughness_mix -- --ignored --nocapture"]
fn survey_of_roughness_mix() {
    let follow = |mut render: SyncRender| {
        let mut first = None;
        while render.step().is_none() {
            first = first.or(render.noise_levels());
        }
        (first.or(render.noise_levels()).unwrap(), render)
    };
    for (name, material, shrink) in
        [("mirror-room", "mirror", 1), ("lamp-and-mirror", "mirror", 2), ("triptych", "brushed", 2)]
    {
        let mut smooth = shipped(&format!("{name}.toml"));
        smooth.film.size = smooth.film.size.map(|side| side / shrink);
        let mut rough = smooth.clone();
        rough.materials.get_mut(material).unwrap().roughness *= 1.25;
        let (first, fresh) = follow(
            SyncRender::new(
                &rough,
                &render_options(sobol(0)),
                settings(true, 0, noise_stop(0.5)),
                1,
            )
            .unwrap(),
        );
        let base = render(&smooth, 0, noise_stop(0.5), 1);
        let (mixed_first, mixed) =
            follow(base.turn(&rough, &render_options(sobol(0))).expect("samples are reused"));
        let [rays, mixed_rays] = [&fresh, &mixed].map(|r| r.schedule.rays as f64);
        println!(
            "{name} | {first:.2} | {mixed_first:.2} ({:.2}) | {rays:.3e} | {mixed_rays:.3e} ({:.2})",
            mixed_first / first,
            mixed_rays / rays
        );
    }
}
