//! Convergence rate: the slope of the error against the number of samples, both logarithmic, in
//! scenes made for this test.

use crate::harness::*;
use zerkalo::measure::{Reference, Slope};

const SIZE: [u32; 2] = [24, 16];
/// Smallest number of samples per pixel of the pictures whose errors are fitted, in both replicates
/// together.
const FIRST: u32 = 64;
const LAST: u32 = 2048;
/// Number of samples of the reference, divided by [`LAST`], the largest number of samples of the
/// compared pictures.
const REFERENCE: u32 = 8;

/// Returns the slope of the logarithm of the RMSE against the logarithm of the number of samples,
/// over pictures with several seeds.
fn slope(scene: &Scene, kind: SamplerKind, reference: &Reference) -> Slope {
    const SEEDS: u64 = 6;
    let pool = pool(2);
    let mut points = Vec::new();
    let mut n = FIRST;
    while n <= LAST {
        let mut sum = 0.0;
        for seed in 0..SEEDS {
            // Different seeds for each point, so that the points scatter independently.
            let settings = SampleSettings { seed: u64::from(n) + seed, kind };
            let mut rendering = begin_with(scene, settings, Precision::Auto);
            uniform(&mut rendering, 0, n / 2, &pool);
            sum += reference.errors(&rendering.film, &rendering.weights).rmse_linear.powi(2);
        }
        points.push((f64::from(n), (sum / SEEDS as f64).sqrt()));
        n *= 2;
    }
    let slope = Slope::fit(&points).unwrap();
    println!(
        "{kind:?}: slope {:.3} +- {:.3} through {points:?}",
        slope.value, slope.standard_error
    );
    slope
}

/// Returns the slopes of the error of `scene` against the number of samples, both logarithmic: with
/// Sobol points and with random numbers.
fn slopes(name: &str, scene: &Scene) -> [Slope; 2] {
    let settings = sobol(77);
    let mut best = begin_with(scene, settings, Precision::Auto);
    uniform(&mut best, 0, REFERENCE * LAST / 2, &pool(2));
    let reference = Reference::of_film(&best.film, &best.weights, &Display::default());
    println!("{name}: the RMSE of the reference is {:.1e}", reference.noise_linear());
    [SamplerKind::Sobol, SamplerKind::Random].map(|kind| slope(scene, kind, &reference))
}

fn check(name: &str, at_most: f64) {
    check_scene(name, &sized(shipped(name), SIZE), at_most);
}

fn check_scene(name: &str, scene: &Scene, at_most: f64) {
    let [sobol, random] = slopes(name, scene);
    assert!(sobol.value + 2.0 * sobol.standard_error <= at_most, "{name}: {sobol:?}");
    // Six points leave four degrees of freedom. The value is within three standard errors with a
    // probability of 96 %.
    let error = 3.0 * random.standard_error;
    assert!((random.value + 0.5).abs() <= error, "{name}, random: {random:?}");
}

#[test]
fn lobe_error_converges_like_two_dimensions() {
    check("slope-lobe.toml", -0.70);
}

#[test]
fn lens_error_converges_like_four_dimensions() {
    let mut scene = sized(shipped("slope-aa.toml"), SIZE);
    scene.camera.aperture = Some(Aperture::Radius(0.15));
    scene.materials.values_mut().for_each(|material| material.roughness = 0.0);
    check_scene("slope-aa.toml through a lens", &scene, -0.58);
}

/// Checks the convergence of samples with six dimensions: the position in the pixel, the direction
/// in the lobe, and the point of the light. Sobol points are evenly distributed in these six
/// dimensions at some powers of two only, so their error falls in steps. The standard error of
/// their slope describes the steps, not chance. The test therefore compares the slope itself with
/// its limit, and does not add standard errors as [`check`] does. With 24 seeds instead of 6, the
/// slope is -0.733 +- 0.045.
#[test]
fn light_error_through_a_rough_mirror_converges_like_smooth_dimensions() {
    let [sobol, random] = slopes("slope-light.toml", &sized(shipped("slope-light.toml"), SIZE));
    assert!(sobol.value <= -0.65, "{sobol:?}");
    assert!((random.value + 0.5).abs() <= 3.0 * random.standard_error, "{random:?}");
}

#[test]
fn lobe_error_with_anti_aliasing_converges_like_four_dimensions() {
    check("slope-aa.toml", -0.58);
}
