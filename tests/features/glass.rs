//! Tests of rough transmission and absorption.

use crate::features::plain_tracer::agrees;
use crate::features::row::{material, row};
use crate::support::shipped;
use zerkalo_scene::light::SphereLight;
use zerkalo_scene::material::Lobe;
use zerkalo_scene::value::Color;

#[test]
fn d6_rough_transmission() {
    let original = shipped("rough-glass.toml");
    row(
        "rough-glass.toml",
        |tested| agrees(&original, tested, 384),
        &[
            ("clear glass", &|s| material(s, "satin").lobe = Lobe::Mirror),
            ("a clear pane", &|s| material(s, "pane").alpha = Some(0.0)),
            ("half the slope", &|s| material(s, "frosted").alpha = Some(0.2)),
            ("a wider cone", &|s| material(s, "spread").roughness = 0.4),
            ("microfacets for the cone", &|s| material(s, "spread").lobe = Lobe::Beckmann),
        ],
    );
    // A lamp instead of the sun: points of it are sampled through the pane and from inside of
    // solids.
    let mut lit = original;
    let lamp = &mut lit.lights[0];
    lamp.kind = SphereLight { center: [1.0, 1.2, -3.0], radius: 0.5 }.into();
    lamp.intensity = 4.0;
    agrees(&lit, &lit, 384).unwrap();
}

#[test]
fn d7_absorption() {
    let original = shipped("absorbing-glass.toml");
    row(
        "absorbing-glass.toml",
        |tested| agrees(&original, tested, 256),
        &[
            ("clear glass", &|s| material(s, "green").attenuation_color = Color::WHITE),
            ("twice the distance", &|s| material(s, "green").attenuation_distance = 1.0),
            ("another colour", &|s| material(s, "amber").attenuation_color.0[2] = 0.2),
            ("an absorbing bubble", &|s| {
                let green = material(s, "green").clone();
                let air = material(s, "air");
                air.attenuation_color = green.attenuation_color;
                air.attenuation_distance = green.attenuation_distance;
            }),
        ],
    );
}
