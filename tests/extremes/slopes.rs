//! How fast the error falls with the number of samples, on the scenes that are made to show it.

use crate::support::{begin_with, pool, shipped, sized, uniform};
use zerkalo::film::Display;
use zerkalo::measure::{Reference, Slope};
use zerkalo::sampling::{SampleSettings, SamplerKind};
use zerkalo::scene::Scene;
use zerkalo::world::Precision;

const SIZE: [u32; 2] = [32, 24];
/// Samples per pixel, both replicates together.
const FIRST: u32 = 64;
const LAST: u32 = 2048;
/// The reference has so many times the samples of the last point.
const REFERENCE: u32 = 64;

/// The slope of log RMSE against log samples, of several pictures by different seeds together.
fn slope(scene: &Scene, kind: SamplerKind, reference: &Reference) -> Slope {
    const SEEDS: u64 = 4;
    let pool = pool(2);
    let mut points = Vec::new();
    let mut renderings: Vec<_> = (0..SEEDS)
        .map(|seed| begin_with(scene, SampleSettings { seed, kind }, Precision::Auto))
        .collect();
    let (mut before, mut n) = (0, FIRST);
    while n <= LAST {
        let mut sum = 0.0;
        for rendering in &mut renderings {
            uniform(rendering, before / 2, (n - before) / 2, &pool);
            sum += reference.errors(&rendering.film, &rendering.mix).rmse_linear.powi(2);
        }
        points.push((f64::from(n), (sum / SEEDS as f64).sqrt()));
        (before, n) = (n, 2 * n);
    }
    let slope = Slope::fit(&points).unwrap();
    println!(
        "{kind:?}: slope {:.3} +- {:.3} through {points:?}",
        slope.value, slope.standard_error
    );
    slope
}

/// The slopes by Sobol points and by random numbers.
fn slopes(name: &str) -> [Slope; 2] {
    let scene = sized(shipped(name), SIZE);
    let settings = SampleSettings { seed: 77, kind: SamplerKind::Sobol };
    let mut best = begin_with(&scene, settings, Precision::Auto);
    uniform(&mut best, 0, REFERENCE * LAST / 2, &pool(2));
    let reference = Reference::of_film(&best.film, &best.mix, &Display::default());
    println!("{name}: the reference's own RMSE is {:.1e}", reference.noise_linear());
    [SamplerKind::Sobol, SamplerKind::Random].map(|kind| slope(&scene, kind, &reference))
}

fn check(name: &str, at_most: f64) {
    let [sobol, random] = slopes(name);
    let told = sobol.value - 2.0 * sobol.standard_error;
    assert!(told <= at_most, "{name}: {sobol:?}");
    // Twice its own error, and what so few seeds tell.
    let error = 2.0 * random.standard_error + 0.02;
    assert!((random.value + 0.5).abs() <= error, "{name}, random: {random:?}");
}

/// Two dimensions: where in the lobe.
#[test]
fn a_lobe_alone_converges_like_two_dimensions() {
    check("slope-lobe.toml", -0.70);
}

/// Four: where in the pixel and where in the lobe.
#[test]
fn a_lobe_with_anti_aliasing_converges_like_four_dimensions() {
    check("slope-aa.toml", -0.58);
}
