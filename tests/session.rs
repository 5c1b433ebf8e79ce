//! Films of sessions, which must not depend on threads, interruptions or earlier scenes.

use crate::harness::*;
use zerkalo::render::session::Report;

const SCENE: &str = r#"
[film]
size = [100, 70]
[camera]
eye = [0.0, 1.0, 4.0]
target = [0.0, 0.5, 0.0]
[[light]]
point = { position = [2.0, 4.0, 3.0] }
[materials.red]
color = [0.8, 0.2, 0.1]
[materials.mirror]
diffuse = 0.0
reflection = 0.9
roughness = 0.3
[[object]]
material = "red"
shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }
[[object]]
material = "mirror"
shape.rectangle = { center = [0.0, 1.0, -1.0], size = [4.0, 2.0], normal = [0.0, 0.0, 1.0] }
"#;

fn session(threads: usize, adaptive: bool) -> Session {
    new_session(threads, 3, spp_stop(150), adaptive)
}

fn scene() -> Arc<Scene> {
    Arc::new(Scene::parse(SCENE, "test").unwrap())
}

/// Waits for the end of the render of the scene with the generation (version number) `generation`.
/// Returns the final report of the render.
fn finished(session: &Session, generation: u64) -> Report {
    let end = Instant::now() + Duration::from_secs(60);
    while Instant::now() < end {
        let Some(snapshot) = session.wait(Duration::from_millis(100)) else { continue };
        let is_finished = matches!(snapshot.report.state, State::Finished(_));
        if is_finished && snapshot.report.generation == generation {
            return snapshot.report;
        }
    }
    panic!("not finished in time")
}

fn bytes(session: &Session) -> Vec<u8> {
    session.with(|rendering, _| rendering.film.bytes()).expect("a film")
}

fn uninterrupted(threads: usize, adaptive: bool) -> Vec<u8> {
    let mut session = session(threads, adaptive);
    let generation = session.set_scene(scene());
    let report = finished(&session, generation);
    assert_eq!(report.bad_samples, 0);
    bytes(&session)
}

#[test]
fn threads_do_not_change_the_film() {
    for adaptive in [false, true] {
        let one = uninterrupted(1, adaptive);
        for threads in [2, 7] {
            assert!(
                one == uninterrupted(threads, adaptive),
                "{threads} threads, adaptive {adaptive}"
            );
        }
    }
    assert!(uninterrupted(1, false) != uninterrupted(1, true), "adaptivity changes nothing");
}

#[test]
fn interruptions_and_earlier_scenes_do_not_change_the_film() {
    let expected = uninterrupted(2, true);
    let mut session = session(2, true);
    let mut other = (*scene()).clone();
    other.camera.eye[0] += 0.1;
    let other = Arc::new(other);
    for pause_us in [0, 50, 300, 2000] {
        // The first scene is cancelled during its compilation, its first pass or later. The second
        // scene reuses the memory of its film.
        session.set_scene(Arc::clone(&other));
        std::thread::sleep(Duration::from_micros(pause_us));
        let generation = session.set_scene(scene());
        let mut samples = 0;
        for _ in 0..20 {
            samples = session.with(|_, report| report.samples).unwrap().max(samples);
            session.pause();
            session.resume();
        }
        let report = finished(&session, generation);
        assert!(report.samples >= samples);
        assert!(bytes(&session) == expected, "after {pause_us} us");
    }
}

/// Prints the cost of a checkpoint of a film of 1920x1080 pixels: the seconds for which tracing
/// pauses, and the speed of writing and reading.
#[test]
#[ignore = "prints figures: cargo test --test program session:: -- --ignored --nocapture checkpoint_cost"]
fn checkpoint_cost() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/mirror-room.toml");
    let mut scene = Scene::read(&path).unwrap();
    scene.film.size = [1920, 1080];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.zk");
    let threads = std::thread::available_parallelism().unwrap().get();
    let mut session = session(threads, false);
    session.set_stop(spp_stop(16));
    let generation = session.set_scene(Arc::new(scene));
    finished(&session, generation);
    for round in 0..5 {
        let (sender, receiver) = std::sync::mpsc::channel();
        let provenance = Provenance {
            source: String::new(),
            scene_hash: String::new(),
            sampler: SamplerKind::Sobol,
            adaptive: false,
        };
        let start = Instant::now();
        session.checkpoint(provenance, move |checkpoint| sender.send(checkpoint).unwrap());
        let checkpoint = receiver.recv().unwrap().expect("a picture");
        let encoded = start.elapsed();
        let start = Instant::now();
        checkpoint.write(&path, Existing::Replace).unwrap();
        let written = start.elapsed();
        let megabytes = std::fs::metadata(&path).unwrap().len() as f64 * 1e-6;
        let start = Instant::now();
        let read = Checkpoint::read(&path).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "round {round}: pause {:.0} ms ({:.2} % of a minute); {megabytes:.0} MB written at \
             {:.0} MB/s, read at {:.0} MB/s",
            1e3 * encoded.as_secs_f64(),
            100.0 * encoded.as_secs_f64() / 60.0,
            megabytes / written.as_secs_f64(),
            megabytes / seconds
        );
        assert_eq!(read.header.film.width, 1920);
    }
}
