//! Comparison of ray packets with single rays: closest hits per second by kind of primitive, and
//! samples per second of whole scenes. The same kernels run with packets of several lanes, and with
//! packets of one lane, which are single rays.
//!
//! `cargo bench -p zerkalo-benches --bench packets`. It runs on one core. Packets and single rays
//! take turns.

#[path = "common/mod.rs"]
mod common;

use common::{Random, ball, in_turns, towards};
use glam::DAffine3;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Double, Float, SimdFloat, Single, Vec3};
use zerkalo_kernel::primitive::Mesh;
use zerkalo_kernel::primitive::{Aggregate, Form, MeshForm, MeshNormals};
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::film::{Display, Estimator, Film, Header, LightWeights};
use zerkalo_render::pass::{self, PassContext};
use zerkalo_render::wave::{Job, Wave};
use zerkalo_scene::shape::EXAMPLES;
use zerkalo_scene::{Document, Scene};
use zerkalo_world::World;

/// Number of rays of each measurement.
const RAYS: usize = 1 << 15;

/// Number of times that all rays are traced in a measurement.
const ROUNDS: usize = 8;

/// Returns origins and directions of rays from a sphere around `form` towards its bounding box.
/// Each group of eight successive rays has a common origin and similar directions.
fn rays_towards(form: &Form) -> Vec<([f64; 3], [f64; 3])> {
    let mut random = Random(3);
    let (low, high) = form.bounds().unwrap_or_else(|| (-glam::DVec3::ONE, glam::DVec3::ONE));
    let (middle, size) = (0.5 * (low + high), (high - low).length());
    let mut out = Vec::new();
    while out.len() < RAYS {
        let (from, to) = (random.point(1.5 * size), random.point(0.3 * size));
        let from = std::array::from_fn(|i| from[i] + middle[i]);
        for _ in 0..8 {
            let aside = random.point(0.01 * size);
            let to = std::array::from_fn(|i| to[i] + aside[i] + middle[i]);
            out.push((from, towards(from, to)));
        }
    }
    out
}

/// Creates a function that traces `rays` against `form`.
fn tracer<L: SimdFloat>(form: &Form, rays: &[([f64; 3], [f64; 3])]) -> impl FnMut() + use<L> {
    let geometry = Aggregate::<L>::with_bvh(std::slice::from_ref(form), false);
    let vector = |v: [f64; 3]| v.map(L::Scalar::from_f64);
    let packet = |rays: &[([f64; 3], [f64; 3])]| Ray::<L> {
        origin: Vec3::from_fn(|i| vector(rays[i].0)),
        direction: Vec3::from_fn(|i| vector(rays[i].1)),
    };
    let packets: Vec<_> = rays.chunks_exact(L::WIDTH).map(packet).collect();
    move || {
        for _ in 0..ROUNDS {
            for ray in &packets {
                black_box(geometry.closest(black_box(ray), geometry.all()));
            }
        }
    }
}

/// Creates a function that traces eight samples per pixel of `scene`, tile by tile.
fn renderer<L: SimdFloat>(scene: &Scene) -> impl FnMut() + use<L> {
    let world = World::<L>::new(scene);
    let scales = world.info.scales.clone();
    let mix = LightWeights { weights: vec![[1.0; 3]; scales.len()] };
    let estimator = Estimator::new(&scales, &mix, &Display::default());
    let [width, height] = scene.film.size.map(|n| n as usize);
    let precision = world.info.precision;
    let mut film = Film::new(Header { width, height, scales, seed: 1, precision });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    move || {
        let sampling = SampleSettings { seed: 1, kind: SamplerKind::Sobol };
        film.restart();
        for tile in 0..film.tile_count() as u32 {
            let jobs = vec![Job { tile, first: 8, count: 8 }];
            let wave = Wave { replicate: 0, jobs, estimate: false };
            let cancel = AtomicBool::new(false);
            let context = PassContext { sampling: &sampling, pool: &pool, cancel: &cancel };
            pass::run_typed(&world, &mut film, &wave, &estimator, context);
        }
    }
}

fn row(name: &str, millions: f64, seconds: &[f64]) {
    let speed: Vec<f64> = seconds.iter().map(|s| millions / s).collect();
    let [single, double, one, one_double] = speed[..] else { unreachable!("four instances") };
    println!(
        "{name:18} {single:8.1} {one:8.1} ({:4.1})   {double:8.1} {one_double:8.1} ({:4.1})",
        single / one,
        double / one_double
    );
}

fn main() {
    println!("millions per second of packets, of width 1 (packets over width 1)");
    println!("{:18} {:>25}   {:>25}", "closest hits", Single::NAME, Double::NAME);
    let mut forms: Vec<(&str, Form)> = Vec::new();
    for (key, example) in EXAMPLES.iter().filter(|(key, _)| *key != "mesh") {
        let scene = Scene::parse(&format!("[[object]]\n{example}\n"), key);
        let Ok(scene) = scene else { panic!("{key}: the example is broken") };
        forms.push((key, scene.objects[0].shape.form()));
    }
    let mesh = Arc::new(Mesh::new(ball(132, 266)));
    let scene_from_mesh = DAffine3::IDENTITY;
    forms.push((
        "mesh of 69,692",
        Form::Mesh(MeshForm { mesh, scene_from_mesh, normals: MeshNormals::Flat }),
    ));
    for (name, form) in &forms {
        let rays = rays_towards(form);
        let mut tracers = (
            tracer::<Single>(form, &rays),
            tracer::<Double>(form, &rays),
            tracer::<f32>(form, &rays),
            tracer::<f64>(form, &rays),
        );
        let tracers: &mut [&mut dyn FnMut()] =
            &mut [&mut tracers.0, &mut tracers.1, &mut tracers.2, &mut tracers.3];
        row(name, (rays.len() * ROUNDS) as f64 * 1e-6, &in_turns(5, tracers));
    }
    println!("samples");
    for name in ["mirror-room-physical", "transmission", "water-glass", "reflecting-tracks"] {
        let path = Path::new(env!("ZERKALO_ROOT"))
            .join("scenes/features")
            .join(name)
            .with_extension("toml");
        let mut scene = Document::read(&path, Default::default())
            .unwrap_or_else(|e| panic!("{e}"))
            .scene()
            .clone();
        scene.film.size = [160, 120];
        let mut tracers = (
            renderer::<Single>(&scene),
            renderer::<Double>(&scene),
            renderer::<f32>(&scene),
            renderer::<f64>(&scene),
        );
        let tracers: &mut [&mut dyn FnMut()] =
            &mut [&mut tracers.0, &mut tracers.1, &mut tracers.2, &mut tracers.3];
        row(name, 160.0 * 120.0 * 8.0 * 1e-6, &in_turns(5, tracers));
    }
}
