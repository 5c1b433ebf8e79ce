//! Tracing kernels:
//!
//! - intersection, by kind of primitive and SIMD type
//! - a linear list of primitives against a BVH
//! - whole paths in the scene mirror-room-physical, by SIMD type
//! - the sampler
//! - compilation of a scene
//! - one wave (set of concurrent jobs) of samples
//!
//! `cargo bench -p zerkalo-benches --bench kernel`. Throughput is in lanes per second, so that
//! results for SIMD types of different widths are comparable.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use std::hint::black_box;
use std::sync::atomic::AtomicBool;
use zerkalo_kernel::bvh::Ray;
use zerkalo_kernel::lanes::{Double, Float, SimdFloat, Single, Vec3};
use zerkalo_kernel::primitive::{Aggregate, Form, SphereForm};
use zerkalo_kernel::sampling::{CameraDimensions, SampleSettings, Sampler, SamplerKind};
use zerkalo_render::film::{Display, Estimator, Film, Header, LightWeights};
use zerkalo_render::pass::{self, PassContext};
use zerkalo_render::wave::{Job, Wave};
use zerkalo_scene::Scene;
use zerkalo_world::{AnyWorld, Options, Precision, World};

const SAMPLING: SampleSettings = SampleSettings { seed: 1, kind: SamplerKind::Sobol };

fn physical() -> Scene {
    let text = include_str!("../scenes/features/mirror-room-physical.toml");
    Scene::parse(text, "mirror-room-physical.toml").expect("a shipped scene")
}

/// Random number generator for test geometry (SplitMix64), uniform in [0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction(&mut self) -> DVec3 {
        loop {
            let v = 2.0 * DVec3::new(self.next(), self.next(), self.next()) - 1.0;
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    /// Returns a packet of rays from one point, on the sphere of radius 4 around the origin,
    /// towards points within 0.02 of a random point of the unit ball.
    fn rays<L: SimdFloat>(&mut self) -> Ray<L> {
        let (from, to) = (4.0 * self.direction(), self.direction() * self.next());
        let mut lane = || to + 0.02 * self.direction() - from;
        let directions: Vec<DVec3> = (0..L::WIDTH).map(|_| lane().normalize()).collect();
        Ray {
            origin: Vec3::of(from.to_array()),
            direction: Vec3::from_fn(|i| directions[i].to_array().map(L::Scalar::from_f64)),
        }
    }
}

/// Returns the name that stands for a SIMD type in the names of benches.
fn name<L: SimdFloat>() -> &'static str {
    L::NAME
}

fn intersect<L: SimdFloat>(c: &mut Criterion, kind: &str, form: &Form) {
    let geometry = Aggregate::<L>::new(std::slice::from_ref(form));
    let mut random = Random(7);
    let rays: Vec<Ray<L>> = (0..256).map(|_| random.rays()).collect();
    let mut group = c.benchmark_group(format!("intersect {kind}"));
    group.throughput(Throughput::Elements((rays.len() * L::WIDTH) as u64));
    group.bench_function(name::<L>(), |b| {
        b.iter(|| {
            for ray in &rays {
                black_box(geometry.closest(black_box(ray), geometry.all()));
            }
        })
    });
}

fn kinds(c: &mut Criterion) {
    for (key, example) in zerkalo_scene::shape::EXAMPLES {
        let text = format!("[[object]]\n{example}\n");
        let Ok(scene) = Scene::parse(&text, key) else { continue };
        let form = scene.objects[0].shape.form();
        intersect::<Single>(c, key, &form);
        intersect::<Double>(c, key, &form);
        intersect::<f32>(c, key, &form);
    }
}

/// Measures closest hits of rays on spheres at random positions in a unit ball, with a linear list
/// and with a BVH.
fn list_or_tree(c: &mut Criterion) {
    for n in [8, 16, 24, 32, 64, 256, 4096] {
        let mut random = Random(n as u64);
        let radius = 0.5 / (n as f64).cbrt();
        let mut sphere =
            || Form::Sphere(SphereForm { center: random.direction() * random.next(), radius });
        let forms: Vec<Form> = (0..n).map(|_| sphere()).collect();
        let rays: Vec<Ray<Single>> = (0..256).map(|_| random.rays()).collect();
        let mut group = c.benchmark_group(format!("list or tree, {n} spheres"));
        group.throughput(Throughput::Elements((rays.len() * Single::WIDTH) as u64));
        for (name, tree) in [("list", false), ("tree", true)] {
            if n > 256 && !tree {
                continue;
            }
            let geometry = Aggregate::<Single>::with_bvh(&forms, tree);
            group.bench_function(name, |b| {
                b.iter(|| {
                    for ray in &rays {
                        black_box(geometry.closest(black_box(ray), geometry.all()));
                    }
                })
            });
        }
    }
}

/// Measures a render of the scene mirror-room-physical on one thread, with accumulation in the
/// film: 16 samples for each of 160x120 pixels. The ratio of the throughputs of two SIMD types is
/// the speed-up of a whole render by the wider type.
fn paths<L: SimdFloat>(c: &mut Criterion) {
    let mut scene = physical();
    scene.film.size = [160, 120];
    let world = World::<L>::new(&scene);
    let scales = world.info.scales.clone();
    let mix = LightWeights { weights: vec![[1.0; 3]; scales.len()] };
    let estimator = Estimator::new(&scales, &mix, &Display::default());
    let precision = Precision::Single;
    let header = Header { width: 160, height: 120, scales, seed: 1, precision };
    let mut film = Film::new(header);
    let jobs = (0..film.tile_count() as u32).map(|tile| Job { tile, first: 0, count: 16 });
    let wave = Wave { replicate: 0, jobs: jobs.collect(), estimate: false };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    let mut group = c.benchmark_group("paths");
    group.throughput(Throughput::Elements(160 * 120 * 16));
    group.bench_function(name::<L>(), |b| {
        b.iter(|| {
            film.restart();
            let cancel = AtomicBool::new(false);
            let context = PassContext { sampling: &SAMPLING, pool: &pool, cancel: &cancel };
            pass::run_typed(&world, &mut film, &wave, &estimator, context)
        })
    });
}

fn sampler(c: &mut Criterion) {
    let mut group = c.benchmark_group("sampler, 4 dimensions of a packet");
    group.throughput(Throughput::Elements(Single::WIDTH as u64));
    for kind in [SamplerKind::Sobol, SamplerKind::Random] {
        let sampler = Sampler::<Single>::new(
            SampleSettings { seed: 1, kind },
            CameraDimensions { pixel: true, lens: false },
        );
        group.bench_function(kind.name(), |b| {
            b.iter(|| {
                let points = sampler.block(64, Single::WIDTH);
                let draws = points.for_pixel(sampler.key((black_box(17), 23), 0));
                (draws.pixel(), draws.lobe_2d(0))
            })
        });
    }
}

fn compile(c: &mut Criterion) {
    let scene = physical();
    let options = Options { precision: Precision::Single, ..Options::default() };
    c.bench_function("compile the mirror room", |b| b.iter(|| AnyWorld::compile(&scene, &options)));
}

/// Measures one wave (set of concurrent jobs) in the scene mirror-room-physical on one thread: 8
/// samples for each of 640x480 pixels.
fn wave(c: &mut Criterion) {
    let scene = physical();
    let mut group = c.benchmark_group("wave of 8 samples, 640x480");
    group.throughput(Throughput::Elements(640 * 480 * 8));
    group.sample_size(10);
    for precision in [Precision::Single, Precision::Double] {
        let world = AnyWorld::compile(&scene, &Options { precision, ..Options::default() });
        let (scales, mix) = (
            world.info().scales.clone(),
            LightWeights { weights: world.info().groups.weights(&scene) },
        );
        let estimator = Estimator::new(&scales, &mix, &Display::default());
        let header =
            Header { width: 640, height: 480, scales, seed: 1, precision: world.info().precision };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
        let film = Film::new(header.clone());
        let jobs = (0..film.tile_count() as u32).map(|tile| Job { tile, first: 8, count: 8 });
        let wave = Wave { replicate: 0, jobs: jobs.collect(), estimate: false };
        group.bench_function(world.info().lanes, |b| {
            b.iter_batched_ref(
                || Film::new(header.clone()),
                |film| {
                    let cancel = AtomicBool::new(false);
                    let context = PassContext { sampling: &SAMPLING, pool: &pool, cancel: &cancel };
                    pass::run(&world, film, &wave, &estimator, context)
                },
                BatchSize::PerIteration,
            )
        });
    }
}

fn all(c: &mut Criterion) {
    paths::<Single>(c);
    paths::<Double>(c);
    paths::<f32>(c);
    paths::<f64>(c);
    wave(c);
    kinds(c);
    list_or_tree(c);
    sampler(c);
    compile(c);
}

criterion_group!(kernel, all);
criterion_main!(kernel);
