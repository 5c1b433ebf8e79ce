//! Extremes of brightness: samples inside and outside of the range of the film.

use crate::harness::*;

const PRECISIONS: [Precision; 2] = [Precision::Auto, Precision::Double];

/// Checks that no sample of the film is invalid and none is saturated.
fn assert_no_sample_lost(rendering: &RenderState, name: &str) {
    let film = &rendering.film;
    let lost = (film.bad_samples(), film.saturated_samples(), film.saturated_pixels());
    assert_eq!(lost, (0, 0, 0), "{name}");
}

/// Returns the mean of the green channel over all pixels.
fn mean(rendering: &RenderState) -> f64 {
    let pixels = picture(rendering, Replicates::Both);
    pixels.iter().map(|p| p[1]).sum::<f64>() / pixels.len() as f64
}

/// Colour of objects without a material.
const GRAY: f64 = 0.8;

/// Returns the text of a scene that looks straight down on a surface from `height`, with a lamp
/// beside the eye. The view angle is small. Every pixel therefore has the radiance [`GRAY`] x
/// intensity / (pi x height^2).
fn below_a_lamp(height: f64, [x, y, z]: [f64; 3], shape: &str) -> String {
    format!(
        "film = {{ size = [8, 8] }}\n\
         camera = {{ eye = [{x}, {}, {z}], direction = [0.0, -1.0, 0.0], up = [0.0, 0.0, 1.0], \
         view_angle.vertical = 2.0 }}\n\
         light = [{{ point = {{ position = [{x}, {}, {z}] }}, intensity = {}, falloff = \"inverse-square\" }}]\n\
         [[object]]\nshape.{shape}\n",
        y + 0.99 * height,
        y + height,
        PI * height * height / GRAY,
    )
}

/// Checks a lamp 6 units above a sphere as large as the earth, and lamps close to walls inside the
/// scene's bounding box.
#[test]
fn surface_near_lamp_is_lit_at_every_scene_extent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(folder.path().join("room.obj"), obj_box(DVec3::splat(-500.0), DVec3::splat(500.0)))
        .unwrap();
    let cases = [
        // As large as the earth.
        (6.0, [0.0; 3], "sphere = { center = [0, -6.371e6, 0], radius = 6.371e6 }"),
        // From inside.
        (
            1e-4,
            [0.0, -50.0, 0.0],
            "cylinder = { base = [0, 0, -900], top = [0, 0, 900], radius = 50 }",
        ),
        (
            1e-3,
            [0.0, -3000.0, 0.0],
            "sphere = { center = [0, 0, 0], radius = 1000 }\ntransform = [{ scale = [1, 3, 7] }]",
        ),
        (
            1e-3,
            [0.0, 500.0, 0.0],
            "difference.of = [{ shape.box = { center = [0, 0, 0], size = [1000, 1000, 1000] } }, \
             { shape.sphere = { center = [900, 0, 0], radius = 500 } }]",
        ),
        (2e4, [0.0; 3], "plane = { point = [0, 0, 0], normal = [0, 1, 0] }"),
        (1e-3, [30.0, -500.0, 70.0], "mesh = { file = \"room.obj\", normals = \"flat\" }"),
    ];
    let mut worst = 0f64;
    for (height, place, shape) in cases {
        let text = below_a_lamp(height, place, shape);
        let scene = Scene::parse(&text, &path.display().to_string()).unwrap();
        for precision in PRECISIONS {
            let rendering = rendered(&scene, 1, precision, 8);
            assert_no_sample_lost(&rendering, shape);
            let found = mean(&rendering);
            assert!((found - 1.0).abs() < 2e-3, "{shape} in {precision:?}: {found}");
            worst = worst.max((found - 1.0).abs());
        }
    }
    report(30, "both", &format!("close lamps in large scenes: {worst:.0e} off"));
}

fn floor(material: &str, intensity: f64) -> Scene {
    parsed(&format!(
        "film = {{ size = [8, 8] }}\n\
         camera = {{ eye = [0.0, 2.0, 0.0], direction = [0.0, -1.0, 0.0], up = [0.0, 0.0, 1.0] }}\n\
         light = [{{ directional = {{ direction = [0.0, -1.0, 0.0] }}, intensity = {intensity} }}]\n\
         [materials.own]\n{material}\n\
         [[object]]\nmaterial = \"own\"\n\
         shape.platform = {{ center = [0.0, 0.0, 0.0], size = [90.0, 90.0] }}\n"
    ))
}

#[test]
fn dim_colour_in_bright_light_is_white() {
    for colour in [1e-15, 1e-9, 1e-6, 0.002, 1.0, 50.0, 1e6] {
        let scene = floor(&format!("color = [{colour}, {colour}, {colour}]"), 1.0 / colour);
        for precision in PRECISIONS {
            let rendering = rendered(&scene, 1, precision, 8);
            assert_no_sample_lost(&rendering, "colour");
            let found = mean(&rendering);
            assert!((found - 1.0).abs() < 1e-4, "{colour:e} in {precision:?}: {found}");
        }
    }
}

#[test]
fn bright_colour_does_not_saturate_film() {
    let mut scene = floor("color = [1e6, 1e6, 1e6]", 1e-6);
    scene.film.size = [2, 1];
    let mut rendering = begin(&scene, 1, Precision::Single);
    uniform(&mut rendering, 0, 1 << 18, &pool(2));
    assert_no_sample_lost(&rendering, "colour 1e6");
    assert!((mean(&rendering) - 1.0).abs() < 1e-6, "{}", mean(&rendering));
}

/// Checks two facing mirrors that amplify light, with a bright background. The red radiance of
/// every pixel must be finite and above 1, the largest displayed value.
#[test]
fn amplifying_mirrors_give_finite_white() {
    let text = |k: f64, depth: u32| {
        format!(
            "film = {{ size = [12, 9] }}\ntrace = {{ max_depth = {depth} }}\n\
             camera = {{ eye = [0.0, 0.0, 0.0], direction = [0.05, 0.02, -1.0] }}\n\
             background = {{ color = [1.0, 0.5, 0.25] }}\n\
             light = [{{ point = {{ position = [0.0, 0.3, 0.0] }} }}]\n\
             [materials.mirror]\ncolor = [0.5, 0.0, 0.0]\nreflection = {k}\n\
             [[object]]\nmaterial = \"mirror\"\n\
             shape.rectangle = {{ center = [0.0, 0.0, -1.0], size = [8.0, 8.0], normal = [0.0, 0.0, 1.0] }}\n\
             [[object]]\nmaterial = \"mirror\"\n\
             shape.rectangle = {{ center = [0.0, 0.0, 1.0], size = [8.0, 8.0], normal = [0.0, 0.0, -1.0] }}\n"
        )
    };
    for (k, depth, saturates) in
        [(3.0, 12, false), (3.0, 40, true), (3.0, 400, true), (1e6, 2000, true)]
    {
        for precision in [Precision::Single, Precision::Double] {
            let name = format!("k_r {k}, depth {depth}, {precision:?}");
            let rendering = rendered(&parsed(&text(k, depth)), 1, precision, 8);
            assert_eq!(rendering.film.bad_samples(), 0, "{name}");
            assert_eq!(rendering.film.saturated_samples() > 0, saturates, "{name}");
            let pixels = picture(&rendering, Replicates::Both);
            assert!(pixels.iter().all(|p| p[0] > 1.0 && p[0].is_finite()), "{name}: {pixels:?}");
            // Saturated samples leave the noise estimate finite.
            let noise = rendering.film.noise(&rendering.weights, &Display::default()).unwrap();
            assert!(
                noise.rmse.levels.is_finite() && noise.rmse.linear.is_finite(),
                "{name}: {noise:?}"
            );
        }
    }
}
