//! Latency of a session, which renders on a background thread. It is measured for requests of
//! pictures, for edits of the scene, and for tasks that a client runs on the background thread. The
//! argument is the size of the film in pixels. Prints median, 99th percentile and maximum in
//! milliseconds. The default sizes are 640x480 and 3840x2160 pixels.
//!
//! cargo bench -p zerkalo-benches --bench session -- 3840x2160

use std::hint::black_box;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::Options;
use zerkalo_render::film::{Display, LinearImage, Thumbnail};
use zerkalo_render::schedule::{Criterion, Settings, Stop};
use zerkalo_render::session::{Session, Snapshot, View};
use zerkalo_scene::Scene;
use zerkalo_world as world;

const RASTER: [usize; 2] = [160, 90];
const PATIENCE: Duration = Duration::from_secs(60);

fn main() {
    let given: Vec<[u32; 2]> = std::env::args().filter_map(|arg| size(&arg)).collect();
    let sizes = if given.is_empty() { vec![[640, 480], [3840, 2160]] } else { given };
    sizes.into_iter().for_each(figures);
}

fn size(text: &str) -> Option<[u32; 2]> {
    let (width, height) = text.split_once('x')?;
    Some([width.parse().ok()?, height.parse().ok()?])
}

fn figures(size: [u32; 2]) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let options = Options {
        world: world::Options::default(),
        sampling: SampleSettings { seed: 0, kind: SamplerKind::Sobol },
        display: Display::default(),
    };
    let settings = Settings {
        adaptive: true,
        criterion: Criterion::Levels,
        rays_per_pixel: 0,
        stop: Stop::default(),
    };
    let mut session = Session::new(threads, options, settings).unwrap();
    session.set_view(View { raster: Some(RASTER), probe: Some([9, 9]), ..View::default() });
    let text = include_str!("../scenes/mirror-room.toml");
    let mut scene = Scene::parse(text, "mirror-room.toml").unwrap();
    scene.film.size = size;
    println!("{}x{}, {threads} threads, raster {}x{}", size[0], size[1], RASTER[0], RASTER[1]);

    first_pictures(&mut session, &scene, "first");
    let mut moved = scene.clone();
    moved.camera.eye[0] += 0.1;
    first_pictures(&mut session, &moved, "again");
    let mut other = moved.clone();
    other.ambient.color.0 = [0.0; 3];
    other.camera.eye[0] += 0.1;
    first_pictures(&mut session, &other, "with other light groups");
    first_pictures(&mut session, &scene, "and back");

    print("snapshots while tracing, apart", &snapshots(&session, Duration::from_secs(4)));
    print("task to its answer", &tasks(&session, 60));
    print("edit to its first picture", &edits(&mut session, &mut scene, 20));
    wait(&session, |s| s.report.spp.min >= 4);
    let (shown, judged) = relights(&mut session, &mut scene, 10);
    print("intensity to its snapshot", &shown);
    print("intensity to its noise", &judged);
    let costs = session.with(|rendering, _| {
        let film = &rendering.film;
        let timed = |f: &dyn Fn()| {
            let start = Instant::now();
            f();
            vec![start.elapsed()]
        };
        [
            timed(&|| drop(black_box(Thumbnail::of_film(film, RASTER[0], RASTER[1])))),
            timed(&|| drop(black_box(LinearImage::of_film(film, &rendering.weights)))),
        ]
    });
    let [thumbnail, linear] = costs.unwrap();
    print("a thumbnail from nothing, one thread", &thumbnail);
    print("a linear picture, one thread", &linear);
    let report = session.with(|_, report| report.clone()).unwrap();
    println!("  {:.1} Msamples/s, {:.0} spp", report.samples_per_second() * 1e-6, report.spp.mean);
}

fn print(label: &str, times: &[Duration]) {
    let mut ms: Vec<f64> = times.iter().map(|t| t.as_secs_f64() * 1e3).collect();
    ms.sort_by(f64::total_cmp);
    let quantile = |share: f64| ms[((ms.len() - 1) as f64 * share).round() as usize];
    println!("  {label:42} {:8.1} {:8.1} {:8.1}", quantile(0.5), quantile(0.99), quantile(1.0));
}

fn wait(session: &Session, wanted: impl Fn(&Snapshot) -> bool) -> Snapshot {
    let end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        if let Some(snapshot) = session.wait(Duration::from_millis(100)).filter(&wanted) {
            return snapshot;
        }
    }
    panic!("no snapshot in time");
}

fn first_pictures(session: &mut Session, scene: &Scene, which: &str) {
    let start = Instant::now();
    let generation = session.set_scene(Arc::new(scene.clone()));
    wait(session, |s| s.report.generation == generation);
    print(&format!("{which}: coarse picture"), &[start.elapsed()]);
    let is_current = |s: &Snapshot| s.report.generation == generation;
    wait(session, |s| is_current(s) && s.report.first_picture_seconds.is_some());
    print(&format!("{which}: every pixel"), &[start.elapsed()]);
}

fn snapshots(session: &Session, during: Duration) -> Vec<Duration> {
    let end = Instant::now() + during;
    let (mut last, mut apart) = (Instant::now(), Vec::new());
    while Instant::now() < end {
        wait(session, |_| true);
        apart.push(last.elapsed());
        last = Instant::now();
    }
    apart
}

fn tasks(session: &Session, count: usize) -> Vec<Duration> {
    let task = |i: usize| {
        std::thread::sleep(Duration::from_millis(i as u64 * 7 % 50));
        let _ = session.snapshots.try_recv();
        let (answer, result) = channel();
        let start = Instant::now();
        session.submit(move |picture| {
            answer.send(picture.map(|p| p.report.samples)).expect("the bench waits");
        });
        assert!(result.recv().unwrap().is_some());
        start.elapsed()
    };
    (0..count).map(task).collect()
}

fn edits(session: &mut Session, scene: &mut Scene, count: usize) -> Vec<Duration> {
    let mut edit = |i: usize| {
        std::thread::sleep(Duration::from_millis(i as u64 * 37 % 400));
        scene.camera.eye[0] += 0.01;
        let scene = Arc::new(scene.clone());
        let start = Instant::now();
        let generation = session.set_scene(scene);
        wait(session, |s| s.report.generation == generation);
        start.elapsed()
    };
    (0..count).map(&mut edit).collect()
}

fn relights(
    session: &mut Session,
    scene: &mut Scene,
    count: usize,
) -> (Vec<Duration>, Vec<Duration>) {
    let mut relight = |i: usize| {
        std::thread::sleep(Duration::from_millis(i as u64 * 37 % 400));
        scene.lights[0].intensity *= 1.1;
        let scene = Arc::new(scene.clone());
        let start = Instant::now();
        let generation = session.set_scene(scene);
        let snapshot = wait(session, |s| s.report.generation == generation);
        assert!(snapshot.report.samples > 0, "the film was restarted");
        let shown = start.elapsed();
        let is_current = |s: &Snapshot| s.report.generation == generation;
        wait(session, |s| is_current(s) && s.report.noise.is_some());
        (shown, start.elapsed())
    };
    (0..count).map(&mut relight).unzip()
}
