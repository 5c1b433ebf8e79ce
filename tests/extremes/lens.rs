//! Thin lens: circles of confusion against their closed form, and lenses of zero size and of the
//! size of the room.

use crate::harness::*;

/// Largest allowed deviation of a pixel from a closed form, in standard errors. The comparisons of
/// this file, some 4,000 pixels, give a false alarm in 1 of 1,000 runs.
const MAX_Z: f64 = 5.3;

/// Width and height of the picture of the edge of a white half-plane, in pixels.
const EDGE: [u32; 2] = [96, 4];

/// Returns the scene of a white half-plane x < 0 in front of a black background, at the distance
/// `depth` from the lens. The lens has the radius `radius` and is focused at the distance `focus`.
fn edge(depth: f64, radius: f64, focus: f64) -> Scene {
    Scene::parse(
        &format!(
            "film = {{ size = [{}, {}], filter = \"point\" }}\n\
             ambient.color = [1.0, 1.0, 1.0]\n\
             [camera]\neye = [0.0, 0.0, 0.0]\ndirection = [0.0, 0.0, -1.0]\n\
             view_angle.horizontal = 40.0\naperture.radius = {radius:?}\n\
             focus.distance = {focus:?}\n\
             [materials.white]\ncolor = [1.0, 1.0, 1.0]\nambient = 1.0\n\
             [[object]]\nmaterial = \"white\"\n\
             shape.rectangle = {{ center = [-500.0, 0.0, {:?}], size = [1000.0, 1000.0], \
             normal = [0.0, 0.0, 1.0] }}\n",
            EDGE[0], EDGE[1], -depth
        ),
        "edge",
    )
    .unwrap_or_else(|e| panic!("{e}"))
}

fn disk_share(t: f64) -> f64 {
    let t = t.clamp(-1.0, 1.0);
    0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / PI
}

/// Returns the expected radiance of each column: the share of the circle of confusion that is on
/// the half-plane. At the depth z, the circle has the radius r |1 - z / f|, where r is the radius
/// of the lens and f the focus distance.
fn profile(depth: f64, radius: f64, focus: f64) -> Vec<f64> {
    let confusion = radius * (1.0 - depth / focus).abs();
    let pixel = 2.0 * 20f64.to_radians().tan() / f64::from(EDGE[0]);
    (0..EDGE[0])
        .map(|column| {
            let x = (f64::from(column) + 0.5 - 0.5 * f64::from(EDGE[0])) * pixel * depth;
            if confusion == 0.0 { f64::from(u8::from(x < 0.0)) } else { disk_share(-x / confusion) }
        })
        .collect()
}

/// Renders two pictures of a scene, one with independent random numbers and one with Sobol points.
/// Compares both with `expected`, the radiance of each column. Returns the largest deviation of a
/// pixel with random numbers, in standard errors, and the root mean square errors of both pictures.
fn compare(scene: &Scene, expected: &[f64], precision: Precision) -> (f64, [f64; 2]) {
    const SAMPLES: u32 = 1024;
    let mut worst = 0.0f64;
    let errors = [SamplerKind::Random, SamplerKind::Sobol].map(|kind| {
        let settings = SampleSettings { seed: 3, kind };
        let mut rendering = begin_with(scene, settings, precision);
        uniform(&mut rendering, 0, SAMPLES / 2, &pool(2));
        let mut squares = 0.0;
        for (i, [value, ..]) in picture(&rendering, Replicates::Both).into_iter().enumerate() {
            let p = expected[i % expected.len()];
            let error = (value - p).abs();
            squares += error * error;
            // Each sample is 0 or 1, and its variance is therefore p (1 - p). Film and edge are
            // rounded to 1e-6.
            let deviation = (p * (1.0 - p) / f64::from(SAMPLES)).sqrt();
            if kind == SamplerKind::Random {
                worst = worst.max(error / (deviation + 1e-6));
            }
        }
        (squares / f64::from(EDGE[0] * EDGE[1])).sqrt()
    });
    (worst, errors)
}

#[test]
fn circle_of_confusion_matches_its_closed_form() {
    for (depth, radius, focus) in
        [(3.0, 0.2, 6.0), (6.0, 0.2, 3.0), (2.0, 0.3, 1e9), (1e3, 0.1, 0.5), (4.0, 0.5, 4.0)]
    {
        for precision in [Precision::Single, Precision::Double] {
            let (scene, expected) = (edge(depth, radius, focus), profile(depth, radius, focus));
            let (z, [random, sobol]) = compare(&scene, &expected, precision);
            println!(
                "depth {depth}, focus {focus}, {precision:?}: z {z:.2}, errors {random:.1e} {sobol:.1e}"
            );
            assert!(z < MAX_Z, "depth {depth}, radius {radius}, focus {focus}: z {z}");
            assert!(sobol <= 0.4 * random, "{sobol} with Sobol points, {random} without");
            // The comparison must detect a circle of confusion that is 5 % larger.
            if depth != focus {
                let larger = edge(depth, 1.05 * radius, focus);
                let (z, _) = compare(&larger, &expected, precision);
                assert!(z > MAX_Z, "a larger circle has z {z}");
            }
        }
    }
}

fn with_radius(scene: &Scene, radius: f64) -> Scene {
    let mut scene = scene.clone();
    scene.camera.aperture = Some(Aperture::Radius(radius));
    scene
}

/// Checks that all samples are finite for lenses as large as the room and larger, at any focus
/// distance.
#[test]
fn huge_aperture_gives_finite_samples() {
    for name in ["mirror-room.toml", "mirror-room-physical.toml", "glass.toml", "torus.toml"] {
        for radius in [0.5, 5.0, 1e3, 1e9] {
            for focus in [1e-300, 1e-6, 4.0, 1e9] {
                for precision in [Precision::Single, Precision::Double, Precision::Auto] {
                    let mut scene = with_radius(&sized(shipped(name), [16, 12]), radius);
                    scene.camera.focus = Some(Focus::Distance(focus));
                    assert_eq!(scene.faults(), []);
                    let rendering = rendered(&scene, 1, precision, 4);
                    let text = format!("{name}, radius {radius}, focus {focus}, {precision:?}");
                    assert_eq!(rendering.film.bad_samples(), 0, "{text}");
                    let pixels = picture(&rendering, Replicates::Both);
                    assert!(pixels.iter().flatten().all(|x| x.is_finite()), "{text}");
                }
            }
        }
    }
}
