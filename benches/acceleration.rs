//! What each way of keeping rays from things costs, on three scenes: the reflecting tracks, 300 things of
//! several kinds, a mesh; and how the time per sample grows with the number of things.
//!
//! `cargo bench --bench acceleration`. One core; all ways of a scene take turns, and the least of five
//! times counts.

#[path = "common/mod.rs"]
mod common;

use common::{Random, in_turns};
use std::fmt::Write;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use zerkalo::film::{Display, Estimator, Film, Header, Mix};
use zerkalo::render::pass;
use zerkalo::render::wave::{Job, Wave};
use zerkalo::sampling::{SampleSettings, SamplerKind};
use zerkalo::scene::{Acceleration, Document, Scene};
use zerkalo::world::{AnyWorld, Options};

const SIZE: [u32; 2] = [320, 240];

/// Samples in every pixel.
const SAMPLES: u32 = 8;

/// A compiled scene and a film for it.
struct Bench {
    world: AnyWorld,
    film: Film,
    estimator: Estimator,
    pool: rayon::ThreadPool,
}

impl Bench {
    fn new(scene: &Scene, acceleration: Acceleration) -> Self {
        let mut scene = scene.clone();
        scene.film.size = SIZE;
        scene.trace.acceleration = acceleration;
        let world = AnyWorld::compile(&scene, &Options::default());
        let (scales, mix) = (world.group_scales(), Mix { weights: world.mix(&scene) });
        let estimator = Estimator::new(&scales, &mix, &Display::default());
        let [width, height] = SIZE.map(|n| n as usize);
        let precision = world.lanes().to_string();
        let film = Film::new(Header { width, height, scales, seed: 1, precision });
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        Self { world, film, estimator, pool }
    }

    /// One wave, on this thread, tile by tile.
    fn trace(&mut self) {
        let sampling = SampleSettings { seed: 1, kind: SamplerKind::Sobol };
        self.film.restart();
        for tile in 0..self.film.tile_count() as u32 {
            let jobs = vec![Job { tile, first: 8, count: SAMPLES }];
            let wave = Wave { replicate: 0, jobs, estimate: false };
            let go = AtomicBool::new(false);
            let (film, estimator) = (&mut self.film, &self.estimator);
            pass::run(&self.world, film, &wave, &sampling, estimator, &self.pool, &go);
        }
    }
}

/// Nanoseconds per sample of each.
fn times(mut benches: Vec<Bench>) -> Vec<f64> {
    let mut traces: Vec<_> = benches.iter_mut().map(|b| move || b.trace()).collect();
    let mut ways: Vec<&mut dyn FnMut()> =
        traces.iter_mut().map(|t| t as &mut dyn FnMut()).collect();
    let samples = f64::from(SIZE[0] * SIZE[1] * SAMPLES);
    in_turns(5, &mut ways).into_iter().map(|seconds| seconds / samples * 1e9).collect()
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

/// `count` things of the kinds that `shapes` describes at the origin, about 1 large, in the unit ball.
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

fn main() {
    let kinds = [
        BALL,
        "cube = { corner = [-0.5, -0.5, 0.5], edge = 1.0 }",
        "cylinder = { base = [0.0, -0.5, 0.0], top = [0.0, 0.5, 0.0], radius = 0.3 }",
        "cone = { base = [0.0, -0.5, 0.0], apex = [0.0, 0.5, 0.0], radius = 0.5 }",
    ];
    let file = |name: &str| {
        let path = Path::new("scenes").join(name);
        Document::read(&path).unwrap_or_else(|e| panic!("{e}")).scene().clone()
    };
    let scenes = [
        ("reflecting tracks, 401 spheres", file("reflecting-tracks.toml")),
        ("300 things of four kinds", crowd(300, &kinds)),
        ("a mesh on a floor", file("shape-mesh.toml")),
    ];
    println!("nanoseconds per sample (times that of auto), {} x {}:", SIZE[0], SIZE[1]);
    print!("{:32}", "");
    Acceleration::ALL.iter().for_each(|a| print!(" {:>16}", a.name()));
    println!();
    for (name, scene) in &scenes {
        let all = times(Acceleration::ALL.map(|a| Bench::new(scene, a)).into());
        print!("{name:32}");
        all.iter().for_each(|t| print!(" {:>8.0} ({:5.2})", t, t / all[0]));
        println!();
    }
    let counts = [10, 30, 60, 95, 100, 300, 1000, 10_000];
    let of = |by| times(counts.map(|n| Bench::new(&crowd(n, &[BALL]), by)).into());
    let [auto, tree] = [Acceleration::Auto, Acceleration::Hierarchy].map(of);
    println!("nanoseconds per sample by number of spheres (times that of 100), in a tree:");
    for ((count, time), tree) in counts.iter().zip(&auto).zip(&tree) {
        println!("  {count:6}: {time:8.0} ({:5.2}) {tree:8.0}", time / auto[4]);
    }
}
