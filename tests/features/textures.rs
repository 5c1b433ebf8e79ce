//! Tests of textures and bumps, compared with image lookups by the formulas of the mappings.

use crate::agreement::paint::Pixels;
use crate::features::first_hits::{RASTER, centers, first_hits, pixel_ray};
use crate::features::plain_tracer::without_chance;
use crate::features::row::{Verdict, ensure, number, row};
use crate::support::{shipped, sized};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use zerkalo_scene::edit::{self, Target};
use zerkalo_scene::material::{TextureFilter, Wrap};
use zerkalo_scene::shape::Shape;
use zerkalo_scene::{RayTypes, Scene};

/// Returns the image `name` of the folder `scenes/textures`.
fn image(name: &str) -> Pixels {
    Pixels::open(&format!("textures/{name}")).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns `scene` with camera rays only and without highlights.
fn plain(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.trace.ray_types = RayTypes::Primary;
    scene.materials.values_mut().for_each(|m| m.specular = 0.0);
    scene
}

/// Returns longitude (from +z towards +x) and latitude of a unit vector, in radians.
fn angles(n: DVec3) -> [f64; 2] {
    [n.x.atan2(n.z), n.y.asin()]
}

/// Returns the texture coordinates of the spherical mapping. `scale` is the change of u over a full
/// turn, and of v from pole to pole.
fn spherical(n: DVec3, scale: [f64; 2]) -> DVec2 {
    let [longitude, latitude] = angles(n);
    DVec2::new(0.5 + longitude / TAU, 0.5 + latitude / PI) * DVec2::from(scale)
}

/// Returns index and hit point of each pixel that shows the object `name`.
fn points(scene: &Scene, name: &str) -> Vec<(usize, DVec3)> {
    let object = number(scene, name) as u32;
    let scene = sized(scene.clone(), RASTER);
    let hits = first_hits(&scene).into_iter().zip(centers(RASTER)).enumerate();
    hits.filter(|(_, (hit, _))| hit.object == Some(object))
        .map(|(i, (hit, center))| {
            let ray = pixel_ray(&scene.camera, RASTER, center);
            (i, ray.origin + ray.direction * f64::from(hit.depth))
        })
        .collect()
}

fn ball(scene: &Scene, name: &str) -> (DVec3, f64) {
    match &scene.objects[number(scene, name)].shape {
        Shape::Sphere(s) => (s.center.into(), s.radius),
        other => panic!("{name} is a {}", other.key()),
    }
}

/// Checks the pixels of two textured objects: a picture on a wall, and a ball. The radiance of
/// these pixels in `tested` must be the colour of the texture image, times the radiance in
/// `original` without textures.
fn has_images(original: &Scene, tested: &Scene) -> Verdict {
    let mut bare = plain(original);
    bare.materials.values_mut().for_each(|m| m.texture = None);
    let (untextured, textured) = (without_chance(&bare), without_chance(&plain(tested)));
    let (sheet, wood) = (image("sheet.png"), image("wood.png"));
    let color = |image: &Pixels, uv| image.color(uv, Wrap::Repeat, TextureFilter::Bilinear);
    let (center, radius) = ball(original, "ball");
    let mut pixels: Vec<(usize, DVec3)> = Vec::new();
    for (i, p) in points(original, "picture") {
        // The picture on the wall is 1.1 wide and 0.8 high. Its centre is at x = -0.75, y = 1.55.
        let uv = DVec2::new((p.x + 0.75) / 1.1 + 0.5, (p.y - 1.55) / 0.8 + 0.5);
        pixels.push((i, color(&sheet, uv)));
    }
    ensure(pixels.len() > 40, || format!("{} pixels of the picture", pixels.len()))?;
    for (i, p) in points(original, "ball") {
        pixels.push((i, color(&wood, spherical((p - center) / radius, [3.0, 2.0]))));
    }
    ensure(pixels.len() > 120, || format!("{} pixels in all", pixels.len()))?;
    for (i, color) in pixels {
        let expected = color * untextured[i];
        let difference = (textured[i] - expected).abs().max_element();
        ensure(difference < 2e-3, || format!("pixel {i}: {} instead of {expected}", textured[i]))?;
    }
    Ok(())
}

/// Sets the property `key` of a material to the value `text`.
fn set(scene: &mut Scene, material: &str, key: &str, text: &str) {
    let subject = Target::Material(material.into());
    let edit = edit::set(scene, &subject, key, text);
    *scene = edit.unwrap_or_else(|refusal| panic!("{key} {text}: {refusal:?}")).scene;
}

#[test]
fn b13_image_texture() {
    let original = shipped("texture-image.toml");
    row(
        "texture-image.toml",
        |tested| has_images(&original, tested),
        &[
            ("no image", &|s| s.materials.get_mut("picture").unwrap().texture = None),
            ("one colour", &|s| {
                let picture = s.materials.get_mut("picture").unwrap();
                (picture.texture, picture.color) = (None, zerkalo_scene::value::Color([0.5; 3]));
            }),
            ("another mapping", &|s| set(s, "picture", "texture.image.mapping", "planar")),
            ("another mapping of the ball", &|s| {
                set(s, "polished", "texture.image.mapping", "box");
            }),
            ("another scale", &|s| set(s, "polished", "texture.image.scale", "2 2")),
            ("another place", &|s| set(s, "picture", "texture.image.offset", "0.1 0")),
        ],
    );
}

/// Checks that the plaster ball is shaded with the normals of a surface that is raised by the
/// heights of an image, and that the ball keeps its silhouette.
fn is_raised(original: &Scene, tested: &Scene) -> Verdict {
    let picture = without_chance(&plain(tested));
    let heights = image("brick-heights.png");
    let (center, radius) = ball(original, "plaster ball");
    let (scale, height) = ([3.0, 1.5], 0.02);
    let plaster = &original.materials["plaster"];
    let color = DVec3::from(plaster.color.0);
    let light = &original.lights[0];
    let light_position = light.apex().unwrap();
    let eye = DVec3::from(original.camera.eye);
    let hits = points(tested, "plaster ball");
    ensure(hits == points(original, "plaster ball"), || "another outline".into())?;
    let step = 1.0 / heights.size;
    let mut bent = 0;
    for (i, p) in hits {
        let n = (p - center) / radius;
        let uv = spherical(n, scale);
        // Central difference of the heights, one image pixel to each side.
        let [along_u, along_v] = [DVec2::X * step.x, DVec2::Y * step.y].map(|d| {
            let rise = heights.height(uv + d, Wrap::Repeat) - heights.height(uv - d, Wrap::Repeat);
            height * rise / (2.0 * d.element_sum())
        });
        let [longitude, latitude] = angles(n);
        let east = DVec3::new(longitude.cos(), 0.0, -longitude.sin());
        let north = n.cross(east);
        let slope = east * (along_u * scale[0] / (TAU * radius * latitude.cos()))
            + north * (along_v * scale[1] / (PI * radius));
        let raised = (n - slope).normalize();
        if raised.dot((eye - p).normalize()) < 0.05 {
            continue;
        }
        bent += usize::from(raised.dot(n) < 0.99);
        let to_light = (light_position - p).normalize();
        let cos = if n.dot(to_light) > 0.0 { raised.dot(to_light).max(0.0) } else { 0.0 };
        let expected = color * DVec3::from(original.ambient.color.0) * plaster.ambient
            + color * (plaster.diffuse * light.intensity * cos);
        let difference = (picture[i] - expected).abs().max_element();
        ensure(difference < 3e-3, || format!("pixel {i}: {} instead of {expected}", picture[i]))?;
    }
    ensure(bent > 20, || format!("only {bent} pixels are bent"))
}

#[test]
fn b14_bump_texture() {
    let original = shipped("bump.toml");
    row(
        "bump.toml",
        |tested| is_raised(&original, tested),
        &[
            ("flat", &|s| s.materials.get_mut("plaster").unwrap().bump = None),
            ("sunken", &|s| set(s, "plaster", "bump.image.height", "-0.02")),
            ("half as high", &|s| set(s, "plaster", "bump.image.height", "0.01")),
            ("another scale", &|s| set(s, "plaster", "bump.image.scale", "3 2")),
            ("another mapping", &|s| set(s, "plaster", "bump.image.mapping", "box")),
            ("as colours", &|s| {
                s.materials.get_mut("plaster").unwrap().bump = None;
                set(s, "plaster", "texture", "image");
                set(s, "plaster", "texture.image.file", "textures/brick-heights.png");
            }),
        ],
    );
}
