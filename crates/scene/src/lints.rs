//! Lints: legal values of a scene that are probably mistakes.

#![cfg_attr(not(test), deny(clippy::wildcard_enum_match_arm))]

use crate::Scene;
use crate::light::Light;
use crate::material::{Fresnel, Highlight, Material};
use crate::validate::Problem;
use crate::value::{Color, number};
use std::collections::HashSet;
use std::sync::Arc;

/// Path of a doubtful value, and a phrase such as `alpha has no effect here`.
type Case = (Vec<String>, String);

/// Key of a doubtful value of a material, and a phrase that states the problem.
type MaterialLint = fn(&Material) -> Option<(&'static str, String)>;

/// Lints of materials, each with the help text of its warning.
const MATERIAL_LINTS: [(MaterialLint, &str); 3] = [
    (brighter_than_its_light, "Allowed: the picture is clipped only for display."),
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

    /// Returns what the readers of mesh files left out or replaced: the path of a key that names
    /// the file, and a phrase with the name of the file.
    pub fn file_notes(&self) -> Vec<(Vec<String>, String)> {
        let mut known = HashSet::new();
        let objects = self.objects.iter().enumerate().filter_map(|(i, object)| {
            let mesh = object.shape.mesh()?;
            let notes = known.insert(Arc::as_ptr(mesh)).then_some(&mesh.mesh.notes)?;
            let path = ["object", &i.to_string(), "shape", "mesh", "file"].map(str::to_string);
            Some((path.to_vec(), object.shape.file()?, notes))
        });
        let note = |(path, file, notes): (Vec<String>, &str, &Vec<String>)| {
            let note = |note: &String| (path.clone(), format!("\"{file}\": {note}"));
            notes.iter().map(note).collect::<Vec<_>>()
        };
        objects.flat_map(note).collect()
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
    let f0 = m.metal.map(|metal| metal.f0()).or(m.f0).unwrap_or(Color::WHITE).largest();
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
    use std::sync::Arc;

    #[test]
    fn notes_of_mesh_readers_are_warnings_of_the_first_object() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
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
}
