//! Environment lights: white furnaces, very bright pixels, scaled and rotated images, hostile files.

use crate::harness::*;
use zerkalo_render::film::file::FilmFileHeader;
use zerkalo_render::film::testing::header;
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_scene::asset::RadianceMap;

/// Returns the mean of each channel over the picture, and the standard error of the mean. The error
/// comes from the difference of the two replicates; pixels are independent.
fn mean(scene: &Scene, seed: u64, precision: Precision, count: u32) -> [(f64, f64); 3] {
    let rendering = rendered(scene, seed, precision, count);
    assert_eq!(rendering.film.bad_samples(), 0);
    let [a, b] = [Replicates::A, Replicates::B].map(|part| picture(&rendering, part));
    let n = a.len() as f64;
    std::array::from_fn(|c| {
        let sum: f64 = a.iter().zip(&b).map(|(a, b)| 0.5 * (a[c] + b[c])).sum();
        let squares: f64 = a.iter().zip(&b).map(|(a, b)| (0.5 * (a[c] - b[c])).powi(2)).sum();
        (sum / n, squares.sqrt() / n)
    })
}

fn ball(material: &str, trace: &str, light: &str) -> Scene {
    parsed(&format!(
        "film.size = [24, 16]
         camera = {{ eye = [0, 0, 4], target = [0, 0, 0], view_angle.vertical = 36 }}
         [trace]\n{trace}\n{light}
         [materials.tested]\ncolor = [1, 1, 1]\nambient = 0\n{material}
         [[object]]
         material = \"tested\"
         shape.sphere = {{ center = [0.0, 0.0, 0.0], radius = 1.0 }}"
    ))
}

const WHITE_SKY: &str = "[[light]]\nenvironment = {}";

/// Checks the light of one diffuse bounce between a floor and a wall that is 1 high, both very
/// long, in a white environment. As seen from a point of the floor, the upper edge of the wall is
/// at the angle phi above the horizon, and the wall has the form factor F = (1 - cos phi) / 2. The
/// wall sees the environment in half of its hemisphere, the floor in the share 1 - F. With the
/// albedo rho the radiance of the floor is rho (1 - F) from the environment, and F rho^2 / 2 after
/// one bounce.
#[test]
fn diffuse_bounce_between_floor_and_wall_in_an_environment_has_its_form_factor() {
    let rho = 0.8;
    let threshold = two_sided_z(1e-4 / 12.0);
    for distance in [0.2, 1.0, 3.0] {
        let text = format!(
            "film = {{ size = [12, 12], filter = \"point\" }}
            camera = {{ eye = [{distance:?}, 0.5, 0.0], target = [{distance:?}, 0.0, 0.0], \
            up = [0.0, 0.0, 1.0], view_angle.vertical = 0.01 }}
            {WHITE_SKY}
            [materials.gray]
            color = [{rho:?}, {rho:?}, {rho:?}]
            ambient = 0.0
            diffuse = 1.0
            [[object]]
            material = \"gray\"
            shape.rectangle = {{ center = [0.0, 0.5, 0.0], size = [1000.0, 1.0], normal = [1.0, 0.0, 0.0] }}
            [[object]]
            material = \"gray\"
            shape.platform = {{ center = [500.0, 0.0, 0.0], size = [1000.0, 1000.0] }}"
        );
        let cos = distance / f64::hypot(distance, 1.0);
        let wall = 0.5 * (1.0 - cos);
        for (bounces, expected) in
            [(0, rho * (1.0 - wall)), (1, rho * (1.0 - wall) + wall * rho * rho * 0.5)]
        {
            for precision in [Precision::Single, Precision::Double] {
                let mut scene = parsed(&text);
                scene.trace.max_diffuse_depth = bounces;
                let [(mean, error), ..] = mean(&scene, 7, precision, 512);
                let z = (mean - expected) / error;
                println!(
                    "{distance}, {bounces} bounces, {precision:?}: {mean}, {expected}, z {z:.2}"
                );
                // Floor and wall end at a distance of 500. The light of the parts beyond, less than
                // 1e-5, is missing.
                assert!(
                    (mean - expected).abs() <= threshold * error + 1e-5 && error < 1e-3,
                    "{distance}, {bounces}, {precision:?}: {mean} +- {error}, expected {expected}"
                );
            }
        }
    }
}

#[test]
fn lobes_reflect_a_white_environment_like_a_white_background() {
    let background = "[background]\ncolor = [1.0, 1.0, 1.0]";
    let mut compared = 0.0;
    for lobe in ["cone", "square", "beckmann", "ggx"] {
        for roughness in [0.02, 0.3, 1.0] {
            for horizon in ["fold", "absorb"] {
                // A highlight of the same microfacets shows nothing twice.
                let highlight = match lobe {
                    "beckmann" | "ggx" => "specular = 1.0\nhighlight = \"cook-torrance\"",
                    _ => "specular = 0.0",
                };
                let material = format!(
                    "diffuse = 0.0\nreflection = 1.0\nroughness = {roughness}\nlobe = \"{lobe}\"\n{highlight}"
                );
                let trace = format!("below_horizon = \"{horizon}\"");
                let [by_light, by_background] = [WHITE_SKY, background]
                    .map(|light| mean(&ball(&material, &trace, light), 2, Precision::Auto, 64)[0]);
                let error = by_light.1.hypot(by_background.1);
                let difference = by_light.0 - by_background.0;
                compared += 1.0;
                assert!(
                    difference.abs() <= two_sided_z(1e-4 / 24.0) * error + 1e-6,
                    "{lobe}, {roughness}, {horizon}: {by_light:?}, {by_background:?}"
                );
            }
        }
    }
    assert_eq!(compared, 24.0);
}

/// Writes an image file in Radiance format (HDR) without compression. `texel` returns the three
/// mantissas and the exponent of the pixel in a column and a row.
fn write_hdr(path: &Path, [width, height]: [usize; 2], texel: impl Fn(usize, usize) -> [u8; 4]) {
    let mut bytes =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for y in 0..height {
        (0..width).for_each(|x| bytes.extend(texel(x, y)));
    }
    fs::write(path, bytes).unwrap();
}

/// Returns the scene of a white floor that faces up, fills the picture, and is lit by the
/// environment image `sky.hdr` in `folder`. `environment` has further keys of this light.
fn floor(folder: &Path, environment: &str) -> Scene {
    let path = folder.join("scene.toml");
    let text = format!(
        "film.size = [16, 16]
         camera = {{ eye = [0.0, 3.0, 0.0], target = [0.0, 0.0, 0.0], up = [0.0, 0.0, -1.0] }}
         materials.white = {{ ambient = 0.0, color = [1.0, 1.0, 1.0] }}
         [[light]]
         environment = {{ file = \"sky.hdr\", {environment} }}
         [[object]]
         material = \"white\"
         shape.platform = {{ center = [0.0, 0.0, 0.0], size = [9.0, 9.0] }}"
    );
    fs::write(&path, text).unwrap();
    Scene::read(&path).unwrap_or_else(|e| panic!("{e}"))
}

/// Checks an environment image with a pixel 2^20 times as bright as the others. No sample may be
/// infinite or NaN. The radiance of a white floor must be its irradiance by the image, divided by
/// pi.
#[test]
fn image_with_a_very_bright_pixel_gives_its_irradiance() {
    let folder = tempfile::tempdir().unwrap();
    let [width, height] = [64, 32];
    // 2^-7 and 2^13: a ratio of 2^20.
    let exponent = |x: usize, y: usize| if (x, y) == (20, 9) { 142 } else { 122 };
    write_hdr(&folder.path().join("sky.hdr"), [width, height], |x, y| {
        [128, 128, 128, exponent(x, y)]
    });
    let radiance = |x: usize, y: usize| 2f64.powi(i32::from(exponent(x % width, y)) - 129);
    // Integral of the interpolated image by the midpoint rule.
    let (n, mut irradiance) = (32, 0.0);
    for row in 0..height * n / 2 {
        let v = (row as f64 + 0.5) / n as f64 - 0.5;
        let theta = std::f64::consts::PI * (v + 0.5) / height as f64;
        for column in 0..width * n {
            let u = (column as f64 + 0.5) / n as f64 - 0.5 + width as f64;
            let (x, y) = (u.floor(), v.floor().max(0.0));
            let (s, t) = (u - x, if v < 0.0 { 0.0 } else { v - y });
            let (x, y) = (x as usize, y as usize);
            let mixed = |y: usize| radiance(x, y) * (1.0 - s) + radiance(x + 1, y) * s;
            let value = mixed(y) * (1.0 - t) + mixed((y + 1).min(height - 1)) * t;
            irradiance += value * theta.cos() * theta.sin();
        }
    }
    let cell =
        (std::f64::consts::PI / (height * n) as f64) * (std::f64::consts::TAU / (width * n) as f64);
    let expected = irradiance * cell / std::f64::consts::PI;
    for precision in [Precision::Single, Precision::Double] {
        for rotation in [0.0, 77.0] {
            let scene = floor(folder.path(), &format!("rotation = {rotation}"));
            let [(mean, error), ..] = mean(&scene, 3, precision, 128);
            assert!(
                (mean - expected).abs() <= 4.0 * error + 2e-4 * expected,
                "{precision:?}, {rotation}: {mean} +- {error}, expected {expected}"
            );
            assert!(error < 0.02 * expected, "{error} of {expected}");
        }
    }
}

#[test]
fn invisible_environment_lights_but_is_not_seen() {
    let hidden = format!("{WHITE_SKY}\nvisible = false");
    let values = |material: &str| {
        let rendering = rendered(&ball(material, "", &hidden), 5, Precision::Auto, 64);
        let pixels = picture(&rendering, Replicates::Both);
        // A corner, and the middle of the ball.
        [pixels[0][0], pixels[8 * 24 + 12][0]]
    };
    assert_eq!(values("diffuse = 0.0\nreflection = 1.0"), [0.0, 0.0]);
    let [corner, middle] = values("diffuse = 1.0");
    assert!(corner == 0.0 && (middle - 1.0).abs() < 0.1, "{corner}, {middle}");
}

#[test]
fn hostile_environment_images_are_located_errors() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    fs::write(&scene, "[[light]]\nname = \"sky\"\nenvironment.file = \"sky.hdr\"\n").unwrap();
    let error = || Scene::read(&scene).expect_err("an error").to_string();
    assert!(error().contains("there is no such file"), "{}", error());
    let header = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n";
    for (content, words) in [
        (format!("{header}-Y 60000 +X 60000\n"), "60000 x 60000 pixels"),
        (format!("{header}-Y 64 +X 64\nabcd"), "cannot be read"),
        (header.to_string(), "cannot be read"),
        ("no image".to_string(), "no image of a known format"),
    ] {
        // Each content has another length, by which the cache of files notices the change.
        fs::write(folder.path().join("sky.hdr"), content).unwrap();
        let error = error();
        assert!(error.contains(words), "{words}: {error}");
        assert!(error.contains("scene.toml:3:") && error.contains("\"sky\""), "{error}");
    }
}

/// Returns the panorama from the origin towards -z of the scene in `text`, rendered in double precision and written
/// to `folder` as `sky.hdr`, an image of `size` pixels.
fn panorama(folder: &Path, text: &str, size: [u32; 2], samples: u32) -> RadianceMap {
    let path = folder.join("around.toml");
    let camera = "eye = [0, 0, 0], direction = [0, 0, -1], projection = \"equirectangular\"";
    fs::write(&path, format!("camera = {{ {camera} }}\n{text}")).unwrap();
    let rendering =
        rendered(&sized(Scene::read(&path).unwrap(), size), 1, Precision::Double, samples);
    let header = FilmFileHeader { weights: rendering.weights.clone(), ..header(&rendering.film) };
    let output = ImageOutput::from_path(folder.join("sky.hdr")).unwrap();
    output.write(&header, Depth::Eight, &mut &rendering.film).unwrap();
    RadianceMap::clone(floor(folder, "").lights[0].environment().unwrap().map().unwrap())
}

/// Checks that the panorama of an environment alone has the pixels of its image, in a file of the same values.
#[test]
fn panorama_of_an_environment_is_its_image() {
    let folder = tempfile::tempdir().unwrap();
    // Rows with runs, and a width below the smallest of rows with runs.
    for size in [[40, 20], [6, 3]] {
        let texel = |x: usize, y: usize| match y % 3 {
            0 => [200, 128 + (7 * x % 90) as u8, (x / 9) as u8, 129],
            _ => [140 + (x / 11) as u8, 3, 90 + (y % 7) as u8, 126 + (x % 5) as u8],
        };
        write_hdr(&folder.path().join("image.hdr"), size, texel);
        let text = "film.filter = \"point\"\n[[light]]\nenvironment.file = \"image.hdr\"";
        let shown = panorama(folder.path(), text, size.map(|n| n as u32), 2);
        write_hdr(&folder.path().join("sky.hdr"), size, texel);
        let original = floor(folder.path(), "");
        assert!(shown == **original.lights[0].environment().unwrap().map().unwrap());
    }
}

/// Checks that a small ball is lit by surroundings that only emit light as by their panorama.
#[test]
fn panorama_lights_as_the_scene_does() {
    let folder = tempfile::tempdir().unwrap();
    let around = "[[light]]
        environment = { zenith = [0.2, 0.3, 0.5], horizon = [0.3, 0.2, 0.1], nadir = [0.1, 0.1, 0.1] }
        [[light]]
        sphere = { center = [3.0, 2.5, 1.0], radius = 0.9 }
        intensity = 4.0
        [[light]]
        rectangle = { center = [-2.0, 3.0, -3.0], size = [2.0, 3.0], normal = [0.4, -0.6, 0.7] }
        color = [1.0, 0.8, 0.5]
        intensity = 2.0
        [materials.wall]
        color = [0.0, 0.0, 0.0]
        emission = 1.0
        emission_color = [0.4, 1.0, 0.7]
        [[object]]
        material = \"wall\"
        shape.rectangle = { center = [0.0, -3.0, 3.0], size = [5.0, 3.0], normal = [0.0, 0.7, -0.7] }\n";
    let ball = "[[object]]
        material = \"ball\"
        shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1e-3 }
        [materials.ball]
        color = [1.0, 1.0, 1.0]
        ambient = 0.0
        diffuse = 0.6
        reflection = 0.4
        lobe = \"ggx\"
        alpha = 0.4\n";
    let look = "film.size = [32, 32]
        camera = { eye = [0.0, 0.002, 0.004], target = [0.0, 0.0, 0.0], view_angle.vertical = 24 }\n";
    panorama(folder.path(), around, [256, 128], 32);
    let by_image = folder.path().join("by-image.toml");
    fs::write(&by_image, format!("{look}{ball}[[light]]\nenvironment.file = \"sky.hdr\"")).unwrap();
    let by_image = Scene::read(&by_image).unwrap();
    let [direct, by_image] = [parsed(&format!("{look}{around}{ball}")), by_image]
        .map(|scene| mean(&scene, 3, Precision::Double, 256));
    for ((direct, e), (image, f)) in direct.into_iter().zip(by_image) {
        let z = (direct - image) / e.hypot(f);
        println!("{direct:.5} +- {e:.5} {image:.5} +- {f:.5}, z {z:.2}");
        // The pixels are up to 0.025 radians wide, so that edges of lights blur: two parts in a thousand.
        assert!((direct - image).abs() <= two_sided_z(1e-4 / 3.0) * e.hypot(f) + 2e-3 * direct);
    }
}
