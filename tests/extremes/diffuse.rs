//! Indirect diffuse light against a closed form.

use crate::harness::*;

const SAMPLES: u32 = 64;

fn scene(text: &str, bounces: u32) -> Scene {
    let mut scene = Scene::parse(text, "test").unwrap_or_else(|e| panic!("{e}"));
    scene.trace.max_diffuse_depth = bounces;
    scene
}

/// Returns the mean of the red channel, the largest deviation of a pixel from the mean, and the
/// standard error of the mean.
fn moments(scene: &Scene, precision: Precision) -> [f64; 3] {
    let rendering = rendered(scene, 11, precision, SAMPLES);
    assert_eq!(rendering.film.bad_samples(), 0);
    let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(&rendering, part));
    let n = a.len() as f64;
    let mean = a.iter().zip(&b).map(|(a, b)| 0.5 * (a[0] + b[0])).sum::<f64>() / n;
    let deviation = a.iter().chain(&b).map(|p| (p[0] - mean).abs()).fold(0.0, f64::max);
    let variance = a.iter().zip(&b).map(|(a, b)| (0.5 * (a[0] - b[0])).powi(2)).sum::<f64>() / n;
    [mean, deviation, (variance / n).sqrt()]
}

/// Checks the inside wall of a sphere of albedo rho and radius R around a light of intensity I. Every
/// bounce adds rho times the radiance of the one before. The first radiance is rho I / (pi R^2).
#[test]
fn sphere_from_inside_is_a_geometric_series() {
    let (rho, radius, intensity) = (0.6, 2.0, 3.0);
    let text = format!(
        "film.size = [16, 12]
        camera = {{ eye = [0.3, 0.2, 0.1], target = [0.0, -1.0, -0.5], view_angle.vertical = 70.0 }}
        [[light]]
        point.position = [0.0, 0.0, 0.0]
        falloff = \"inverse-square\"
        intensity = {intensity:?}
        [materials.white]
        color = [{rho:?}, {rho:?}, {rho:?}]
        ambient = 0.0
        diffuse = 1.0
        [[object]]
        material = \"white\"
        shape.sphere = {{ center = [0.0, 0.0, 0.0], radius = {radius:?} }}"
    );
    for bounces in [0, 1, 2, 4, 9] {
        for precision in [Precision::Single, Precision::Double] {
            let direct = rho * intensity / (PI * radius * radius);
            let expected: f64 = (0..=bounces).map(|k| direct * f64::powi(rho, k)).sum();
            let scene = scene(&text, bounces as u32);
            let [mean, deviation, error] = moments(&scene, precision);
            println!("{bounces} bounces, {precision:?}: {mean} +- {error}, expected {expected}");
            // No sample deviates, because the light is equal everywhere. Paths of four bounces or
            // more play Russian roulette.
            let tolerance = 1e-4 * expected + 4.0 * error;
            assert!((mean - expected).abs() < tolerance, "{bounces}: {mean}");
            assert!(deviation < tolerance || bounces >= 4, "{bounces}: {deviation}");
        }
    }
}
