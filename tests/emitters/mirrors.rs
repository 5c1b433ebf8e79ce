//! Lights seen by the camera, in mirrors and in glossy lobes.

use crate::harness::*;

/// Returns the scene of a mirror with the keys `material`, and of a light above it with the keys
/// `light`.
fn mirror(material: &str, light: &str) -> Scene {
    receiver(
        DVec3::Y,
        &format!("ambient = 0\ndiffuse = 0\n{material}"),
        &format!("[[light]]\n{light}"),
    )
}

/// Returns the solid angle of a sphere whose centre is at unit distance.
fn solid_angle(radius: f64) -> f64 {
    TAU * (1.0 - (1.0 - radius * radius).sqrt())
}

/// Checks a rough pane with a cone lobe. The transmitted and the reflected radiance must be 0.7
/// times the fraction of the lobe's solid angle that a light of unit radiance covers. Points of the
/// light must be sampled, because reflected rays alone would hit the smallest lights in a few of a
/// million samples.
#[test]
fn rough_panes_find_small_lights_on_both_sides() {
    let mut cases = Vec::new();
    for (roughness, radius) in [(0.1, 1e-3), (0.1, 0.3), (0.5, 1e-4), (0.5, 0.05), (0.5, 0.8f64)] {
        for (coefficient, below) in [("transmission", true), ("reflection", false)] {
            let material = format!(
                "reflection = 0.0\ntransmission = 1e-6\n{coefficient} = 0.7\nlobe = \"cone\"\n\
                 roughness = {roughness:?}"
            );
            let material = match below {
                true => material.replace("transmission = 1e-6\n", ""),
                false => material.replace("reflection = 0.0\n", ""),
            };
            let y = if below { -1.0 } else { 1.0 };
            let light = format!("sphere = {{ center = [0.0, {y:?}, 0.0], radius = {radius:?} }}");
            let cone = TAU * (1.0 - f64::atan(roughness).cos());
            let expected = 0.7 * (solid_angle(radius) / cone).min(1.0);
            let name = format!("{coefficient}, roughness {roughness}, radius {radius}");
            let pane = mirror(&material, &light);
            let (_, error) = radiance::<Double>(&pane, 1 << 12, 1);
            assert!(error < 0.02 * expected, "{name}: {error}, expected {expected}");
            cases.push((name, pane, expected));
        }
    }
    check_means(&cases, 1 << 14, [2e-3, 1e-6]);
}
