//! Changes that a client makes while a session runs: lights, stop criteria, display, threads.
//! Samples must be kept where possible, and noise estimates and films must equal those of a fresh
//! render.

mod noise;
mod noise_by_bounce;

use crate::harness::*;
use std::sync::mpsc::channel;
use zerkalo_render::film::{LinearImage, Window};
use zerkalo_render::session::{Snapshot, View};

const SCENE: &str = r#"
film.size = [100, 70]
camera = { eye = [0.0, 1.0, 4.0], target = [0.0, 0.5, 0.0] }
ambient.color = [0.05, 0.05, 0.1]
background.color = [0.1, 0.2, 0.3]
materials.red = { color = [0.8, 0.2, 0.1] }
materials.mirror = { diffuse = 0.1, reflection = 0.9, roughness = 0.3 }
[[light]]
name = "lamp"
point = { position = [2.0, 4.0, 3.0] }
[[light]]
directional = { direction = [1.0, -1.0, -1.0] }
intensity = 0.3
[[object]]
material = "red"
shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }
[[object]]
material = "mirror"
shape.rectangle = { center = [0.0, 1.0, -1.0], size = [4.0, 2.0], normal = [0.0, 0.0, 1.0] }
"#;

const PATIENCE: Duration = Duration::from_secs(60);

fn scene() -> Scene {
    Scene::parse(SCENE, "test").unwrap()
}

fn session(stop: Stop, adaptive: bool) -> Session {
    new_session(2, 3, stop, adaptive)
}

fn wait(session: &Session, wanted: impl Fn(&Snapshot) -> bool) -> Snapshot {
    let end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        if let Some(snapshot) = session.wait(Duration::from_millis(100)).filter(&wanted) {
            return snapshot;
        }
    }
    panic!("no such snapshot in time")
}

/// Renders `scene` and waits until the render is finished. Returns the last snapshot.
fn finish(session: &mut Session, scene: &Scene) -> Snapshot {
    let generation = session.set_scene(Arc::new(scene.clone()));
    resting(session, generation)
}

fn resting(session: &Session, generation: u64) -> Snapshot {
    let done = |s: &Snapshot| {
        s.report.generation == generation && matches!(s.report.state, State::Finished(_))
    };
    wait(session, done)
}

fn bytes(session: &Session) -> Vec<u8> {
    session.with(|rendering, _| rendering.film.bytes()).unwrap()
}

/// Returns the scene with changed colours and intensities of lights. No light is switched off, so
/// that the film keeps all light groups.
fn relit() -> Scene {
    let mut scene = scene();
    scene.ambient.color = Color([0.3, 0.1, 0.0]);
    scene.background.color = Color([0.0, 0.4, 0.1]);
    scene.lights[0].color = Color([0.2, 1.0, 0.7]);
    scene.lights[0].intensity = 2.5;
    scene.lights[1].intensity = 0.01;
    scene
}

#[test]
fn relit_picture_equals_fresh_render() {
    let mut fresh = session(spp_stop(64), false);
    let expected = finish(&mut fresh, &relit());
    let film = bytes(&fresh);

    // The lights change after the first render has finished, or at some moment during it.
    for wait_us in [None, Some(0), Some(300), Some(3000), Some(9000)] {
        let mut session = session(spp_stop(64), false);
        let first = match wait_us {
            None => finish(&mut session, &scene()).report.generation,
            Some(us) => {
                let generation = session.set_scene(Arc::new(scene()));
                wait(&session, |s| s.report.generation == generation);
                std::thread::sleep(Duration::from_micros(us));
                generation
            }
        };
        let end = finish(&mut session, &relit());
        assert!(end.report.generation > first);
        assert!(bytes(&session) == film, "after {wait_us:?}");
        assert_eq!(end.weights, expected.weights);
        assert_eq!(end.report.noise, expected.report.noise, "after {wait_us:?}");
        assert_eq!(end.report.spp, expected.report.spp);
        assert_eq!(end.report.samples, expected.report.samples);
        let pixel = session.with(|r, _| r.film.pixel(50, 40, &r.weights));
        assert_eq!(pixel, fresh.with(|r, _| r.film.pixel(50, 40, &r.weights)));
    }
}

#[test]
fn light_changes_keep_samples() {
    let mut session = session(spp_stop(64), true);
    session.set_view(View { raster: Some([10, 7]), ..View::default() });
    let before = finish(&mut session, &scene());
    let newer = relit();
    let mix = before.weights_for(&newer).expect("the film serves the scene");
    let generation = session.set_scene(Arc::new(newer.clone()));
    // All snapshots after the light change contain all samples of the first render.
    let after = wait(&session, |s| {
        assert_eq!(s.report.samples, before.report.samples);
        s.report.generation == generation && s.report.noise.is_some()
    });
    // The old snapshot, mixed by the client with the new light weights, equals the new snapshot.
    assert_eq!(after.weights, mix);
    assert_eq!(before.picture.unwrap().mixed(&mix), after.picture.unwrap().mixed(&after.weights));
    assert_eq!(after.first_hits, before.first_hits);
    // Edits without effect on the picture: a light's name, an unused material, and a cap of rays
    // per pixel that is not reached.
    let mut renamed = newer.clone();
    renamed.lights[0].name = "sun".to_string();
    renamed.materials.insert("spare".to_string(), renamed.materials["red"].clone());
    renamed.film.rays_per_pixel = 1000;
    let renamed = finish(&mut session, &renamed);
    assert_eq!(renamed.report.samples, before.report.samples);
    assert_eq!(renamed.report.noise, after.report.noise);
    let names = session.with(|rendering, _| rendering.group_names()).unwrap();
    assert_eq!(names, ["ambient", "background", "sun", "light 2"]);
    // A moved light needs new samples.
    let mut moved = newer;
    moved.lights[0].position_mut().unwrap()[0] = 1.0;
    assert_eq!(after.lighting.unwrap().weights(&moved), None);
    session.set_stop(spp_stop(16));
    let generation = session.set_scene(Arc::new(moved));
    let first = wait(&session, |s| s.report.generation == generation);
    assert!(first.report.samples < before.report.samples);
}

#[test]
fn noisy_light_change_resumes_finished_session() {
    let mut session = session(noise_stop(0.15), true);
    let dim = finish(&mut session, &scene()).report;
    assert_eq!(dim.state, State::Finished(StoppedBy::Noise));
    let mut bright = scene();
    bright.lights[0].intensity = 2.0;
    let generation = session.set_scene(Arc::new(bright.clone()));
    let report = wait(&session, |s| {
        assert!(s.report.samples >= dim.samples, "nothing is lost");
        s.report.generation == generation && matches!(s.report.state, State::Finished(_))
    })
    .report;
    assert!(report.samples > dim.samples, "the target was not met: {:?}", dim.noise);
    assert!(report.noise.unwrap().rmse.levels <= 0.15);
    // The reported estimate equals the one that the current film gives if it is computed anew.
    let film = session.with(|r, _| r.film.noise(&r.weights, &Display::default())).unwrap().unwrap();
    assert_eq!(report.noise.unwrap(), film);
    // With the original lights the noise is lower again, so that the session stays finished.
    let back = finish(&mut session, &scene()).report;
    assert_eq!(back.samples, report.samples);
    assert!(back.noise.unwrap().rmse.levels < 0.15);
}

#[test]
fn switched_off_light_keeps_group_until_restart() {
    let mut session = session(spp_stop(32), true);
    let groups = |session: &Session| session.with(|r, _| r.film.groups());
    let before = finish(&mut session, &scene()).report;
    let mut dark = scene();
    dark.lights[0].on = false;
    let off = finish(&mut session, &dark);
    assert_eq!((off.report.samples, groups(&session)), (before.samples, Some(4)));
    assert_eq!(off.weights.weights[2], [0.0; 3]);
    // The new film has no group for the light that is off.
    let generation = session.restart();
    resting(&session, generation);
    assert_eq!(groups(&session), Some(3));
    // If the light without a group is switched on, the render restarts with a new film.
    let on = session.set_scene(Arc::new(scene()));
    resting(&session, on);
    assert_eq!(groups(&session), Some(4));
}

#[test]
fn changes_of_stop_and_display_keep_samples() {
    let mut plain = session(spp_stop(96), false);
    finish(&mut plain, &scene());

    let mut session = session(spp_stop(40), false);
    let first = finish(&mut session, &scene()).report;
    assert_eq!((first.spp.min, first.threads, first.lanes), (40, 2, Single::NAME));
    assert!(first.inventory.contains("1 sphere"), "{}", first.inventory);
    assert!(first.recent_samples_per_second > 0.0);
    session.set_stop(spp_stop(96));
    let more =
        wait(&session, |s| s.report.spp.min == 96 && s.report.state != State::Tracing).report;
    assert_eq!(more.generation, first.generation);
    assert_eq!(more.state, State::Finished(StoppedBy::Spp));
    assert!(bytes(&session) == bytes(&plain));

    // A stop criterion that is already met ends the render without new samples.
    session.set_stop(noise_stop(1000.0));
    let met = |s: &Snapshot| s.report.state == State::Finished(StoppedBy::Noise);
    assert_eq!(wait(&session, met).report.samples, more.samples);

    let display = Display { exposure_ev: 3.0, tone: Tone::Neutral };
    session.set_display(display);
    let expected = session.with(move |r, _| r.film.noise(&r.weights, &display)).unwrap();
    let judged = wait(&session, |s| s.report.noise == expected);
    assert_eq!(judged.report.samples, more.samples);
    // The new display transform also applies to scenes that are set later.
    let mut moved = scene();
    moved.camera.eye[0] = 0.1;
    let moved = finish(&mut session, &moved).report;
    let noise = session.with(move |r, _| r.film.noise(&r.weights, &display)).unwrap();
    assert_eq!(moved.noise, noise);
}

#[test]
fn submitted_tasks_always_run_without_waiting() {
    let mut session = session(Stop::default(), true);
    let (answer, answers) = channel();
    let samples = |session: &Session| {
        let answer = answer.clone();
        session.submit(move |picture| answer.send(picture.map(|p| p.report.generation)).unwrap());
    };
    samples(&session);
    assert_eq!(answers.recv_timeout(PATIENCE).unwrap(), None);
    let generation = session.set_scene(Arc::new(scene()));
    (0..50).for_each(|_| samples(&session));
    for _ in 0..50 {
        assert_eq!(answers.recv_timeout(PATIENCE).unwrap(), Some(generation));
    }
    // The picture of the snapshot and the probed pixel must agree with the film of the same moment.
    session.set_view(View { raster: Some([20, 14]), probe: Some([50, 40]), ..View::default() });
    session.set_stop(spp_stop(16));
    let end = resting(&session, generation);
    let (keep, kept) = channel();
    session.submit(move |picture| {
        let kept = picture
            .map(|p| (LinearImage::of_film(p.film, p.weights), p.film.pixel(50, 40, p.weights)));
        keep.send(kept).unwrap();
    });
    let (kept, pixel) = kept.recv_timeout(PATIENCE).unwrap().unwrap();
    for (a, b) in end.picture.unwrap().mixed(&end.weights).iter().zip(kept.resampled(
        Window::whole(kept.size),
        20,
        14,
    )) {
        (0..3).for_each(|c| assert!((a[c] - b[c]).abs() < 1e-5, "{a:?} {b:?}"));
    }
    let probe = end.probe.unwrap();
    assert_eq!((probe.pixel, probe.radiance), ([50, 40], pixel));
    assert_eq!(u64::from(probe.samples[0] + probe.samples[1]), u64::from(end.tiles.spp[0]));
    assert!(probe.difference.is_some() && probe.tile_rmse_levels.is_some());
    assert_eq!((end.tiles.columns, end.tiles.rows), (7, 5));
    assert_eq!((end.tiles.noise_levels.len(), end.tiles.spp.len()), (35, 35));
}

/// Returns the scene of a wall. The colour of the wall and its distance from the eye identify
/// `number`, modulo 50.
fn wall(number: u64) -> Scene {
    let mut scene = scene();
    scene.lights.clear();
    scene.ambient.color = Color::WHITE;
    scene.objects.remove(0);
    let red = scene.materials.get_mut("mirror").unwrap();
    red.reflection = 0.0;
    red.color = Color([0.01 * (number % 50 + 1) as f64, 0.0, 0.0]);
    scene.camera.eye = [0.0, 1.0, 0.1 + 0.01 * (number % 50) as f64];
    scene.camera.target = Some([0.0, 1.0, -1.0]);
    scene
}

#[test]
fn snapshot_picture_features_and_generation_match() {
    let (mut a, mut b) = (session(Stop::default(), true), session(spp_stop(8), true));
    let mut seen = 0;
    for number in 1..=20_000u64 {
        // On a busy machine fewer scenes get a picture before the next one replaces them, so that
        // more scenes are needed.
        if number > 200 && seen > 20 {
            break;
        }
        for session in [&mut a, &mut b] {
            let raster = Some([5 + number as usize % 3, 4]);
            session.set_view(View { raster, ..View::default() });
            assert_eq!(session.set_scene(Arc::new(wall(number))), number);
        }
        std::thread::sleep(Duration::from_micros(number * 97 % 4000));
        for snapshot in [&a, &b].into_iter().filter_map(|s| s.snapshots.try_recv().ok()) {
            let (number, Some(picture)) = (snapshot.report.generation, snapshot.picture) else {
                continue;
            };
            let red = picture.mixed(&snapshot.weights)[0][0];
            assert!((red - 0.01 * (number % 50 + 1) as f32).abs() < 1e-5, "{number}: {red}");
            // On a busy machine the first snapshot of a scene may have a picture but no first hits
            // yet.
            let Some(hits) = snapshot.first_hits else { continue };
            assert_eq!((hits.columns, hits.rows), (picture.cols, picture.rows));
            let hit = hits.at(hits.columns / 2, 2).unwrap();
            let axis = (wall(number).camera.eye[2] + 1.0) as f32;
            assert!(hit.depth >= axis * 0.999 && hit.depth < axis * 1.1, "{number} {hit:?}");
            assert_eq!((hit.object, hit.reflects), (Some(0), false));
            seen += 1;
        }
    }
    assert!(seen > 20, "{seen} snapshots");
}

#[cfg(target_os = "linux")]
#[test]
fn finished_or_paused_session_stays_asleep() {
    let mut session = session(spp_stop(8), true);
    let generation = session.set_scene(Arc::new(scene()));
    session.set_view(View { raster: Some([8, 8]), ..View::default() });
    resting(&session, generation);
    let idle_switches = switches_in(&session);
    session.set_stop(Stop::default());
    session.set_paused(true);
    wait(&session, |s| s.report.state == State::Paused);
    assert_eq!((idle_switches, switches_in(&session)), (0, 0));
}

/// Returns the number of wake-ups of the session's thread in 0.2 seconds: the smallest number of
/// five tries, because the thread needs a moment to fall asleep.
#[cfg(target_os = "linux")]
fn switches_in(session: &Session) -> u64 {
    let ids = session
        .with(|_, _| {
            let of_pool = std::fs::read_dir("/proc/self/task").unwrap();
            let own_thread = std::fs::read_link("/proc/thread-self").unwrap();
            let own_thread = own_thread.file_name().unwrap().to_owned();
            of_pool
                .map(|e| e.unwrap().file_name())
                .filter(|id| *id == own_thread)
                .collect::<Vec<_>>()
        })
        .unwrap();
    let count = || -> u64 {
        let switches_of = |id: &std::ffi::OsString| {
            let path = std::path::Path::new("/proc/self/task").join(id).join("status");
            let status = std::fs::read_to_string(path).unwrap();
            let lines = status.lines().filter(|line| line.contains("ctxt_switches"));
            lines.map(|l| l.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap()).sum::<u64>()
        };
        ids.iter().map(switches_of).sum()
    };
    let wakes = |_| {
        std::thread::sleep(Duration::from_millis(100));
        let before = count();
        std::thread::sleep(Duration::from_millis(200));
        count() - before
    };
    (0..5).map(wakes).min().unwrap()
}

#[test]
fn interruptions_and_earlier_scenes_do_not_change_the_film() {
    let mut uninterrupted = session(spp_stop(150), true);
    assert_eq!(finish(&mut uninterrupted, &scene()).report.bad_samples, 0);
    let expected = bytes(&uninterrupted);
    let mut session = session(spp_stop(150), true);
    let mut other = scene();
    other.camera.eye[0] += 0.1;
    for pause_us in [0, 50, 300, 2000] {
        // The first scene is cancelled during its compilation, its first pass or later. The second
        // scene reuses the memory of its film.
        session.set_scene(Arc::new(other.clone()));
        std::thread::sleep(Duration::from_micros(pause_us));
        let generation = session.set_scene(Arc::new(scene()));
        let mut samples = 0;
        for _ in 0..20 {
            samples = session.with(|_, report| report.samples).unwrap().max(samples);
            session.set_paused(true);
            session.set_paused(false);
        }
        let report = resting(&session, generation).report;
        assert!(report.samples >= samples);
        assert!(bytes(&session) == expected, "after {pause_us} us");
    }
}
