//! Tests of textures and bumps, compared with the reference tracer.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;

/// Returns `scene` with camera rays only and without highlights.
fn plain(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.trace.ray_types = RayTypes::Primary;
    scene.materials.values_mut().for_each(|m| m.specular = 0.0);
    scene
}

/// Compares colours as [`agrees_within`] does, without mirrors and highlights. The tolerance allows
/// for textures in single precision.
fn same_colors(original: &Scene, tested: &Scene) -> Verdict {
    agrees_within(&plain(original), &plain(tested), 2e-5)
}

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
        |tested| same_colors(&original, tested),
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

#[test]
fn b14_bump_texture() {
    let original = shipped("bump.toml");
    row(
        "bump.toml",
        |tested| same_colors(&original, tested),
        &[
            ("flat", &|s| s.materials.get_mut("plaster").unwrap().bump = None),
            ("sunken", &|s| set(s, "plaster", "bump.image.height", "-0.02")),
            ("half as high", &|s| set(s, "plaster", "bump.image.height", "0.01")),
            ("another scale", &|s| set(s, "plaster", "bump.image.scale", "3 2")),
            ("another mapping", &|s| set(s, "plaster", "bump.image.mapping", "box")),
            ("as colours", &|s| {
                s.materials.get_mut("plaster").unwrap().bump = None;
                set(s, "plaster", "texture", "image");
                set(s, "plaster", "texture.image.file", "../textures/brick-heights.png");
            }),
        ],
    );
}
