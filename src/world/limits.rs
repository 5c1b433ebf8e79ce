//! What the limits of path tracing leave out, as a bound.

use crate::material::Material;
use crate::scene::{Level, Object, Scene};
use crate::shape::Form;

/// Largest share of light that a material reflects, of any channel.
fn strongest(material: &Material) -> f64 {
    material.reflection * material.f0().0.into_iter().fold(0.0, f64::max).min(1.0)
}

/// Whether a path may meet `object` twice in a row. Every thing but a compound or a mesh is convex, so only its
/// inside sees itself, and only paths that begin inside get there.
fn sees_itself(object: &Object, material: &Material, scene: &Scene) -> bool {
    let form = object.shape.form().transformed(&object.scene_from_object());
    if matches!(form, Form::Compound(_) | Form::Mesh { .. }) {
        return true;
    }
    let flat = matches!(form, Form::Parallelogram { .. } | Form::Plane { .. });
    let eye = scene.camera.eye.into();
    let within =
        form.bounds().is_some_and(|(low, high)| low.cmple(eye).all() && high.cmpge(eye).all());
    !flat && material.two_sided && (within || scene.camera.near > 0.0)
}

/// The brightness that `scene`'s limits can cut off, in words; empty: they cut nothing.
///
/// Two reflections in a row return at most `pair`, the largest product of the reflections of two things
/// of which one sees the other. So a path that has met n reflecting surfaces weighs at most
/// w(n) = pair^(n/2), for odd n that of n - 1 times the strongest reflection, and all paths of n and
/// more together at most (w(n) + w(n + 1)) / (1 - pair) of the brightest surface.
pub fn biases(scene: &Scene) -> Vec<String> {
    let default = Material::default();
    let (mut first, mut second, mut pair) = (0.0f64, 0.0f64, 0.0f64);
    for object in &scene.objects {
        for name in object.shape.part_materials(&object.material) {
            let material = scene.materials.get(name).unwrap_or(&default);
            let rho = strongest(material);
            if rho > 0.0 && sees_itself(object, material, scene) {
                pair = pair.max(rho * rho);
            }
            second = second.max(rho.min(first));
            first = first.max(rho);
        }
    }
    pair = pair.max(first * second);
    if scene.trace.level < Level::Full || first == 0.0 {
        return Vec::new();
    }
    let weight = |n: u32| {
        let pairs = pair.powi(i32::try_from(n / 2).unwrap_or(i32::MAX));
        if n.is_multiple_of(2) { pairs } else { pairs * first }
    };
    let from = |n: u32| (weight(n) + weight(n.saturating_add(1))) / (1.0 - pair).max(0.0);
    let bound = |sum: f64| {
        if pair < 1.0 {
            format!("at most {sum:.2e} of the brightest surface")
        } else {
            "no bound: a reflection returns all light or more".to_string()
        }
    };
    let mut out = Vec::new();
    let depth = scene.trace.depth;
    let cut = from(depth.saturating_add(1));
    // Less than a double can add to 1 is nothing.
    if pair >= 1.0 || cut > f64::EPSILON {
        out.push(format!("depth {depth} cuts longer paths ({})", bound(cut)));
    }
    let least = scene.trace.min_weight;
    if least > 0.0 {
        out.push(format!("min_weight {least} cuts weaker paths ({})", bound(least * from(0))));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(eye: &str, things: &[(f64, &str)]) -> Scene {
        let mut text = format!("[camera]\neye = {eye}\ndirection = [0.0, 0.1, -1.0]\n");
        for (i, (reflection, shape)) in things.iter().enumerate() {
            text += &format!(
                "[materials.m{i}]\nreflection = {reflection}\n\
                 [[object]]\nmaterial = \"m{i}\"\nshape.{shape}\n"
            );
        }
        Scene::parse(&text, "test").unwrap_or_else(|e| panic!("{e}"))
    }

    const BALL: &str = "sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }";
    const FLOOR: &str = "platform = { center = [0.0, -1.0, 0.0], size = [9.0, 9.0] }";

    #[test]
    fn a_thing_alone_is_met_twice_only_from_inside() {
        assert_eq!(biases(&scene("[0.0, 0.0, 5.0]", &[(0.9, BALL)])), [""; 0]);
        assert_eq!(biases(&scene("[0.0, 0.0, 5.0]", &[(0.9, FLOOR)])), [""; 0]);
        let inside = biases(&scene("[0.0, 0.0, 0.5]", &[(0.9, BALL)]));
        // 0.9^17 / (1 - 0.9)
        assert_eq!(
            inside,
            ["depth 16 cuts longer paths (at most 1.67e0 of the brightest surface)"]
        );
        let mut one = scene("[0.0, 0.0, 5.0]", &[(0.9, BALL)]);
        one.trace.depth = 0;
        assert_eq!(
            biases(&one),
            ["depth 0 cuts longer paths (at most 9.00e-1 of the brightest surface)"]
        );
    }

    #[test]
    fn a_weak_partner_makes_long_paths_weak() {
        let mut two = scene("[0.0, 0.0, 5.0]", &[(0.9, BALL), (0.1, FLOOR)]);
        two.trace.depth = 3;
        // Four reflections: 0.09^2 (1 + 0.9) / (1 - 0.09)
        assert_eq!(
            biases(&two),
            ["depth 3 cuts longer paths (at most 1.69e-2 of the brightest surface)"]
        );
        let full = biases(&scene("[0.0, 0.0, 5.0]", &[(1.0, BALL), (1.0, FLOOR)])).concat();
        assert!(full.contains("no bound"), "{full}");
    }
}
