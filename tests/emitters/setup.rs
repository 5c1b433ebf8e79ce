//! Scenes with one receiver and one light, and their radiance with its standard error.

use crate::common::normal::two_sided_z;
use zerkalo_kernel::lanes::{Double, Float, SimdFloat, Single, Vec3};
use zerkalo_kernel::sampling::{SampleSettings, Sampler, SamplerKind};
use zerkalo_scene::Scene;
use zerkalo_world::{Path, Radiance, World};

/// Returns three numbers as a TOML array.
pub fn array(v: glam::DVec3) -> String {
    format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z)
}

pub fn scene(text: &str) -> Scene {
    Scene::parse(text, "test").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Calls `visit` for each of `count` independent samples of the pixel (0, 0), with the red radiance
/// of every light group. A light with a group of its own counts with unit intensity, and lights in
/// a shared group count with their own intensities.
pub fn samples<L: SimdFloat>(scene: &Scene, count: u32, seed: u64, mut visit: impl FnMut(&[f64])) {
    let world = World::<L>::new(scene);
    let settings = SampleSettings { seed, kind: SamplerKind::Random };
    let sampler = Sampler::<L>::new(settings, world.camera_dimensions());
    for first in (0..count).step_by(L::WIDTH) {
        let points = sampler.block(first, L::WIDTH);
        let draws = points.for_pixel(sampler.key((0, 0), 0));
        let half = L::from_f64(0.5);
        let offset = if world.jitter() { draws.pixel() } else { (half, half) };
        let corner = Vec3::splat(world.camera().pixel_corner_direction((0, 0)));
        let mut radiance = Radiance::black();
        let mut path = Path::new(world.camera().rays(corner, offset));
        world.trace(&mut path, None, &draws, L::mask(true), &mut radiance);
        for lane in 0..L::WIDTH {
            let groups = &radiance.groups[..world.groups()];
            let sample: Vec<f64> = groups.iter().map(|g| g.x.lane(lane).to_f64()).collect();
            let finite = sample.iter().all(|x| x.is_finite());
            assert!(finite, "seed {seed}, sample {first} + {lane}: {sample:?}");
            visit(&sample);
        }
    }
}

/// Returns the mean of a quantity and the mean's standard error, from its sum and its sum of
/// squares over `count` samples.
pub fn mean_and_error(sum: f64, squares: f64, count: u32) -> (f64, f64) {
    let n = f64::from(count);
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(0.0) / (n - 1.0)).sqrt())
}

/// Returns the mean red radiance of pixel (0, 0) and the standard error of the mean. The radiance
/// is the sum over all light groups; see [`samples`].
pub fn radiance<L: SimdFloat>(scene: &Scene, count: u32, seed: u64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    samples::<L>(scene, count, seed, |groups| {
        let sample: f64 = groups.iter().sum();
        sum += sample;
        squares += sample * sample;
    });
    mean_and_error(sum, squares, count)
}

/// Checks the mean radiance of each scene against its expected value, by z-tests in both
/// precisions. Each test takes `count` samples. `rounding` has the allowed relative rounding errors
/// in single and double precision.
pub fn check(cases: &[(String, Scene, f64)], count: u32, rounding: [f64; 2]) {
    let level = 1e-3;
    let limit = two_sided_z(level / (2.0 * cases.len() as f64));
    for (seed, (name, scene, expected)) in (1..).zip(cases) {
        let found =
            [radiance::<Single>(scene, count, seed), radiance::<Double>(scene, count, seed)];
        for ((mean, error), rounding) in found.into_iter().zip(rounding) {
            let off = (mean - expected).abs() - rounding * expected;
            assert!(
                off <= limit * error,
                "{name}, seed {seed}, rounding {rounding:e}: {mean} ± {error}, expected {expected}"
            );
        }
    }
}
