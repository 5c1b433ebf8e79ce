//! Transparent objects against closed forms: slabs, white furnaces, cameras inside glass.

use crate::harness::*;
use crate::lobes::setup::*;
use zerkalo_scene::material::Interface;

fn mean(samples: &[Vector]) -> Vector {
    let all: Vec<_> = samples.iter().map(|s| (1.0 / samples.len() as f64, *s)).collect();
    combine(&all)
}

const GLASS: &str = "ambient = 0.0\ndiffuse = 0.0\nreflection = 1.0\ntransmission = 1.0\n\
                     fresnel = \"dielectric\"\n";

/// Returns the largest error of a ray's displacement by a slab, as a fraction of the slab's
/// thickness t.
///
/// The slab displaces a ray by t sin i (1 - cos i / sqrt(n^2 - sin^2 i)) and keeps its direction.
/// The sum of two rounding errors bounds the error. The first is that of the direction, times the
/// length of the path through the slab. The path is up to 430 long, at 89.9 degrees. The second is
/// that of the two ray offsets, each 8 roundings of the slab's half width.
fn check_slab<L: SimdFloat>() -> f64 {
    /// Half width of the slab. It is large enough for a ray at 89.9 degrees if the index is 1.
    const HALF_WIDTH: f64 = 450.0;
    let t = 0.75;
    let slab = parsed(&format!(
        "[[object]]\nshape.box = {{ center = [0.0, 0.0, {}], size = [{}, 2.0, {t}] }}",
        -0.5 * t,
        2.0 * HALF_WIDTH
    ));
    let form = slab.objects[0].shape.form();
    let geometry = Aggregate::<L>::with_bvh(&[form], false);
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
                let surface =
                    geometry.surface(hit.primitive.id_lane(0), hit.triangle, ray.at(hit.t));
                let entering = number(surface.normal.dot(ray.direction)) < 0.0;
                assert_eq!(entering, n_i == 1.0 && number(ray.origin.z) > 0.0, "{n} {i}");
                let normal = if entering { surface.normal } else { -surface.normal };
                let interface =
                    Interface::new(ray.direction, normal, L::from_f64(n_i), L::from_f64(n_t));
                assert!(interface.tir.bits() & 1 == 0, "{n} {i}");
                let origin = normal.mul_add(-surface.ray_offset(), surface.point);
                ray = Ray { origin, direction: interface.refracted };
            }
            // Displacement of the ray behind the slab from the straight path.
            let way = ray.origin - from;
            let shift = (number(way.x) * -cos - number(way.z) * sin).abs();
            // The expression under the root is n^2 - sin^2. In this form no digits cancel at n = 1.
            let expected = t * sin * (1.0 - cos / (n * n - 1.0 + cos * cos).sqrt());
            let off = (shift - expected).abs() / t;
            let through = t / (1.0 - (sin / n).powi(2)).sqrt();
            let roundings = 4.0 * (1.0 + 1.0 / cos + through) + 2.0 * 8.0 * HALF_WIDTH * sin;
            assert!(off <= L::EPSILON * roundings / t, "{}, {n} {i}: {shift} {expected}", L::NAME);
            worst = worst.max(off);
            let rotated = number((ray.direction - direction).max_abs());
            // Near grazing incidence, a rounding error of the sine causes a larger error of the
            // cosine.
            let allowed = L::EPSILON * (4.0 * n / cos).min(4.5e5);
            assert!(rotated <= allowed, "{}, {n} {i}: rotated by {rotated}", L::NAME);
        }
    }
    worst
}

#[test]
fn extreme_27_slab_displacement() {
    let double = check_slab::<Double>();
    assert!(double <= 1e-10, "{double}");
    report(27, "double", &format!("{double:.0e} t off at most"));
    let single = check_slab::<Single>();
    assert!(single <= 1.5e-3, "{single}");
    report(27, "single", &format!("{single:.0e} t off at most"));
}

fn between_walls(slab: &str) -> Scene {
    parsed(&format!(
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

/// Returns the radiance of a white background, seen at an angle through an absorbing slab of
/// thickness 0.8. `keys` are further keys of the slab's material.
fn through_slab<L: SimdFloat>(degrees: f64, ior: f64, keys: &str) -> Vector {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let all = samples::<L>(
        &parsed(&format!(
            "film = {{ size = [1, 1], filter = \"point\" }}
            background.color = [1.0, 1.0, 1.0]
            camera = {{ eye = [0.0, 0.0, 2.0], direction = [{sin}, 0.0, -{cos}] }}
            [materials.glass]
            ambient = 0.0\ndiffuse = 0.0\ntransmission = 1.0\nior = {ior:?}\n{keys}
            [[object]]
            material = \"glass\"
            shape.box = {{ center = [0.0, 0.0, 0.0], size = [400.0, 2.0, 0.8] }}"
        )),
        16,
    );
    mean(&all)
}

/// Checks Beer's law: a slab of thickness t with the absorption coefficient s has the transmittance
/// exp(-s t / cos), where cos is the cosine of the refracted direction. The tolerance allows for
/// the ray offset, which shortens the path by 8 roundings of the slab's half width of 200.
fn check_beer<L: SimdFloat>() {
    let (color, distance, thickness) = ([0.25f64, 0.9, 0.0], 0.5, 0.8);
    let keys = format!("attenuation_color = {color:?}\nattenuation_distance = {distance:?}");
    let mut worst = 0f64;
    for ior in [1.0, 1.5, 2.4] {
        for degrees in [0.0f64, 30.0, 60.0, 85.0] {
            let found = through_slab::<L>(degrees, ior, &keys);
            let cos = (1.0 - (degrees.to_radians().sin() / ior).powi(2)).sqrt();
            for c in 0..3 {
                let expected = color[c].powf(thickness / cos / distance);
                let error = (found[c] - expected).abs();
                let limit = L::EPSILON * (8.0 * 200.0 * 3.0 + 40.0 / cos.powi(3));
                assert!(error <= limit, "{} {ior} {degrees}: {found:?} for {expected}", L::NAME);
                worst = worst.max(error);
            }
        }
    }
    println!("{}: Beer's law {worst:.1e} off at most", L::NAME);
    // Extreme distances: all light is absorbed within a rounding of the surface, or none in the
    // whole slab.
    for (distance, expected) in [(1e-300, 0.0), (1e-9, 0.0), (1e9, 1.0)] {
        let keys =
            format!("attenuation_color = [0.5, 0.5, 0.5]\nattenuation_distance = {distance:?}");
        for c in through_slab::<L>(40.0, 1.5, &keys) {
            assert!((c - expected).abs() < 1e-6, "{} {distance}: {c}", L::NAME);
        }
    }
}

#[test]
fn closed_form_beers_law_through_a_slab() {
    check_beer::<Double>();
    check_beer::<Single>();
}

/// Checks a glass slab at normal incidence, with all orders of internal reflection. F is the
/// reflectance of one surface, and a the transmittance of the interior. The slab reflects
/// F + F (1 - F)^2 a^2 / (1 - F^2 a^2) and transmits (1 - F)^2 a / (1 - F^2 a^2). A thin pane has
/// the values of a = 1 without noise. The bound of 4.5 standard errors allows for 60 comparisons.
#[test]
fn closed_form_11_a_slab_with_all_orders() {
    for (n, a) in [1.0f64, 1.5, 2.4, 4.0, 1e3].map(|n| [0.3f64, 0.9, 1.0].map(|a| (n, a))).concat()
    {
        let f = ((n - 1.0) / (n + 1.0)).powi(2);
        let object = |shape: &str| {
            format!(
                "ior = {n:?}\nattenuation_color = [{a:?}, {a:?}, {a:?}]\n\
                 [[object]]\nmaterial = \"glass\"\nshape.{shape}"
            )
        };
        let slab = object("box = { center = [0, 0, -2], size = [9, 9, 1] }");
        let count = 1 << 12;
        let orders = 1.0 - (f * a).powi(2);
        let expected = [(1.0 - f).powi(2) * a / orders, f + f * ((1.0 - f) * a).powi(2) / orders];
        let check = |all: Vec<Vector>| {
            assert!(a < 1.0 || all.iter().all(|s| (s[0] + s[1] - 1.0).abs() < 1e-6), "lost light");
            let mean = mean(&all);
            for i in 0..2 {
                let squares: f64 = all.iter().map(|s| (s[i] - mean[i]).powi(2)).sum();
                let sigma = squares.sqrt() / f64::from(count) + 1e-6;
                assert!((mean[i] - expected[i]).abs() < 4.5 * sigma, "{n} {a}: {mean:?}");
            }
        };
        check(samples::<Double>(&between_walls(&slab), count));
        check(samples::<Single>(&between_walls(&slab), count));
        if a == 1.0 {
            let pane =
                object("rectangle = { center = [0, 0, -2], size = [9, 9], normal = [0, 0, 1] }");
            let [t, r, _] = mean(&samples::<Double>(&between_walls(&pane), 8));
            assert!((r - expected[1]).abs() < 1e-12 && (r + t - 1.0).abs() < 1e-12, "{n}: {r}");
        }
    }
}

#[test]
fn rough_glass_converges_to_clear_glass() {
    let mut scene = sized(shipped("rough-glass.toml"), [24, 16]);
    // Only a clear pane lets the light of lamps through.
    scene.objects.retain(|object| !object.names_material("pane"));
    let with = |alpha: f64| {
        let mut scene = scene.clone();
        for material in scene.materials.values_mut().filter(|m| m.transmission > 0.0) {
            (material.lobe, material.alpha) = (Lobe::Ggx, Some(alpha));
        }
        mean_by_pixel(&samples::<Double>(&scene, 512), 512)
    };
    let clear = with(0.0);
    assert!(with(9e-4) == clear);
    let apart = |alpha: f64| {
        let squares: f64 = with(alpha)
            .iter()
            .zip(&clear)
            .map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>())
            .sum();
        (squares / clear.len() as f64 / 3.0).sqrt()
    };
    let (near, far) = (apart(1e-3), apart(0.2));
    println!("root mean square {near:.4} at alpha 0.001, {far:.4} at 0.2");
    // From the third interface of a path on, a ray is reflected or transmitted at random. The noise
    // of this choice is 0.01.
    assert!(near < 0.2 * far, "{near} {far}");
}

fn mean_by_pixel(samples: &[Vector], count: usize) -> Vec<Vector> {
    samples.chunks(count).map(mean).collect()
}

/// Checks a camera inside glass. It sees the outside up to the critical angle of 41.8 degrees, and
/// internal reflections beyond it. This also holds with a near plane, and for a camera in a bubble
/// in the glass.
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
            ambient = 0.0\ndiffuse = 0.0\ntransmission = 1.0\nior = 1.0
            [[object]]
            material = \"m\"
            shape.box = {{ center = [0.0, 0.0, 0.0], size = [1e4, 1e4, 2.0] }}
            {more}"
        );
        mean(&samples::<Double>(&parsed(&text), 8))[0]
    };
    let bubble = "[[object]]\nmaterial = \"air\"\n\
        shape.sphere = { center = [0.0, 0.0, 0.0], radius = 0.25 }";
    for near in [0.0, 0.5] {
        assert_eq!(look(41.8, near, "", ""), 1.0);
        assert_eq!(look(41.82, near, "", ""), 0.0);
        assert_eq!(look(60.0, near, "fresnel = \"dielectric\"", ""), 0.0);
        let f = 0.04;
        // The ray leaves the glass at the first surface, or is reflected there and leaves at the
        // opposite one.
        let seen = look(0.0, near, "fresnel = \"dielectric\"", "");
        assert!((seen - (1.0 - f * f)).abs() < 1e-9, "{near}: {seen}");
    }
    // Rays from the centre of a bubble leave it straight and are in glass then.
    assert_eq!(look(41.8, 0.0, "", bubble), 1.0);
    assert_eq!(look(41.82, 0.0, "", bubble), 0.0);
}
