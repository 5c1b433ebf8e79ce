//! Distance between a point and the closest surface of a scene.

use glam::DVec3;
use zerkalo_kernel::primitive::Form;

/// Returns a lower bound of the distance between `point` and the closest surface of the objects
/// `forms`: the minimum of `CanonicalShape::clearance`.
pub(crate) fn clearance(forms: &[Form], point: DVec3) -> f64 {
    forms.iter().filter_map(|form| form.clearance(point)).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;
    use zerkalo_kernel::primitive::{ConicalFrustumForm, EllipsoidForm};
    use zerkalo_scene::Scene;

    fn forms(text: &str) -> Vec<Form> {
        let scene = Scene::parse(text, "test").unwrap_or_else(|e| panic!("{e}"));
        let form = |o: &zerkalo_scene::Object| o.shape.form().transformed(&o.scene_from_object());
        scene.objects.iter().map(form).collect()
    }

    fn near(form: &Form, point: [f64; 3], expected: f64) {
        let found = form.clearance(point.into()).unwrap();
        assert!(
            (found - expected).abs() <= 1e-6 * expected + 1e-7,
            "{point:?}: {found}, not {expected}"
        );
    }

    #[test]
    fn walls_around_a_point_are_as_near_as_they_are() {
        // Half-axes 1, 2 and 3.
        let ellipsoid = &forms(
            "[[object]]\nshape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n\
             transform = [{ scale = [1.0, 2.0, 3.0] }]\n",
        )[0];
        near(ellipsoid, [0.0; 3], 1.0);
        near(ellipsoid, [0.999, 0.0, 0.0], 0.001);
        near(ellipsoid, [0.0, 1.999_999, 0.0], 1e-6);
        near(ellipsoid, [0.0, 0.0, 2.99], 0.01);
        let cylinder = &forms(
            "[[object]]\nshape.cylinder = { base = [0.0, -5.0, 0.0], top = [0.0, 5.0, 0.0], radius = 2.0 }\n",
        )[0];
        near(cylinder, [1.9, 0.0, 0.0], 0.1);
        near(cylinder, [0.0, 4.75, 0.5], 0.25);
        near(cylinder, [0.0, 0.0, 0.0], 2.0);
        // Inside the bounding box, but outside the cylinder.
        let corner = (2.0 * 0.95f64.powi(2) * 4.0).sqrt() - 2.0;
        near(cylinder, [1.9, 0.0, 1.9], corner);
        let cone = &forms(
            "[[object]]\nshape.cone = { base = [0.0, 0.0, 0.0], apex = [0.0, 1.0, 0.0], radius = 1.0 }\n",
        )[0];
        near(cone, [0.0, 0.4, 0.0], 0.4);
        near(cone, [0.0, 0.6, 0.0], 0.4 * 0.5f64.sqrt());
        let rectangle = &forms(
            "[[object]]\nshape.rectangle = { center = [0.0, 0.0, 0.0], size = [2.0, 2.0], \
             normal = [1.0, 1.0, 0.0] }\n",
        )[0];
        near(rectangle, [0.3, 0.3, 0.0], 0.18f64.sqrt());
        near(rectangle, [0.0, 0.0, 1.5], 0.5);
    }

    /// Checks that the clearance of stretched shapes (needles and sheets) matches the smallest of
    /// the distances to many points on their surfaces.
    #[test]
    fn clearance_of_stretched_shapes_matches_sampled_distance() {
        let shapes = [
            "sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }",
            "cylinder = { base = [0.0, -1.0, 0.0], top = [0.0, 1.0, 0.0], radius = 1.0 }",
        ];
        let stretches = ["[1.0, 4.0, 0.3]", "[30.0, 1.0, 1.0]", "[5.0, 0.02, 5.0]"];
        for (shape, stretch) in shapes.iter().flat_map(|s| stretches.map(|t| (s, t))) {
            let form = &forms(&format!(
                "[[object]]\nshape.{shape}\ntransform = [{{ scale = {stretch} }}, {{ rotate_x = 30.0 }}, \
                 {{ rotate_z = 20.0 }}]\n"
            ))[0];
            let surface: Vec<DVec3> = (0..250)
                .flat_map(|i| (0..250).map(move |j| (f64::from(i) / 250.0, f64::from(j) / 249.0)))
                .flat_map(|(u, v)| {
                    let (sin, cos) = (TAU * u).sin_cos();
                    match form {
                        Form::Ellipsoid(EllipsoidForm { scene_from_unit: m }) => {
                            let z = 2.0 * v - 1.0;
                            let r = (1.0 - z * z).sqrt();
                            vec![m.transform_point3(DVec3::new(r * cos, r * sin, z))]
                        }
                        Form::ConicalFrustum(ConicalFrustumForm { scene_from_unit: m, .. }) => {
                            [(1.0, v), (v, 0.0), (v, 1.0)]
                                .map(|(r, z)| m.transform_point3(DVec3::new(r * cos, r * sin, z)))
                                .to_vec()
                        }
                        _ => unreachable!("{form:?}"),
                    }
                })
                .collect();
            let (low, high) = form.bounds().unwrap();
            for i in 0..40 {
                let part = |k: f64| (f64::from(i) * k).fract();
                let at = DVec3::new(part(0.618), part(0.755), part(0.57));
                let point = low + (high - low) * at;
                let found = form.clearance(point).unwrap();
                let nearest =
                    surface.iter().map(|p| p.distance(point)).fold(f64::INFINITY, f64::min);
                let gap = 0.02 * low.distance(high);
                assert!(found <= nearest * 1.000_001, "{shape} {stretch}: {found} {nearest}");
                assert!(found >= nearest - gap, "{shape} {stretch}: {found} {nearest}");
            }
        }
    }
}
