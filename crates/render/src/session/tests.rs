//! Tests of sessions with small scenes. The expensive scene has a camera inside a mirroring sphere,
//! where every path is long.

use crate::film::Noise;
use crate::schedule::{Interval, Spp, Stop, StoppedBy};
use crate::session::*;
use std::time::{Duration, Instant};
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_world as world;

/// Longest time that a test waits for the session. Only a failing test reaches it.
const PATIENCE: Duration = Duration::from_secs(20);

fn endless() -> Stop {
    Stop { spp: Some(1 << 30), ..Stop::default() }
}

fn session(stop: Stop) -> Session {
    let options = Options {
        world: world::Options::default(),
        sampling: SampleSettings { seed: 0, kind: SamplerKind::Sobol },
        display: Display::default(),
    };
    let settings = Settings { adaptive: false, ..Settings::until(stop) };
    Session::new(1, options, settings).unwrap()
}

fn scene(width: u32) -> Arc<Scene> {
    let text = include_str!(concat!(env!("ZERKALO_ROOT"), "scenes/mirror-room.toml"));
    let mut scene = Scene::parse(text, "mirror-room.toml").unwrap();
    scene.film.size = [width, 64];
    Arc::new(scene)
}

/// Returns a scene in which every path has 500 reflections. Its first pass of samples takes 64
/// times as long as its coarse picture, which is complete within a fraction of a second.
fn expensive_scene() -> Arc<Scene> {
    const TEXT: &str = r#"
        [film]
        size = [256, 256]
        [trace]
        max_depth = 500
        [camera]
        eye = [0.0, 0.0, 0.5]
        target = [0.1, 0.2, 0.0]
        [ambient]
        color = [0.1, 0.1, 0.1]
        [materials.mirror]
        diffuse = 0.0
        reflection = 1.0
        [[object]]
        material = "mirror"
        shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }
    "#;
    Arc::new(Scene::parse(TEXT, "test").unwrap())
}

/// Returns the first snapshot of the render for which `accepts` is true.
fn wait_for(session: &Session, accepts: impl Fn(&Snapshot) -> bool) -> Snapshot {
    let end = Instant::now() + PATIENCE;
    loop {
        let left = end.checked_duration_since(Instant::now()).expect("a snapshot in time");
        if let Some(snapshot) = session.wait(left).filter(&accepts) {
            return snapshot;
        }
    }
}

/// Starts the expensive scene and returns the time until its coarse picture is published.
fn start_expensive_scene(session: &mut Session) -> Duration {
    let start = Instant::now();
    let generation = session.set_scene(expensive_scene());
    let coarse = wait_for(session, |s| s.report.generation == generation);
    assert_eq!(coarse.report.samples, 0, "the first pass is still running");
    start.elapsed()
}

#[test]
fn of_several_scenes_only_the_newest_is_compiled() {
    let mut session = session(endless());
    let (release, released) = bounded::<()>(1);
    session.submit(move |_| released.recv().unwrap());
    let newest = (0..50).map(|_| session.set_scene(scene(64))).last().unwrap();
    release.send(()).unwrap();
    wait_for(&session, |s| s.report.generation == newest && s.report.samples > 0);
    // The worker may have received some of the scenes before the task that blocks it.
    let compilations = session.shared.compilations.load(Ordering::SeqCst);
    assert!(compilations <= 2, "{compilations} of 50 scenes compiled");
}

#[test]
fn task_after_a_new_scene_gets_its_picture() {
    let mut session = session(endless());
    for width in [64, 80] {
        session.set_scene(scene(width));
        let found = session.with(|state, report| (state.film.header.width, report.samples));
        assert!(found.is_some_and(|(w, samples)| w == width as usize && samples > 0), "{found:?}");
    }
}

#[test]
fn newest_scene_is_never_lost() {
    let mut session = session(endless());
    for round in 0..120u64 {
        let mut newest = 0;
        for edit in 0..=round % 4 {
            newest = session.set_scene(scene(64 + 16 * (edit as u32 % 2)));
            // The delay varies, so that scenes reach the worker in all of its states.
            std::thread::sleep(Duration::from_micros(round * 37 % 500));
        }
        wait_for(&session, |s| s.report.generation == newest && s.report.samples > 0);
    }
}

/// Checks that a wait after a new scene returns no snapshot of the scene before. The test has taken
/// the last snapshot of that scene without waiting.
#[test]
fn wait_returns_snapshots_of_the_newest_scene() {
    let mut session = session(Stop { spp: Some(8), ..Stop::default() });
    for _ in 0..8 {
        session.set_scene(scene(64));
        let end = Instant::now() + PATIENCE;
        loop {
            if let Some(State::Finished(_)) =
                session.snapshots.try_recv().ok().map(|s| s.report.state)
            {
                break;
            }
            assert!(Instant::now() < end, "the render ends");
            std::thread::yield_now();
        }
        let generation = session.set_scene(scene(128));
        let snapshot = session.wait(PATIENCE).expect("a snapshot in time");
        assert_eq!(snapshot.report.generation, generation);
        // If this thread was late, `snapshot` already shows the finished render, and no other
        // snapshot follows.
        if !matches!(snapshot.report.state, State::Finished(_)) {
            wait_for(&session, |s| matches!(s.report.state, State::Finished(_)));
        }
    }
}

/// Checks that `interrupt` ends the first pass of the expensive scene early: within 16 times the
/// time of the coarse picture. Without an interrupt the pass takes 64 times that time. Only one of
/// five attempts must be in time, because other programs may delay an attempt.
fn assert_first_pass_is_cancelled(interrupt: impl Fn(Session)) {
    let mut attempts = Vec::new();
    for _ in 0..5 {
        let mut session = session(endless());
        let coarse = start_expensive_scene(&mut session);
        let start = Instant::now();
        interrupt(session);
        let elapsed = start.elapsed();
        if elapsed < 16 * coarse {
            return;
        }
        attempts.push((elapsed, coarse));
    }
    panic!("times from the interrupt to its effect, and of coarse pictures: {attempts:?}");
}

#[test]
fn new_scene_cancels_the_first_pass() {
    assert_first_pass_is_cancelled(|mut session| {
        let newest = session.set_scene(scene(16));
        wait_for(&session, |s| s.report.generation == newest && s.report.samples > 0);
    });
}

#[test]
fn dropped_session_cancels_the_first_pass() {
    assert_first_pass_is_cancelled(drop);
}

#[test]
fn pause_stops_tracing_and_loses_no_sample() {
    let mut session = session(endless());
    session.set_scene(scene(256));
    wait_for(&session, |s| s.report.samples > 0);
    session.set_paused(true);
    let paused = wait_for(&session, |s| s.report.state == State::Paused);
    // The target is the next multiple of 64 above the number of samples per pixel at the pause.
    // This number depends on the load of the machine.
    let spp = 64 * (paused.report.spp.max / 64 + 1);
    session.set_stop(Stop { spp: Some(spp), ..Stop::default() });
    std::thread::sleep(Duration::from_millis(30));
    // A task on the film runs during a pause.
    assert_eq!(session.with(|_, report| report.samples), Some(paused.report.samples));
    session.set_paused(false);
    let end = wait_for(&session, |s| matches!(s.report.state, State::Finished(_)));
    assert_eq!(end.report.state, State::Finished(StoppedBy::Spp));
    assert_eq!(end.report.spp, Spp { min: spp, mean: f64::from(spp), max: spp });
    let counts = session
        .with(|state, _| state.film.touched().map(|(_, tile)| tile.counts).collect::<Vec<_>>());
    assert_eq!(counts, Some(vec![[spp / 2; 2]; 64]));
}

#[test]
fn paused_session_publishes_the_first_picture_of_a_new_scene() {
    let mut session = session(endless());
    session.set_paused(true);
    let generation = session.set_scene(scene(64));
    let first = wait_for(&session, |s| s.report.state == State::Paused);
    assert_eq!(first.report.generation, generation);
    assert_eq!(first.report.samples, 64 * 64);
}

#[test]
fn task_without_a_scene_has_no_film() {
    assert_eq!(session(endless()).with(|_, _| ()), None);
}

#[test]
fn invalid_scene_reports_its_fault_and_the_next_one_renders() {
    let mut session = session(endless());
    let invalid = scene(0);
    let fault = invalid.faults().first().unwrap().to_string();
    let generation = session.set_scene(invalid);
    let failed = wait_for(&session, |s| matches!(s.report.state, State::Failed(_)));
    assert_eq!(failed.report.generation, generation);
    assert_eq!(failed.report.state, State::Failed(fault));
    assert_eq!(session.with(|_, _| ()), None);
    let valid = session.set_scene(scene(64));
    wait_for(&session, |s| s.report.generation == valid && s.report.samples > 0);
}

#[test]
fn snapshots_hold_what_the_view_requests() {
    let mut session = session(endless());
    session.set_view(View { raster: Some([8, 4]), ..View::default() });
    session.set_scene(scene(64));
    let noisy = wait_for(&session, |s| s.report.noise.is_some());
    let picture = noisy.picture.expect("a picture");
    assert_eq!((picture.cols, picture.rows), (8, 4));
    assert_eq!(noisy.tiles.noise_levels.len(), 16);
    assert!(noisy.tiles.noise_levels.iter().any(|noise| *noise > 0.0));
    session.set_view(View::default());
    wait_for(&session, |s| s.picture.is_none());
}

#[test]
fn reports_hold_noise_and_time_left() {
    let mut session = session(endless());
    session.set_scene(scene(64));
    let running = wait_for(&session, |s| s.report.noise.is_some()).report;
    let Noise { rmse, .. } = running.noise.unwrap();
    assert!(rmse.levels > 0.0 && rmse.levels < 255.0);
    let Interval { low, high } = running.eta_seconds.expect("a time");
    assert!(low > 0.0 && high >= low);
    assert!(running.progress.is_some_and(|p| p > 0.0 && p < 1.0));
    assert!(running.samples_per_second() > 0.0);
    assert!(running.compile_seconds > 0.0);
    assert!(running.first_picture_seconds.is_some_and(|s| s > running.compile_seconds));
    session.set_stop(Stop { spp: Some(running.spp.max), ..Stop::default() });
    let end = wait_for(&session, |s| s.report.state != State::Tracing).report;
    assert_eq!(end.progress, Some(1.0));
    assert!(end.seconds >= running.seconds);
}

#[test]
#[should_panic(expected = "the rendering thread has ended")]
fn panic_of_the_worker_reaches_the_client() {
    let mut session = session(endless());
    session.set_scene(scene(64));
    session.with(|_, _| panic!("a task gone wrong"));
    wait_for(&session, |_| false);
}
