//! Lints: legal values of a scene that are probably mistakes.

use crate::material::{Fresnel, Highlight, Material};
use crate::scene::Scene;
use crate::scene::validate::Problem;
use crate::value::{Color, number};

impl Scene {
    /// Returns one warning for each kind of doubtful value in the scene. The warning states the
    /// first such value and the number of others.
    /// [`Document::warnings`](crate::scene::Document::warnings) adds file, line and column.
    pub fn warnings(&self) -> Vec<Problem> {
        let materials = |lint: &dyn Fn(&Material) -> Option<(&'static str, String)>| {
            let mut cases = self.materials.iter().filter_map(|(n, m)| Some((n, lint(m)?)));
            let (name, (key, found)) = cases.next()?;
            Some((
                vec!["materials".to_string(), name.clone(), key.to_string()],
                found,
                cases.count(),
            ))
        };
        let mut problems = Vec::new();
        let mut add = |case: Option<(Vec<String>, String, usize)>, help: &str| {
            let Some((path, found, others)) = case else { return };
            let path: Vec<&str> = path.iter().map(String::as_str).collect();
            let more = match others {
                0 => String::new(),
                1 => " (and one more like it)".to_string(),
                n => format!(" (and {n} more like it)"),
            };
            problems.push(self.problem(&path, found + &more, help.to_string()));
        };
        add(
            materials(&brighter_than_its_light),
            "Allowed: the picture is clipped only for display.",
        );
        add(
            materials(&|m| {
                let alpha = m.alpha.filter(|a| *a > 2.0 && m.has_microfacets())?;
                Some(("alpha", format!("alpha is {}, grooves far deeper than wide", number(alpha))))
            }),
            "Surfaces have an alpha from 0 to about 1.",
        );
        add(
            materials(&|m| {
                (m.alpha.is_some() && !m.has_microfacets())
                    .then(|| ("alpha", "alpha has no effect here".to_string()))
            }),
            "It belongs to lobe \"beckmann\" or \"ggx\", or to highlight \"cook-torrance\".",
        );
        add(
            materials(&|m| {
                let opaque = m.transmission == 0.0 && m.attenuation_color != Color::WHITE;
                opaque.then(|| {
                    ("attenuation_color", "attenuation_color has no effect here".to_string())
                })
            }),
            "It colours light inside of solids: give the material a transmission.",
        );
        add(self.dark_light(), "Leave the light out, or write on = false.");
        add(
            self.objects.is_empty().then(|| (Vec::new(), "there is no object".to_string(), 0)),
            "The picture will show nothing but the background. An object begins with [[object]].",
        );
        add(
            self.is_dark().then(|| {
                (Vec::new(), "there is no light, no ambient and no background".to_string(), 0)
            }),
            "The picture will be black. A light begins with [[light]].",
        );
        problems
    }

    fn dark_light(&self) -> Option<(Vec<String>, String, usize)> {
        let mut dark = self.lights.iter().enumerate().filter(|(_, light)| {
            light.on && (light.intensity == 0.0 || light.color == Color::BLACK)
        });
        let (i, light) = dark.next()?;
        let (key, what) = if light.intensity == 0.0 {
            ("intensity", "intensity is 0")
        } else {
            ("color", "color is black")
        };
        let path = vec!["light".to_string(), i.to_string(), key.to_string()];
        Some((path, format!("{what}, so that it gives no light"), dark.count()))
    }

    fn is_dark(&self) -> bool {
        !self.objects.is_empty()
            && self.lights.is_empty()
            && self.ambient.color == Color::BLACK
            && self.background.color == Color::BLACK
            && !self.materials.values().any(Material::emits)
    }
}

/// Returns a warning if a material may reflect more light than it receives: if the weights of its
/// diffuse, highlight, reflection and transmission parts may add up to more than 1. Otherwise
/// returns `None`. The warning is `(key, phrase)`: the key that it refers to, and a statement of
/// the sum. A Cook-Torrance highlight is the mirror reflection of lights, and the reflection is
/// that of surfaces. Both stand for one physical reflection; only the larger of the two weights is
/// therefore added.
fn brighter_than_its_light(m: &Material) -> Option<(&'static str, String)> {
    let mirrored = match m.highlight {
        Highlight::Phong => m.specular + m.reflection,
        Highlight::CookTorrance => m.specular.max(m.reflection),
    };
    let f0 = m.metal.map(|metal| metal.f0()).or(m.f0).unwrap_or(Color::WHITE).largest();
    let passed = match m.fresnel_mode() {
        // A dielectric reflects the share F of the light and transmits 1 - F. The larger of the two
        // weights is therefore an upper bound.
        Fresnel::Dielectric => mirrored.max(m.transmission),
        _ => mirrored * f0 + m.transmission,
    };
    let sum = m.diffuse * m.color.largest() + passed;
    (sum > 1.0 + 1e-9).then(|| {
        let key = if m.reflection > 0.0 { "reflection" } else { "diffuse" };
        let through =
            if m.transmission > 0.0 { ", reflection and transmission" } else { " and reflection" };
        let found = format!(
            "diffuse x color, specular{through} add up to {}, more than the light that comes in",
            number((sum * 1000.0).round() / 1000.0)
        );
        (key, found)
    })
}
