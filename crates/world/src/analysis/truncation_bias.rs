//! Upper bounds of the bias that truncated paths cause (`max_depth`, `min_throughput`,
//! `max_diffuse_depth` and `caustics`).

use crate::lights::emissive_forms::surface_of;
use glam::DVec3;
use zerkalo_kernel::primitive::Form;
use zerkalo_scene::material::{Fresnel, Material, Texture};
use zerkalo_scene::shape::Shape;
use zerkalo_scene::{Object, RayTypes, Scene};

/// Returns the largest fraction of light that a material reflects and transmits together. On a
/// `flat` object there is no total internal reflection.
fn max_albedo(material: &Material, flat: bool) -> f64 {
    let (k_r, k_t) = (material.reflection, material.transmission);
    let f = match material.fresnel_mode() {
        Fresnel::Constant => material.f0().0.into_iter().fold(0.0, f64::max).min(1.0),
        // At grazing angles Fresnel reflectance reaches 1.
        Fresnel::Schlick | Fresnel::Exact | Fresnel::Dielectric => 1.0,
    };
    if k_t == 0.0 {
        k_r * f
    } else if material.fresnel_mode() == Fresnel::Dielectric {
        k_r.max(k_t)
    } else if flat {
        k_r * f + k_t
    } else {
        // Past the critical angle all light is reflected.
        (k_r * f + k_t).max(1.0)
    }
}

/// Returns the largest diffuse albedo of `material` on `object`. It is infinite for meshes, because
/// vertex colours have no bound.
fn max_diffuse_albedo(material: &Material, object: &Object) -> f64 {
    let factor = match &material.texture {
        _ if matches!(object.shape, Shape::MeshDesc(_)) => f64::INFINITY,
        Some(Texture::Checker(checker)) => checker.even.largest().max(checker.odd.largest()),
        // Pixels of images are at most 1.
        Some(Texture::Image(_)) | None => 1.0,
    };
    let albedo = material.diffuse * material.color.largest();
    if albedo > 0.0 { albedo * factor } else { 0.0 }
}

/// Largest displacement of the eye by rounding to single precision, as a fraction of the scene's
/// extent.
const ROUNDING: f64 = 1e-6;

/// Returns `true` if camera rays may start inside the object `form`.
fn contains_eye(form: &Form, scene: &Scene) -> bool {
    let eye = DVec3::from(scene.camera.eye);
    let lens_radius = scene.camera.lens_radius();
    let within = form.bounds().is_some_and(|(low, high)| {
        let extent = low.abs().max(high.abs()).max(eye.abs()).max_element();
        let room = DVec3::splat(ROUNDING * (extent + lens_radius) + lens_radius);
        (low - room).cmple(eye).all() && (high + room).cmpge(eye).all()
    });
    form.is_solid() && (within || scene.camera.near > 0.0)
}

/// Largest factors by which surfaces multiply the throughput of a path. They bound the radiance
/// that truncation loses.
#[derive(Clone, Copy)]
struct Reach {
    /// Largest factor of a single surface.
    first: f64,
    /// Largest product of the factors of two surfaces that a path can hit one after the other.
    round_trip_albedo: f64,
    /// `true` if some surface transmits light. Paths may then split at surfaces.
    through: bool,
}

impl Reach {
    /// Computes the factors of surfaces, including the diffuse albedo if `diffuse` is `true`.
    fn new(scene: &Scene, diffuse: bool) -> Self {
        let default = Material::default();
        let (mut first, mut second, mut round_trip_albedo) = (0.0f64, 0.0f64, 0.0f64);
        let (mut entered, mut through) = (0, false);
        for object in &scene.objects {
            let form = object.form();
            let starts_inside = contains_eye(&form, scene);
            let mut enters = false;
            for name in object.materials() {
                let material = scene.materials.get(name).unwrap_or(&default);
                let diffuse_albedo =
                    if diffuse { max_diffuse_albedo(material, object) } else { 0.0 };
                let rho = max_albedo(material, form.is_flat()) + diffuse_albedo;
                let let_in = form.is_solid() && material.transmission > 0.0;
                // A ray that leaves a convex object outwards cannot hit it again. A ray inside the
                // object can, but a path is inside only if it starts there or was transmitted. Bump
                // maps make no difference: directions on the wrong side of the surface are mirrored
                // to the right side.
                if !form.is_convex() || let_in || starts_inside && material.two_sided {
                    round_trip_albedo = round_trip_albedo.max(rho * rho);
                }
                through |= material.transmission > 0.0;
                enters |= let_in;
                second = second.max(rho.min(first));
                first = first.max(rho);
            }
            entered += u32::from(enters);
        }
        round_trip_albedo = round_trip_albedo.max(first * second);
        if entered > 1 {
            // Where solids overlap, paths cross suppressed boundaries, which leave the throughput
            // unchanged.
            (first, round_trip_albedo) = (first.max(1.0), round_trip_albedo.max(1.0));
        }
        Self { first, round_trip_albedo, through }
    }

    /// Returns w(n) of [`truncation_bounds`]: the largest sum of the throughputs of a path's
    /// branches that have hit `n` surfaces.
    fn weight(&self, n: u32) -> f64 {
        let pairs = self.round_trip_albedo.powi(i32::try_from(n / 2).unwrap_or(i32::MAX));
        if n.is_multiple_of(2) { pairs } else { pairs * self.first }
    }

    /// Returns the sum of [`Self::weight`] over all numbers of surfaces from `n` on; infinite if
    /// the sum may have no bound.
    fn from(&self, n: u32) -> f64 {
        let sum = self.weight(n) + self.weight(n.saturating_add(1));
        if self.round_trip_albedo < 1.0 {
            sum / (1.0 - self.round_trip_albedo)
        } else {
            f64::INFINITY
        }
    }

    /// Returns the largest possible sum of the throughputs of paths that end below `least`. They
    /// have up to `bounces` diffuse bounces, and up to `depth` surfaces in each generation, the
    /// part of a path between two diffuse bounces.
    fn ended_by_generation(&self, least: f64, depth: u32, bounces: u32) -> f64 {
        let rest = if self.through { 8.0 * least * f64::from(depth) } else { least };
        (least + rest) * (f64::from(bounces) + 1.0)
    }

    /// Returns the largest possible sum of the throughputs of paths that end because their
    /// throughput is below `least`, at up to `depth` surfaces after the first. A path that never
    /// splits ends once. If paths split, at most four branches of a path have hit the same number
    /// of surfaces. Each of them ends at most two rays at its next surface: the reflected and the
    /// transmitted one.
    fn ended(&self, least: f64, depth: u32) -> f64 {
        if !self.through {
            return least;
        }
        (1..=depth).map(|n| self.weight(n).min(8.0 * least)).take_while(|w| *w > 0.0).sum()
    }
}

/// Returns one sentence for each limit of `scene` that truncates paths, with a bound of the lost
/// radiance.
///
/// Two consecutive surfaces multiply the throughput by at most r, the `round_trip_albedo`. One
/// surface multiplies it by at most f. The throughputs of all branches of a path that have hit n
/// surfaces therefore sum up to at most w(n) = r^(n/2) for even n, and w(n) = r^((n-1)/2) f for odd
/// n. The sum over n and all larger numbers is at most (w(n) + w(n + 1)) / (1 - r). The lost
/// radiance is at most this sum times the radiance of the brightest surface, light with a size, or
/// background. Nothing is truncated if no surface reflects or transmits. The same holds if the only
/// object that reflects or transmits is flat or convex, so that a path hits it once.
///
/// The emission of some objects is found only by rays that hit them. Without diffuse bounces,
/// diffuse surfaces lack the light of these objects.
///
/// With diffuse bounces the factor of a surface includes its diffuse albedo. The paths that
/// `max_depth` truncates have hit at least `max_depth + 1` surfaces. The paths that
/// `max_diffuse_depth` truncates have hit at least `max_diffuse_depth + 1`. The paths that are lost
/// because `caustics` is `false` have hit at least two. Without diffuse bounces, ambient light
/// stands for all indirect light; that is no truncation.
///
/// Total internal reflection in a transparent ball is included, although light that can enter a
/// ball can also leave it: at the rim, rounding decides on which side of the critical angle a ray
/// is, and bump maps change the angle.
pub fn truncation_bounds(scene: &Scene) -> Vec<String> {
    if scene.trace.ray_types < RayTypes::Full {
        return Vec::new();
    }
    let specular = Reach::new(scene, false);
    let bounces = scene.trace.max_diffuse_depth;
    let reach = if bounces > 0 { Reach::new(scene, true) } else { specular };
    let bound = |sum: f64| {
        if sum.is_finite() {
            format!("at most {} of the brightest surface", rounded_up(sum))
        } else {
            "no bound: surfaces send on all light or more".to_string()
        }
    };
    let mut out = Vec::new();
    let depth = scene.trace.max_depth;
    let cut = reach.from(depth.saturating_add(1));
    if cut > 0.0 && specular.first > 0.0 {
        out.push(format!("max_depth {depth} cuts longer paths ({})", bound(cut)));
    }
    let least = scene.trace.min_throughput;
    // At `max_depth` 0 no path continues by reflection or transmission, so only diffuse bounces can
    // be cut off.
    if least > 0.0 && (depth > 0 && specular.first > 0.0 || bounces > 0) {
        let ended = match bounces {
            0 => reach.ended(least, depth),
            _ => reach.ended_by_generation(least, depth, bounces),
        };
        let ended = ended * reach.from(0);
        out.push(format!("min_throughput {least} cuts weaker paths ({})", bound(ended)));
    }
    if bounces == 0 {
        let albedo = albedo_under_unsampled_emission(scene);
        out.extend(albedo.map(|albedo| {
            format!(
                "max_diffuse_depth 0 leaves out the light of emissive objects without sampled \
                 points on diffuse surfaces ({})",
                bound(albedo * specular.from(0))
            )
        }));
    } else {
        let cut = reach.from(bounces + 1);
        if cut > 0.0 && reach.first > specular.first {
            out.push(format!(
                "max_diffuse_depth {bounces} puts ambient light in place of further bounces ({})",
                bound(cut)
            ));
        }
        if specular.first > 0.0 && !scene.trace.caustics {
            out.push(format!(
                "caustics false leaves out what mirrors and glass send to diffuse surfaces ({})",
                bound(reach.from(2))
            ));
        }
    }
    out
}

/// Returns the names of the light that the settings of `scene` leave out, although its surfaces
/// reflect or transmit it.
pub fn left_out(scene: &Scene) -> Vec<&'static str> {
    let trace = &scene.trace;
    let specular = Reach::new(scene, false).first > 0.0;
    let is_diffuse = |object: &Object| {
        let materials = object.materials().into_iter().filter_map(|name| scene.materials.get(name));
        materials.into_iter().any(|material| max_diffuse_albedo(material, object) > 0.0)
    };
    let diffuse = scene.objects.iter().any(is_diffuse);
    let full = trace.ray_types == RayTypes::Full;
    let bounces = full && trace.max_diffuse_depth > 0;
    let no_caustics = diffuse && specular && !(bounces && trace.caustics);
    let names = [
        (trace.ray_types == RayTypes::Primary, "no shadows"),
        (specular && (!full || trace.max_depth == 0), "no reflections"),
        (diffuse && !bounces, "no bounces"),
        (no_caustics && !trace.mirror_light, "no caustics"),
        (no_caustics && trace.mirror_light, "caustics of single flat mirrors alone"),
    ];
    names.into_iter().filter(|(missing, _)| *missing).map(|(_, name)| name).collect()
}

/// Returns the largest diffuse albedo of a scene in which the emission of some object is found only
/// by rays that hit it; `None` in other scenes, and if the albedo is 0.
fn albedo_under_unsampled_emission(scene: &Scene) -> Option<f64> {
    let default = Material::default();
    let material = |name: &str| scene.materials.get(name).unwrap_or(&default);
    let is_found_by_rays_alone = |object: &Object| {
        object.materials().into_iter().any(|name| material(name).emits())
            && surface_of(&object.form()).is_none()
    };
    let albedo = |object: &Object| {
        let albedo = |name| max_diffuse_albedo(material(name), object);
        object.materials().into_iter().map(albedo).fold(0.0, f64::max)
    };
    let largest = scene.objects.iter().map(albedo).fold(0.0, f64::max);
    (largest > 0.0 && scene.objects.iter().any(is_found_by_rays_alone)).then_some(largest)
}

/// Formats `x` with three significant digits, rounded up.
fn rounded_up(x: f64) -> String {
    let text = format!("{x:.2e}");
    // A difference in the last digits of a double is a rounding error, not a reason to round up.
    let short = text.parse::<f64>().is_ok_and(|shown| shown < x * (1.0 - 1e-12));
    if short { format!("{:.2e}", x + 0.005 * 10f64.powf(x.log10().floor())) } else { text }
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
        assert_eq!(truncation_bounds(&scene("[0.0, 0.0, 5.0]", &[(0.9, BALL)])), [""; 0]);
        assert_eq!(truncation_bounds(&scene("[0.0, 0.0, 5.0]", &[(0.9, FLOOR)])), [""; 0]);
        let inside = truncation_bounds(&scene("[0.0, 0.0, 0.5]", &[(0.9, BALL)]));
        // The bound is 0.9^17 / (1 - 0.9).
        assert_eq!(
            inside,
            ["max_depth 16 cuts longer paths (at most 1.67e0 of the brightest surface)"]
        );
        let mut one = scene("[0.0, 0.0, 5.0]", &[(0.9, BALL)]);
        one.trace.max_depth = 0;
        assert_eq!(
            truncation_bounds(&one),
            ["max_depth 0 cuts longer paths (at most 9.00e-1 of the brightest surface)"]
        );
    }

    #[test]
    fn a_weak_partner_makes_long_paths_weak() {
        let mut two = scene("[0.0, 0.0, 5.0]", &[(0.9, BALL), (0.1, FLOOR)]);
        two.trace.max_depth = 3;
        // The bound for paths of four or more reflections is 0.09^2 (1 + 0.9) / (1 - 0.09).
        assert_eq!(
            truncation_bounds(&two),
            ["max_depth 3 cuts longer paths (at most 1.70e-2 of the brightest surface)"]
        );
        let full =
            truncation_bounds(&scene("[0.0, 0.0, 5.0]", &[(1.0, BALL), (1.0, FLOOR)])).concat();
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
        let told = |scene: &Scene| truncation_bounds(scene).concat();
        let cube = "box = { center = [0.0, 0.0, 0.0], size = [1.0, 1.0, 1.0] }";
        for shape in [BALL, cube] {
            for eye in [outside, "[0.0, 0.0, 0.5]"] {
                let solid = with(0.2, Fresnel::Constant, eye, shape);
                assert!(told(&solid).contains("no bound"), "{shape} from {eye}");
            }
        }
        // The bound is 0.5^17 / (1 - 0.5).
        assert_eq!(
            truncation_bounds(&with(0.4, Fresnel::Dielectric, outside, BALL)),
            ["max_depth 16 cuts longer paths (at most 1.53e-5 of the brightest surface)"]
        );
        // A path hits a single pane only once.
        assert_eq!(truncation_bounds(&with(0.4, Fresnel::Dielectric, outside, FLOOR)), [""; 0]);
    }

    #[test]
    fn diffuse_bounces_have_a_bound() {
        let mut room = scene("[0.0, 0.0, 5.0]", &[(0.0, BALL), (0.0, FLOOR)]);
        room.materials
            .values_mut()
            .for_each(|m| m.color = zerkalo_scene::value::Color([0.5, 0.4, 0.3]));
        room.materials.values_mut().for_each(|m| m.diffuse = 0.8);
        assert_eq!(truncation_bounds(&room), [""; 0], "ambient light stands for all of it");
        room.trace.max_diffuse_depth = 2;
        // (w(3) + w(4)) / (1 - r), where r is 0.4^2, gives 0.4^3 (1 + 0.4) / (1 - 0.16).
        assert_eq!(
            truncation_bounds(&room),
            [
                "max_diffuse_depth 2 puts ambient light in place of further bounces (at most 1.07e-1 \
              of the brightest surface)"
            ]
        );
        room.materials.get_mut("m0").unwrap().reflection = 0.5;
        room.trace.caustics = false;
        let told = truncation_bounds(&room);
        assert_eq!(told.len(), 3, "{told:?}");
        assert!(told[0].starts_with("max_depth 16 cuts") && told[2].starts_with("caustics false"));
        let alone = scene("[0.0, 0.0, 5.0]", &[(0.0, BALL)]);
        let trace =
            zerkalo_scene::IntegratorSettings { max_diffuse_depth: 1, ..alone.trace.clone() };
        assert_eq!(truncation_bounds(&Scene { trace, ..alone }), [""; 0], "it does not see itself");
    }

    #[test]
    fn light_that_only_rays_find_is_left_out_without_diffuse_bounces() {
        let torus =
            "torus = { center = [0.0, 1.0, 0.0], axis = [0.0, 1.0, 0.0], ring = 1.0, tube = 0.2 }";
        let with = |shape: &str| {
            let mut scene = scene("[0.0, 0.0, 5.0]", &[(0.0, shape), (0.0, FLOOR)]);
            let lamp = scene.materials.get_mut("m0").unwrap();
            (lamp.emission, lamp.diffuse) = (3.0, 0.0);
            scene
        };
        assert_eq!(truncation_bounds(&with(BALL)), [""; 0]);
        // The albedo of the floor is 0.8.
        let told = truncation_bounds(&with(torus)).concat();
        assert!(told.contains("emissive objects") && told.contains("at most 8.00e-1 of"), "{told}");
        let mut bouncing = with(torus);
        bouncing.trace.max_diffuse_depth = 1;
        assert!(!truncation_bounds(&bouncing).concat().contains("emissive"));
        let mut black = with(torus);
        black.materials.get_mut("m1").unwrap().diffuse = 0.0;
        assert_eq!(truncation_bounds(&black), [""; 0]);
    }

    #[test]
    fn bounds_are_rounded_up() {
        for (x, text) in [
            (0.9, "9.00e-1"),
            (1.667_7, "1.67e0"),
            (1.671, "1.68e0"),
            (9.991e-7, "1.00e-6"),
            (1.000_1, "1.01e0"),
            (0.0, "0.00e0"),
        ] {
            assert_eq!(rounded_up(x), text, "{x}");
        }
    }

    #[test]
    fn least_weights_end_paths_that_divide_more_than_once() {
        let mut opaque = scene("[0.0, 0.0, 5.0]", &[(0.5, BALL), (0.5, FLOOR)]);
        opaque.trace.min_throughput = 0.01;
        // `min_throughput` times the sum of all w(n), the largest throughputs after n surfaces:
        // 0.01 (1 + 0.5) / (1 - 0.25)
        assert_eq!(
            truncation_bounds(&opaque)[1],
            "min_throughput 0.01 cuts weaker paths (at most 2.00e-2 of the brightest surface)"
        );
        let mut glass = opaque.clone();
        let m0 = glass.materials.get_mut("m0").unwrap();
        (m0.transmission, m0.fresnel) = (0.5, Some(Fresnel::Dielectric));
        let told = truncation_bounds(&glass).concat();
        // The sum of min(w(n), 8 x 0.01) over all n is 0.08 + 0.08 + 0.08 + 1/16 + 1/32 + ... +
        // 2^-16 = 0.365. It is multiplied by 2, the sum of all w(n).
        assert!(told.contains("min_throughput 0.01 cuts weaker paths (at most 7.3"), "{told}");
    }

    #[test]
    fn an_eye_that_rounding_puts_inside_begins_inside() {
        let just = truncation_bounds(&scene("[0.0, 0.0, 1.00000001]", &[(0.9, BALL)])).concat();
        assert!(just.contains("max_depth 16 cuts"), "{just}");
    }
}
