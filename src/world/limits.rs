//! What the limits of path tracing leave out, as a bound.

use crate::material::Material;
use crate::scene::{Level, Scene};

/// Largest share of light that a material reflects, of any channel.
fn strongest(material: &Material) -> f64 {
    material.reflection * material.f0().0.into_iter().fold(0.0, f64::max).min(1.0)
}

/// The brightness that `scene`'s limits can cut off, in words; empty: they cut nothing.
///
/// A path that has met K + 1 reflecting surfaces weighs at most rho^(K+1) with rho the strongest
/// reflection; all longer paths together at most rho^(K+1) / (1 - rho) of the brightest surface.
pub fn biases(scene: &Scene) -> Vec<String> {
    let default = Material::default();
    let material = |name: &String| scene.materials.get(name).unwrap_or(&default);
    let reflecting: Vec<f64> = scene
        .objects
        .iter()
        .map(|object| strongest(material(&object.material)))
        .filter(|r| *r > 0.0)
        .collect();
    // One convex thing cannot see itself.
    let endless = reflecting.len() > 1;
    if scene.trace.level < Level::Full || reflecting.is_empty() {
        return Vec::new();
    }
    let rho = reflecting.iter().copied().fold(0.0, f64::max);
    let bound = |first: f64| {
        if rho < 1.0 {
            format!("at most {:.2e} of the brightest surface", first / (1.0 - rho))
        } else {
            "no bound: a reflection returns all light or more".to_string()
        }
    };
    let mut out = Vec::new();
    let depth = scene.trace.depth;
    if endless || depth == 0 {
        let exponent = i32::try_from(depth).unwrap_or(i32::MAX).saturating_add(1);
        let first = rho.powi(exponent);
        // Less than a double can add to 1 is nothing.
        if first / (1.0 - rho).max(f64::MIN_POSITIVE) > f64::EPSILON {
            out.push(format!("depth {depth} cuts longer paths ({})", bound(first)));
        }
    }
    let least = scene.trace.min_weight;
    if least > 0.0 {
        out.push(format!("min_weight {least} cuts weaker paths ({})", bound(least)));
    }
    out
}
