//! Lints: legal values of a scene that are probably mistakes.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

use crate::Scene;
use crate::light::Light;
use crate::material::{Fresnel, Highlight, METAL_REMEDY, Material};
use crate::validate::Problem;
use crate::value::{Color, number};
use std::collections::HashSet;

/// Path of a doubtful value, and a phrase such as `alpha has no effect here`.
type Case = (Vec<String>, String);

/// Key of a doubtful value of a material, and a phrase that states the problem.
type MaterialLint = fn(&Material) -> Option<(&'static str, String)>;

/// Lints of materials, each with the help text of its warning.
const MATERIAL_LINTS: [(MaterialLint, &str); 4] = [
    (brighter_than_its_light, "Allowed: the picture is clipped only for display."),
    (|m| without_effect("metal", m.metal.is_some() && !m.shows_f0()), METAL_REMEDY),
    (
        |m| without_effect("alpha", m.alpha.is_some() && !m.has_microfacets()),
        "It belongs to lobe \"beckmann\" or \"ggx\", or to highlight \"cook-torrance\".",
    ),
    (
        |m| {
            let is_opaque = m.transmission == 0.0;
            without_effect("attenuation_color", is_opaque && m.attenuation_color != Color::WHITE)
        },
        "It colours light inside of solids: give the material a transmission.",
    ),
];

fn without_effect(key: &'static str, is_found: bool) -> Option<(&'static str, String)> {
    is_found.then(|| (key, format!("{key} has no effect here")))
}

impl Scene {
    /// Returns one warning for each kind of doubtful value that the scene has. It describes the
    /// first such value and gives the number of the others.
    pub fn warnings(&self) -> Vec<Problem> {
        let mut problems = Vec::new();
        let mut add = |help: &str, cases: &mut dyn Iterator<Item = Case>| {
            let Some((path, found)) = cases.next() else { return };
            let path: Vec<&str> = path.iter().map(String::as_str).collect();
            let more = match cases.count() {
                0 => String::new(),
                1 => " (and one more like it)".to_string(),
                n => format!(" (and {n} more like it)"),
            };
            problems.push(self.problem(&path, found + &more, help.to_string()));
        };
        for (lint, help) in MATERIAL_LINTS {
            let case = |(name, material): (&String, &Material)| {
                let (key, found) = lint(material)?;
                Some((vec!["materials".to_string(), name.clone(), key.to_string()], found))
            };
            add(help, &mut self.materials.iter().filter_map(case));
        }
        let dark = |(i, light): (usize, &Light)| {
            let (key, what) = match light {
                light if light.intensity == 0.0 => ("intensity", "intensity is 0"),
                light if light.color == Color::BLACK => ("color", "color is black"),
                _ => return None,
            };
            let path = vec!["light".to_string(), i.to_string(), key.to_string()];
            light.on.then(|| (path, format!("{what}, so that it gives no light")))
        };
        let dark = &mut self.lights.iter().enumerate().filter_map(dark);
        add("Leave the light out, or write on = false.", dark);
        if self.objects.is_empty() {
            let help = "The picture will show nothing but the background. An object begins with [[object]].";
            problems.push(self.problem(&[], "there is no object".into(), help.into()));
        } else if self.lights.is_empty()
            && self.ambient.color == Color::BLACK
            && self.background.color == Color::BLACK
            && !self.materials.values().any(Material::emits)
        {
            let found = "there is no light, no ambient and no background";
            let help = "The picture will be black. A light begins with [[light]].";
            problems.push(self.problem(&[], found.into(), help.into()));
        }
        for (path, note) in self.file_notes() {
            let path: Vec<&str> = path.iter().map(String::as_str).collect();
            problems.push(self.problem(&path, note, String::new()));
        }
        problems
    }

    /// Returns what the readers of meshes and images left out or replaced: the path of a key that
    /// names the file, and a phrase with the name of the file.
    pub fn file_notes(&self) -> Vec<(Vec<String>, String)> {
        let (mut known, mut out) = (HashSet::new(), Vec::new());
        let mut add = |path: &[&str], file: &str, notes: &[String]| {
            for note in notes.iter().map(|note| format!("\"{file}\": {note}")) {
                if known.insert(note.clone()) {
                    out.push((path.iter().map(|key| key.to_string()).collect(), note));
                }
            }
        };
        for (i, object) in self.objects.iter().enumerate() {
            if let (Some(file), Some(mesh)) = (object.shape.file(), object.shape.mesh()) {
                let path = ["object", &i.to_string(), "shape", "mesh", "file"];
                add(&path, file, &mesh.mesh.notes);
            }
        }
        for (i, environment) in self.lights.iter().map(Light::environment).enumerate() {
            if let Some((file, map)) = environment.and_then(|sky| sky.file().zip(sky.map())) {
                add(&["light", &i.to_string(), "environment", "file"], file, &map.notes);
            }
        }
        for (name, material) in &self.materials {
            for (key, file, image) in material.image_files() {
                let notes = image.map_or(&[][..], |image| &image.notes);
                add(&["materials", name, key, "image", "file"], file, notes);
            }
        }
        out
    }
}

/// Returns a warning if a material may reflect more light than it receives. With a Cook-Torrance
/// highlight, `specular` and `reflection` are weights of one physical reflection (of lights and of
/// surfaces), so that only the larger one counts.
fn brighter_than_its_light(m: &Material) -> Option<(&'static str, String)> {
    let mirrored = match m.highlight {
        Highlight::Phong => m.specular + m.reflection,
        Highlight::CookTorrance => m.specular.max(m.reflection),
    };
    let f0 = m.f0().largest();
    let passed = match m.fresnel_mode() {
        // A dielectric reflects the share F and transmits 1 - F: the larger weight bounds the sum.
        Fresnel::Dielectric => mirrored.max(m.transmission),
        Fresnel::Constant | Fresnel::Schlick | Fresnel::Exact => mirrored * f0 + m.transmission,
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

#[cfg(test)]
mod tests {
    use crate::Document;
    use crate::asset::Assets;
    use std::fs;
    use std::sync::Arc;

    #[test]
    fn notes_of_mesh_readers_are_warnings_of_the_first_object() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            path
        };
        write("a.obj", "mtllib none.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\nl 2 3\n");
        let object = "[[object]]\nshape.mesh = { file = \"a.obj\" }\n";
        let text = format!("ambient.color = [1, 1, 1]\n{object}{object}");
        let document =
            Document::read(&write("s.toml", &text), Arc::new(Assets::default())).unwrap();
        let warnings: Vec<_> = document.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        assert!(warnings[0].contains("s.toml:3:23") && warnings[0].contains("none.mtl"));
        let lines = "\"a.obj\": points and lines were left out (2 times)";
        assert!(warnings[1].contains(lines), "{warnings:?}");
    }

    #[test]
    fn notes_of_image_readers_are_warnings_of_the_first_use() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).unwrap();
            path
        };
        // The largest exponent with the largest mantissas is above 1e15.
        write("sky.hdr", b"#?RGBE\n\n-Y 1 +X 2\n\xff\xff\xff\xff\x80\x80\x80\x80");
        let jpeg = include_bytes!("../../../tests/images/grey.jpg");
        write("cut.jpg", &[&jpeg[..jpeg.len() - 60], &[0; 4000]].concat());
        let text = "[[light]]\nenvironment.file = \"sky.hdr\"\n\
                    [materials.a]\ntexture.image.file = \"cut.jpg\"\n\
                    [materials.b]\nbump.image.file = \"cut.jpg\"\n\
                    [[object]]\nmaterial = \"a\"\nshape.cube = { corner = [0, 0, 0], edge = 1 }\n";
        let path = write("s.toml", text.as_bytes());
        let document = Document::read(&path, Default::default()).unwrap();
        let warnings: Vec<_> = document.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(warnings.len(), 2, "{warnings:?}");
        let sky =
            "\"sky.hdr\": pixels that are infinite or above 1e15, taken as 65504: 1, the first";
        assert!(warnings[0].contains("s.toml:2:20") && warnings[0].contains(sky), "{warnings:?}");
        let cut = "\"cut.jpg\": the file has no end";
        assert!(warnings[1].contains("s.toml:4:22") && warnings[1].contains(cut), "{warnings:?}");
    }
}
