//! Semantic validation of a scene: values out of range, names that are undefined or not unique.

use crate::material::Mapping;
use crate::scene::Scene;
use crate::scene::format::suggest::nearest;
use crate::value::{ValidationError, truncated};
use std::collections::HashMap;
use std::fmt;

/// An error or a warning about a scene, without file and line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path to the value, which consists of keys and list indices (from 0): `object`, `3`, `shape`,
    /// `sphere`.
    pub path: Vec<String>,
    /// Table that the problem is about: `object "queen"`. Empty for the scene as a whole.
    pub subject: String,
    /// Finding, as a phrase.
    pub found: String,
    /// Remedy, in sentences.
    pub help: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        use crate::value::sanitized;
        if !self.subject.is_empty() {
            write!(f, "{}: ", sanitized(&self.subject))?;
        }
        write!(f, "{}. {}", sanitized(&self.found), sanitized(&self.help))
    }
}

/// Returns the name that diagnostics use for the table at `path`: `object "queen"`, `light 2`.
/// `name` returns the name of a list entry, if it has one.
pub(super) fn subject(path: &[String], name: impl Fn(&str, usize) -> Option<String>) -> String {
    match path {
        [list, index, ..] if list == "object" || list == "light" => {
            let index: usize = index.parse().unwrap_or(0);
            match name(list, index).filter(|n| !n.is_empty()) {
                Some(name) => format!("{list} \"{}\"", truncated(&name)),
                None => format!("{list} {}", index + 1),
            }
        }
        [list, name, ..] if list == "materials" => format!("material \"{}\"", truncated(name)),
        [list, name, ..] if list == "cameras" => format!("camera \"{}\"", truncated(name)),
        [first, ..] => first.clone(),
        [] => String::new(),
    }
}

fn keys(parts: &[&str]) -> Vec<String> {
    parts.iter().map(|p| p.to_string()).collect()
}

impl Scene {
    /// Returns the name that diagnostics use for the table at `path`.
    pub(super) fn subject(&self, path: &[String]) -> String {
        subject(path, |list, index| match list {
            "object" => self.objects.get(index).map(|o| o.name.clone()),
            _ => self.lights.get(index).map(|l| l.name.clone()),
        })
    }

    pub(super) fn problem(&self, path: &[&str], found: String, help: String) -> Problem {
        let path = keys(path);
        Problem { subject: self.subject(&path), path, found, help }
    }

    /// Loads the files that the scene refers to, unless they are loaded already. The next
    /// validation reports the files that cannot be read.
    pub fn resolve(&mut self) {
        let resolver = &self.resolver;
        for object in &mut self.objects {
            object.shape.resolve(|name| resolver.mesh(name));
        }
        for material in self.materials.values_mut() {
            material.resolve(|name| resolver.image(name));
        }
    }

    /// Returns all validation errors of the scene. A scene that was read from a file has none; an
    /// edited scene may have some.
    pub fn faults(&self) -> Vec<Problem> {
        let mut problems = Vec::new();
        let mut add = |path: &[&str], faults: Vec<ValidationError>| {
            problems.extend(faults.into_iter().map(|fault| {
                let mut all = path.to_vec();
                all.extend(fault.key.split('.').filter(|k| !k.is_empty()));
                self.problem(&all, fault.found, format!("Expected {}.", fault.expected))
            }));
        };
        add(&["film"], self.film.faults());
        add(&["trace"], self.trace.faults());
        add(&["camera"], self.camera.faults());
        for (name, view) in &self.cameras {
            add(&["cameras", name], view.faults());
        }
        add(&["background"], self.background.faults());
        add(&["ambient"], self.ambient.faults());
        for (i, light) in self.lights.iter().enumerate() {
            add(&["light", &i.to_string()], light.faults());
        }
        for (name, material) in &self.materials {
            add(&["materials", name], material.faults());
        }
        for (i, object) in self.objects.iter().enumerate() {
            add(&["object", &i.to_string()], object.faults());
        }
        if problems.is_empty() {
            self.missing_coordinates(&mut problems);
        }
        self.missing_materials(&mut problems);
        self.same_names("light", self.lights.iter().map(|l| &l.name), &mut problems);
        self.same_names("object", self.objects.iter().map(|o| &o.name), &mut problems);
        problems
    }

    /// Adds a problem for each material whose textures need coordinates that the object's shape
    /// does not have. The shapes must be valid.
    fn missing_coordinates(&self, problems: &mut Vec<Problem>) {
        let uv_key = |name: &str| {
            let material = self.materials.get(name)?;
            let texture = material.texture.as_ref().map(|t| t.placement().mapping);
            let bump = material.bump.as_ref().map(|b| b.placement().mapping);
            (texture == Some(Mapping::Uv))
                .then_some("texture")
                .or((bump == Some(Mapping::Uv)).then_some("bump"))
        };
        for (i, object) in self.objects.iter().enumerate() {
            let materials = object.shape.part_materials(&object.material);
            let uv_keys: Vec<_> = materials.iter().map(|name| uv_key(name)).collect();
            if uv_keys.iter().all(Option::is_none) {
                continue;
            }
            let spaces = object.shape.texture_spaces();
            let lacks_uv = |k: &usize| uv_keys[*k].is_some() && !spaces[*k].has_uv();
            let Some(part) = (0..spaces.len()).find(lacks_uv) else { continue };
            let what = match object.shape.file() {
                Some(file) => format!("there are none in \"{}\"", truncated(file)),
                None if spaces.len() > 1 => format!("parts of a {} have none", object.shape.key()),
                None => format!("a {} has none", object.shape.key()),
            };
            let found = format!(
                "the {} of material \"{}\" needs texture coordinates (mapping = \"uv\"), and {what}",
                uv_keys[part].unwrap_or_default(),
                truncated(materials[part]),
            );
            let help =
                "Expected a mesh whose file has them, a rectangle or a platform. On other shapes \
                        another mapping works: \"auto\" takes the one that suits the shape."
                    .to_string();
            problems.push(self.problem(&["object", &i.to_string(), "material"], found, help));
        }
    }

    fn missing_materials(&self, problems: &mut Vec<Problem>) {
        let mut named = Vec::new();
        for (i, object) in self.objects.iter().enumerate() {
            named.push((format!("object.{i}.material"), object.material.as_str()));
            let parts = object.shape.named_materials().into_iter();
            named.extend(parts.map(|(key, name)| (format!("object.{i}.shape.{key}"), name)));
        }
        for (key, name) in named {
            if name.is_empty() || self.materials.contains_key(name) {
                continue;
            }
            let defined: Vec<_> =
                self.materials.keys().take(20).map(|n| format!("\"{}\"", truncated(n))).collect();
            let mut help = match defined.as_slice() {
                [] => "No material is defined; one begins with [materials.NAME].".to_string(),
                names if names.len() < self.materials.len() => {
                    format!("Defined: {}, and more.", names.join(", "))
                }
                names => format!("Defined: {}.", names.join(", ")),
            };
            let known = self.materials.keys().map(String::as_str);
            if let Some(meant) = nearest(name, known) {
                help += &format!(" Did you mean \"{}\"?", truncated(meant));
            }
            let found = format!("material \"{}\" is not defined", truncated(name));
            problems.push(self.problem(&key.split('.').collect::<Vec<_>>(), found, help));
        }
    }

    fn same_names<'a>(
        &self,
        list: &str,
        names: impl Iterator<Item = &'a String>,
        problems: &mut Vec<Problem>,
    ) {
        let mut first = HashMap::new();
        for (i, name) in names.enumerate().filter(|(_, name)| !name.is_empty()) {
            if let Some(other) = first.get(name) {
                let found = format!("{list} {} has the same name", other + 1);
                let help = "Expected a name of its own, or none.".to_string();
                problems.push(self.problem(&[list, &i.to_string(), "name"], found, help));
            } else {
                first.insert(name, i);
            }
        }
    }
}
