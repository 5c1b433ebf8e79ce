//! Transparent objects against closed forms: slabs, furnaces, cameras inside.

use crate::report::report;
use crate::setup::*;
use zerkalo::bvh::Ray;
use zerkalo::lanes::{Double, Float, Mask, SimdFloat, Single, Vec3};
use zerkalo::material::Interface;
use zerkalo::primitive::Aggregate;
use zerkalo::scene::Scene;

fn mean(samples: &[Vector]) -> Vector {
    let all: Vec<_> = samples.iter().map(|s| (1.0 / samples.len() as f64, *s)).collect();
    combine(&all)
}

const GLASS: &str = "ambient = 0.0\ndiffuse = 0.0\nreflection = 1.0\ntransmission = 1.0\n\
                     fresnel = \"dielectric\"\n";

/// Returns the largest error of a ray's displacement by a slab, as a fraction of its thickness t.
///
/// The slab displaces a ray by t sin i (1 - cos i / sqrt(n^2 - sin^2 i)) and keeps its direction. The error
/// is bounded by rounding: that of the direction over the path through the slab, which at 89.9 degrees is up
/// to 430 long, and the two ray offsets of 8 roundings of the slab's half width.
fn check_slab<L: SimdFloat>() -> f64 {
    /// Smallest half width that contains a ray at 89.9 degrees in a slab of index 1.
    const HALF_WIDTH: f64 = 450.0;
    let t = 0.75;
    let slab = scene(&format!(
        "[[object]]\nshape.box = {{ center = [0.0, 0.0, {}], size = [{}, 2.0, {t}] }}",
        -0.5 * t,
        2.0 * HALF_WIDTH
    ));
    let form = slab.objects[0].shape.form();
    let geometry = Aggregate::<L>::with_tree(&[form], false);
    let number = |x: L| x.lane(0).to_f64();
    let mut worst = 0f64;
    for n in [1.0, 1.33, 1.5, 2.4, 1e3] {
        for i in 0..=899 {
            let (sin, cos) = (f64::from(i) * 0.1).to_radians().sin_cos();
            let direction = Vec3::<L>::of([sin, 0.0, -cos]);
            let mut ray = Ray { origin: Vec3::of([-sin, 0.0, cos]), direction };
            let from = ray.origin;
            for (n_i, n_t) in [(1.0, n), (n, 1.0)] {
                let hit = geometry.closest(&ray, geometry.all());
                let surface = geometry.surface(hit.item.id_lane(0), hit.triangle, ray.at(hit.t));
                let entering = number(surface.normal.dot(ray.direction)) < 0.0;
                assert_eq!(entering, n_i == 1.0 && number(ray.origin.z) > 0.0, "{n} {i}");
                let normal = if entering { surface.normal } else { -surface.normal };
                let interface =
                    Interface::new(ray.direction, normal, L::from_f64(n_i), L::from_f64(n_t));
                assert!(interface.tir.bits() & 1 == 0, "{n} {i}");
                let origin = normal.mul_add(-surface.ray_offset(), surface.point);
                ray = Ray { origin, direction: interface.refracted };
            }
            // Displacement from the path without the slab.
            let way = ray.origin - from;
            let shift = (number(way.x) * -cos - number(way.z) * sin).abs();
            // n^2 - sin^2, without cancellation at n = 1.
            let expected = t * sin * (1.0 - cos / (n * n - 1.0 + cos * cos).sqrt());
            let off = (shift - expected).abs() / t;
            let through = t / (1.0 - (sin / n).powi(2)).sqrt();
            let roundings = 4.0 * (1.0 + 1.0 / cos + through) + 2.0 * 8.0 * HALF_WIDTH * sin;
            assert!(off <= L::EPSILON * roundings / t, "{}, {n} {i}: {shift} {expected}", L::NAME);
            worst = worst.max(off);
            let turned = number((ray.direction - direction).max_abs());
            // Near grazing incidence a rounding error of the sine is a larger one of the cosine.
            let allowed = L::EPSILON * (4.0 * n / cos).min(4.5e5);
            assert!(turned <= allowed, "{}, {n} {i}: turned by {turned}", L::NAME);
        }
    }
    worst
}

#[test]
fn extreme_27_slab_displacement() {
    let double = check_slab::<f64>();
    assert!(double <= 1e-10, "{double}");
    report(27, "double", &format!("{double:.0e} t off at most"));
    let single = check_slab::<f32>();
    assert!(single <= 1.5e-3, "{single}");
    report(27, "single", &format!("{single:.0e} t off at most"));
}

/// A red wall behind a slab, a green one behind the camera.
fn between_walls(slab: &str) -> Scene {
    scene(&format!(
        "film = {{ size = [1, 1], filter = \"point\" }}
        trace.max_depth = 10000
        ambient.color = [1.0, 1.0, 1.0]
        camera = {{ eye = [0.0, 0.0, 0.0], target = [0.0, 0.0, -1.0] }}
        [materials]
        red = {{ color = [1.0, 0.0, 0.0], diffuse = 0.0 }}
        green = {{ color = [0.0, 1.0, 0.0], diffuse = 0.0 }}
        [materials.glass]
        {GLASS}
        {slab}
        [[object]]
        material = \"red\"
        shape.plane = {{ point = [0.0, 0.0, -9.0], normal = [0.0, 0.0, 1.0] }}
        [[object]]
        material = \"green\"
        shape.plane = {{ point = [0.0, 0.0, 9.0], normal = [0.0, 0.0, -1.0] }}"
    ))
}

/// Closed form 11: with all orders a slab reflects 2 F / (1 + F) and transmits (1 - F) / (1 + F) at normal
/// incidence; a thin pane has the same values.
#[test]
fn closed_form_11_a_slab_with_all_orders() {
    for n in [1.0, 1.5, 4.0, 1e3] {
        let f = ((n - 1.0) / (n + 1.0f64)).powi(2);
        let slab = format!(
            "ior = {n:?}\n[[object]]\nmaterial = \"glass\"\n\
             shape.box = {{ center = [0.0, 0.0, -2.0], size = [9.0, 9.0, 1.0] }}"
        );
        let count = 1 << 14;
        let all = samples::<Double>(&between_walls(&slab), count);
        assert!(all.iter().all(|s| (s[0] + s[1] - 1.0).abs() < 1e-9), "light is lost");
        let [t, r, _] = mean(&all);
        let sigma = 0.5 / f64::from(count).sqrt();
        assert!((r - 2.0 * f / (1.0 + f)).abs() < 4.0 * sigma, "{n}: {r}");
        assert!((t - (1.0 - f) / (1.0 + f)).abs() < 4.0 * sigma, "{n}: {t}");
        let pane = slab.replace("shape.box", "shape.rectangle").replace(
            "9.0, 1.0] }",
            "9.0], \
             normal = [0.0, 0.0, 1.0] }",
        );
        let [t, r, _] = mean(&samples::<Double>(&between_walls(&pane), 8));
        assert!((r - 2.0 * f / (1.0 + f)).abs() < 1e-12 && (r + t - 1.0).abs() < 1e-12, "{n}: {r}");
    }
}

/// Scene with objects between camera and background; `inner` are keys of the material.
fn ball_in_front(background: &str, depth: u32, inner: &str, objects: &str) -> Scene {
    scene(&format!(
        "film = {{ size = [24, 24] }}
        trace.max_depth = {depth}
        ambient.color = [0.5, 0.5, 0.5]
        background.color = {background}
        camera = {{ eye = [0.0, 0.0, 3.0], target = [0.0, 0.0, 0.0], view_angle.vertical = 45.0 }}
        [materials]
        tile = {{ color = [0.9, 0.5, 0.2] }}
        [materials.m]
        {inner}
        {objects}"
    ))
}

const BALL: &str =
    "[[object]]\nmaterial = \"m\"\nshape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 }\n";
const TILES: &str = "[[object]]\nmaterial = \"tile\"\n\
    shape.box = { center = [0.3, 0.2, -2.0], size = [1.0, 0.7, 0.5] }\n";

/// A lossless ball is invisible in a white furnace, with any objects nested in it.
#[test]
fn glass_is_invisible_in_white_furnace() {
    let nested = "[[object]]\nmaterial = \"air\"\n\
        shape.sphere = { center = [0.3, 0.2, 0.1], radius = 0.4 }\n\
        [materials.air]\nindex = 1.0\n";
    for index in [0.7, 1.0, 1.5, 1e3] {
        let inner = format!("{GLASS}ior = {index:?}\n");
        // A bubble in glass of index 1000 refracts light so that it is trapped by total reflection.
        let bubble = if index < 100.0 { format!("{nested}{GLASS}") } else { String::new() };
        for more in [String::new(), bubble] {
            let scene = ball_in_front("[1.0, 1.0, 1.0]", 10_000, &inner, &format!("{BALL}{more}"));
            for s in samples::<Double>(&scene, 16) {
                assert!(s.iter().all(|c| (c - 1.0).abs() < 1e-9), "{index}: {s:?}");
            }
            for s in samples::<Single>(&scene, 16) {
                assert!(s.iter().all(|c| (c - 1.0).abs() < 1e-3), "{index}: {s:?}");
            }
        }
    }
}

/// A material of index 1 neither refracts nor reflects.
#[test]
fn index_1_is_invisible() {
    let inner = format!("{GLASS}ior = 1.0\n");
    let background = "[0.3, 0.6, 0.9]";
    let with = ball_in_front(background, 16, &inner, &format!("{BALL}{TILES}"));
    let without = ball_in_front(background, 16, &inner, TILES);
    let (with, without) = (samples::<Double>(&with, 8), samples::<Double>(&without, 8));
    let apart = |(a, b): (&Vector, &Vector)| (0..3).any(|c| (a[c] - b[c]).abs() > 1e-12);
    assert_eq!(with.iter().zip(&without).filter(|p| apart(*p)).count(), 0);
    assert!(without.iter().any(|s| s[0] > 0.4), "the box is not seen");
}

/// A camera inside glass sees the outside up to the critical angle, 41.8 degrees, and reflections beyond
/// it, also with a near plane and from a bubble in the glass.
#[test]
fn camera_inside_glass_starts_in_its_medium() {
    let look = |degrees: f64, near: f64, fresnel: &str, more: &str| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let text = format!(
            "film = {{ size = [1, 1], filter = \"point\" }}
            trace.max_depth = 2
            background.color = [1.0, 1.0, 1.0]
            camera = {{ eye = [0.0, 0.0, 0.0], direction = [{sin}, 0.0, -{cos}], near = {near:?} }}
            [materials.m]
            ambient = 0.0\ndiffuse = 0.0\nreflection = 1.0\ntransmission = 1.0\n{fresnel}
            [materials.air]
            ambient = 0.0\ndiffuse = 0.0\ntransmission = 1.0\nindex = 1.0
            [[object]]
            material = \"m\"
            shape.box = {{ center = [0.0, 0.0, 0.0], size = [1e4, 1e4, 2.0] }}
            {more}"
        );
        mean(&samples::<Double>(&scene(&text), 8))[0]
    };
    let bubble = "[[object]]\nmaterial = \"air\"\n\
        shape.sphere = { center = [0.0, 0.0, 0.0], radius = 0.25 }";
    for near in [0.0, 0.5] {
        assert_eq!(look(41.8, near, "", ""), 1.0);
        assert_eq!(look(41.82, near, "", ""), 0.0);
        assert_eq!(look(60.0, near, "fresnel = \"dielectric\"", ""), 0.0);
        let f = 0.04;
        // The ray leaves at the first surface or at the second.
        let seen = look(0.0, near, "fresnel = \"dielectric\"", "");
        assert!((seen - (1.0 - f * f)).abs() < 1e-9, "{near}: {seen}");
    }
    // Rays from the centre of a bubble leave it straight and are in glass then.
    assert_eq!(look(41.8, 0.0, "", bubble), 1.0);
    assert_eq!(look(41.82, 0.0, "", bubble), 0.0);
}

/// C2: a material with fixed coefficients reflects on its outer side only, so that k_r = 1 gives no endless
/// reflections between inner walls; its light leaves by k_t.
#[test]
fn fixed_coefficients_reflect_outside_only() {
    let inner =
        "ambient = 0.0\ndiffuse = 0.0\nreflection = 1.0\ntransmission = 0.5\nindex = 1.4286\n";
    let scene = ball_in_front("[1.0, 1.0, 1.0]", 100, inner, BALL);
    let all = samples::<Double>(&scene, 8);
    // 1 is reflected, and 0.5 x 0.5 is transmitted.
    let on_ball = all.iter().filter(|s| (s[0] - 1.25).abs() < 1e-12).count();
    let beside = all.iter().filter(|s| s[0] == 1.0).count();
    assert_eq!(on_ball + beside, all.len());
    assert!(on_ball > all.len() / 3);
}

/// Every sample of a packet equals the scalar sample.
#[test]
fn glass_packets_equal_scalar_samples() {
    for file in ["glass", "transmission", "water-glass"] {
        let mut scene = scene(&std::fs::read_to_string(format!("scenes/{file}.toml")).unwrap());
        scene.film.size = [24, 20];
        let (wide, one) = (samples::<Double>(&scene, 8), samples::<f64>(&scene, 8));
        assert_eq!(wide.len(), one.len());
        for (a, b) in wide.iter().zip(&one) {
            // Powers of highlights differ by a few roundings.
            assert!((0..3).all(|c| (a[c] - b[c]).abs() <= 1e-12 * (1.0 + b[c])), "{a:?} {b:?}");
        }
    }
}
