//! What the limits of path tracing leave out, as a bound.

use crate::material::{Fresnel, Material};
use crate::scene::{Level, Object, Scene};
use crate::shape::Form;

/// Largest share of light that a material sends on, reflected and transmitted together, of any channel.
fn strongest(material: &Material, flat: bool) -> f64 {
    let (k_r, k_t) = (material.reflection, material.transmission);
    let f = match material.law() {
        Fresnel::Constant => material.f0().0.into_iter().fold(0.0, f64::max).min(1.0),
        // At grazing angles.
        _ => 1.0,
    };
    match material.law() {
        _ if k_t == 0.0 => k_r * f,
        Fresnel::Dielectric => k_r.max(k_t),
        _ if flat => k_r * f + k_t,
        // Or everything, past the critical angle.
        _ => (k_r * f + k_t).max(1.0),
    }
}

/// What matters of an object's geometry.
struct Place {
    flat: bool,
    /// It may see itself from outside.
    compound: bool,
    sphere: bool,
    /// Paths may begin inside.
    begun_in: bool,
}

impl Place {
    fn new(object: &Object, scene: &Scene) -> Self {
        let form = object.shape.form().transformed(&object.scene_from_object());
        let flat = matches!(form, Form::Parallelogram { .. } | Form::Plane { .. });
        let eye = scene.camera.eye.into();
        let within =
            form.bounds().is_some_and(|(low, high)| low.cmple(eye).all() && high.cmpge(eye).all());
        Self {
            flat,
            compound: matches!(form, Form::Compound(_) | Form::Mesh { .. }),
            sphere: matches!(form, Form::Sphere { .. }),
            begun_in: !flat && (within || scene.camera.near > 0.0),
        }
    }

    /// Whether a path may meet the object twice in a row. Every thing but a compound or a mesh is convex, so only
    /// its inside sees itself, and only paths that begin inside, or are let in, get there.
    fn sees_itself(&self, material: &Material) -> bool {
        let let_in = !self.flat && material.transmission > 0.0;
        self.compound || let_in || self.begun_in && material.two_sided
    }
}

/// The brightness that `scene`'s limits can cut off, in words; empty: they cut nothing.
///
/// Two surfaces in a row send on at most `pair`, the largest product of the shares of two things of
/// which one sees the other. So a path that has met n such surfaces weighs at most
/// w(n) = pair^(n/2), for odd n that of n - 1 times the largest share, and all paths of n and
/// more together at most (w(n) + w(n + 1)) / (1 - pair) of the brightest surface. A transparent ball
/// alone, seen from outside, is met at most twice, unless Fresnel's equations reflect inside it: rays leave
/// a ball at the angle at which they came in.
pub fn biases(scene: &Scene) -> Vec<String> {
    let default = Material::default();
    let (mut first, mut second, mut pair) = (0.0f64, 0.0f64, 0.0f64);
    let (mut going_on, mut transparent, mut ball) = (0, 0, false);
    for object in &scene.objects {
        let place = Place::new(object, scene);
        let mut enters = false;
        for name in object.shape.part_materials(&object.material) {
            let material = scene.materials.get(name).unwrap_or(&default);
            let rho = strongest(material, place.flat);
            if rho > 0.0 {
                going_on += 1;
                ball = place.sphere
                    && !place.begun_in
                    && material.transmission > 0.0
                    && material.law() != Fresnel::Dielectric;
                if place.sees_itself(material) {
                    pair = pair.max(rho * rho);
                }
            }
            enters |= material.transmission > 0.0 && !place.flat;
            second = second.max(rho.min(first));
            first = first.max(rho);
        }
        transparent += u32::from(enters);
    }
    pair = pair.max(first * second);
    if transparent > 1 {
        // Where they overlap, paths meet surfaces that change nothing.
        pair = pair.max(1.0);
    }
    let longest = if going_on == 1 && ball { 2 } else { u32::MAX };
    if scene.trace.level < Level::Full || first == 0.0 {
        return Vec::new();
    }
    let weight = |n: u32| {
        let pairs = pair.powi(i32::try_from(n / 2).unwrap_or(i32::MAX));
        if n.is_multiple_of(2) { pairs } else { pairs * first }
    };
    let endless = longest == u32::MAX;
    let from = |n: u32| {
        if endless {
            (weight(n) + weight(n.saturating_add(1))) / (1.0 - pair).max(0.0)
        } else {
            (n..=longest).map(weight).sum()
        }
    };
    let bound = |sum: f64| {
        if pair < 1.0 || !endless {
            format!("at most {sum:.2e} of the brightest surface")
        } else {
            "no bound: surfaces send on all light or more".to_string()
        }
    };
    let mut out = Vec::new();
    let depth = scene.trace.depth;
    let cut = from(depth.saturating_add(1));
    // Less than a double can add to 1 is nothing.
    if pair >= 1.0 && endless || cut > f64::EPSILON {
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

    #[test]
    fn light_that_is_let_in_meets_the_inside() {
        let with = |transmission: f64, fresnel: Fresnel, eye: &str, shape: &str| {
            let mut scene = scene(eye, &[(0.5, shape)]);
            let material = scene.materials.get_mut("m0").unwrap();
            (material.transmission, material.fresnel) = (transmission, Some(fresnel));
            scene
        };
        let outside = "[0.0, 0.0, 5.0]";
        // A ball with fixed coefficients is entered and left.
        let ball = with(0.2, Fresnel::Constant, outside, BALL);
        assert_eq!(biases(&ball), [""; 0]);
        let mut short = ball;
        short.trace.depth = 1;
        assert_eq!(
            biases(&short),
            ["depth 1 cuts longer paths (at most 1.00e0 of the brightest surface)"]
        );
        // From inside, in another solid, or by Fresnel's equations, it is not so simple.
        let told = |scene: &Scene| biases(scene).concat();
        let cube = "box = { center = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0] }";
        assert!(told(&with(0.2, Fresnel::Constant, "[0.0, 0.0, 0.5]", BALL)).contains("no bound"));
        assert!(told(&with(0.2, Fresnel::Constant, outside, cube)).contains("no bound"));
        // 0.5^17 / (1 - 0.5)
        assert_eq!(
            biases(&with(0.4, Fresnel::Dielectric, outside, BALL)),
            ["depth 16 cuts longer paths (at most 1.53e-5 of the brightest surface)"]
        );
        // A pane alone is met once.
        assert_eq!(biases(&with(0.4, Fresnel::Dielectric, outside, FLOOR)), [""; 0]);
    }
}
