//! Acceleration structures: time per sample with each structure, and growth of this time with the
//! number of objects.
//!
//! - The structures are compared on three scenes: the reflecting tracks (a mirror ball and rows of
//!   small balls), 300 objects of several kinds, and a mesh.
//! - The growth is measured on the tracks with different numbers of balls, and on a cloud of
//!   spheres at random positions.
//!
//! `cargo bench -p zerkalo-benches --bench acceleration`. It runs on one core. The structures take
//! turns on each scene; the shortest of five times counts.

#[path = "common/mod.rs"]
mod common;

use common::{Random, in_turns};
use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::film::{Display, Estimator, Film, Header, LightWeights};
use zerkalo_render::pass::{self, PassContext};
use zerkalo_render::wave::{Job, Wave};
use zerkalo_scene::shape::{Shape, Sphere};
use zerkalo_scene::{Acceleration, Document, Object, Scene};
use zerkalo_world::{AnyWorld, Options};

/// Picture size of the scene of the reflecting tracks when its number of balls varies, in pixels.
const SIZE: [u32; 2] = [640, 480];
/// Picture size of all other measured scenes, in pixels.
const SMALL: [u32; 2] = [320, 240];

/// Samples per pixel of each measured render.
const SAMPLES: u32 = 8;

/// Compiled scene, and a film for its picture.
struct Bench {
    world: AnyWorld,
    film: Film,
    estimator: Estimator,
    pool: rayon::ThreadPool,
}

impl Bench {
    fn new(scene: &Scene, acceleration: Acceleration, size: [u32; 2]) -> Self {
        let mut scene = scene.clone();
        scene.film.size = size;
        scene.trace.acceleration = acceleration;
        let world = AnyWorld::compile(&scene, &Options::default());
        let (scales, mix) = (
            world.info().scales.clone(),
            LightWeights { weights: world.info().groups.weights(&scene) },
        );
        let estimator = Estimator::new(&scales, &mix, &Display::default());
        let [width, height] = size.map(|n| n as usize);
        let precision = world.info().precision;
        let film = Film::new(Header { width, height, scales, seed: 1, precision });
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        Self { world, film, estimator, pool }
    }

    /// Traces [`SAMPLES`] samples of every pixel on this thread, tile by tile.
    fn trace(&mut self) {
        let sampling = SampleSettings { seed: 1, kind: SamplerKind::Sobol };
        self.film.restart();
        for tile in 0..self.film.tile_count() as u32 {
            let jobs = vec![Job { tile, first: 8, count: SAMPLES }];
            let wave = Wave { replicate: 0, jobs, estimate: false };
            let cancel = AtomicBool::new(false);
            let context = PassContext { sampling: &sampling, pool: &self.pool, cancel: &cancel };
            pass::run(&self.world, &mut self.film, &wave, &self.estimator, context);
        }
    }
}

/// Returns the nanoseconds per sample of each bench: the shortest time of several interleaved
/// renders.
fn times(mut benches: Vec<Bench>) -> Vec<f64> {
    let samples = benches[0].film.header.width * benches[0].film.header.height * SAMPLES as usize;
    let mut traces: Vec<_> = benches.iter_mut().map(|b| move || b.trace()).collect();
    let mut runs: Vec<&mut dyn FnMut()> =
        traces.iter_mut().map(|t| t as &mut dyn FnMut()).collect();
    in_turns(5, &mut runs).into_iter().map(|seconds| seconds / samples as f64 * 1e9).collect()
}

const ROOM: &str = r#"
camera = { eye = [0.0, 1.0, 4.0], target = [0.0, 0.0, 0.0], view_angle.vertical = 35.0 }
light = [
    { name = "right", point = { position = [3.0, 4.0, 3.0] }, intensity = 20.0 },
    { name = "left", point = { position = [-4.0, 3.0, 2.0] }, intensity = 15.0 },
]
[materials.matte]
color = [0.7, 0.5, 0.3]
[materials.mirror]
diffuse = 0.2
reflection = 0.7
"#;

/// Returns a scene with `count` objects at random positions in the unit ball. Their shapes are
/// taken in turn from `shapes`: lines of a scene file, each with a shape of about unit size at the
/// origin.
fn crowd(count: usize, shapes: &[&str]) -> Scene {
    let mut random = Random(11);
    let mut text = ROOM.to_string();
    let size = 0.8 / (count as f64).cbrt();
    for i in 0..count {
        let [x, y, z] = {
            let r = random.next().cbrt();
            random.point(r)
        };
        let (turn, tilt) = (360.0 * random.next(), 360.0 * random.next());
        let (shape, material) = (shapes[i % shapes.len()], ["matte", "mirror"][i % 7 / 6]);
        write!(
            text,
            "[[object]]\nmaterial = \"{material}\"\nshape.{shape}\ntransform = [\
             {{ scale = {size} }}, {{ rotate_x = {tilt} }}, {{ rotate_y = {turn} }}, \
             {{ translate = [{x}, {y}, {z}] }}]\n"
        )
        .expect("text grows");
    }
    Scene::parse(&text, "crowd").unwrap_or_else(|e| panic!("{e}"))
}

const BALL: &str = "sphere = { center = [0.0, 0.0, 0.0], radius = 0.5 }";

/// Returns the scene of the reflecting tracks with `4 n^2` small balls instead of 400: `4 n` rows
/// of `n` balls. The rows follow the same curves as in the original scene. The radius of the balls
/// is proportional to `1 / n`, so that the balls cover about the same fraction of the picture for
/// every `n`.
fn tracks(scene: &Scene, n: usize) -> Scene {
    let mut scene = scene.clone();
    let [mirror, ball, ..] = &scene.objects[..] else { panic!("no tracks") };
    let (mut objects, ball) = (vec![mirror.clone()], ball.clone());
    for (a, b) in (0..4 * n).flat_map(|a| (0..n).map(move |b| (a, b))) {
        let i = 39.0 * a as f64 / (4 * n - 1) as f64;
        let j = 9.0 * b as f64 / (n - 1) as f64;
        let center = [i - 9.0, 7.0 - 5.0 * i.sqrt(), 6.0 - j * j];
        let shape = Shape::Sphere(Sphere { center, radius: 8.0 / n as f64 });
        let material = format!("product-{}", i.round() * j.round());
        objects.push(Object { name: format!("track {a}, {b}"), material, shape, ..ball.clone() });
    }
    scene.objects = objects;
    assert_eq!(scene.faults(), [], "{n}");
    scene
}

/// Prints the nanoseconds per sample of each scene, for the automatic choice of the acceleration
/// structure and for a BVH. `scenes` are pairs of the number of spheres and the scene.
fn growth(scenes: &[(usize, Scene)], size: [u32; 2]) {
    let times_with = |acceleration| {
        times(scenes.iter().map(|(_, s)| Bench::new(s, acceleration, size)).collect())
    };
    let [auto, tree] = [Acceleration::Auto, Acceleration::Bvh].map(times_with);
    let hundred = scenes.iter().position(|(n, _)| *n == 100).expect("a hundred");
    for (((count, _), time), tree) in scenes.iter().zip(&auto).zip(&tree) {
        println!("  {count:6}: {time:8.0} ({:5.2}) {tree:8.0}", time / auto[hundred]);
    }
}

fn main() {
    let kinds = [
        BALL,
        "cube = { corner = [-0.5, -0.5, 0.5], edge = 1.0 }",
        "cylinder = { base = [0.0, -0.5, 0.0], top = [0.0, 0.5, 0.0], radius = 0.3 }",
        "cone = { base = [0.0, -0.5, 0.0], apex = [0.0, 0.5, 0.0], radius = 0.5 }",
    ];
    let file = |name: &str| {
        let path = Path::new(env!("ZERKALO_ROOT")).join("scenes/features").join(name);
        Document::read(&path, Default::default()).unwrap_or_else(|e| panic!("{e}")).scene().clone()
    };
    let scenes = [
        ("reflecting tracks, 401 spheres", file("reflecting-tracks.toml")),
        ("300 objects of four kinds", crowd(300, &kinds)),
        ("a mesh on a floor", file("shape-mesh.toml")),
    ];
    println!("nanoseconds per sample (times that of auto), {} x {}:", SMALL[0], SMALL[1]);
    print!("{:32}", "");
    Acceleration::ALL.iter().for_each(|a| print!(" {:>16}", a.name()));
    println!();
    for (name, scene) in &scenes {
        let all = times(Acceleration::ALL.map(|a| Bench::new(scene, a, SMALL)).into());
        print!("{name:32}");
        all.iter().for_each(|t| print!(" {:>8.0} ({:5.2})", t, t / all[0]));
        println!();
    }
    println!("nanoseconds per sample by number of spheres (times that of 100), in a BVH:");
    println!("the reflecting tracks, {} x {}", SIZE[0], SIZE[1]);
    let all = [3, 5, 7, 10, 16, 28, 50].map(|n| (4 * n * n, tracks(&scenes[0].1, n)));
    growth(&all, SIZE);
    println!("a crowd, {} x {}", SMALL[0], SMALL[1]);
    let all = [10, 30, 60, 95, 100, 300, 1000, 10_000].map(|n| (n, crowd(n, &[BALL])));
    growth(&all, SMALL);
}
