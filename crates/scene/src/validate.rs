//! Semantic validation of a scene: values out of range, names that are undefined or not unique.

use crate::Scene;
use crate::asset::{AssetKind, Assets};
use crate::diagnostic::MAX_REPORTED;
use crate::light::Light;
use crate::material::Mapping;
use crate::value::{KeyNode, ValidationError, did_you_mean, truncated};
use std::borrow::Cow;
use std::cell::LazyCell;
use std::collections::HashMap;
use std::fmt;

/// Problem of a scene (error or warning), without file and line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path to the value: keys and list indices, such as `object`, `3`, `shape`, `sphere`.
    pub path: Vec<String>,
    /// Table that the problem is about, such as `object "queen"`. Empty for the scene as a whole.
    pub subject: String,
    /// Phrase that states the problem, such as `radius is -1`.
    pub found: String,
    /// Expected value and remedy, in sentences.
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
/// `name(list, index)` returns the name that the user gave to an entry of a list.
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
        [list, name, ..] if list == "groups" => format!("group \"{}\"", truncated(name)),
        [first, ..] => first.clone(),
        [] => String::new(),
    }
}

/// Collector of the first [`MAX_REPORTED`] problems of a scene.
struct Problems<'a> {
    scene: &'a Scene,
    found: Vec<Problem>,
    /// Number of problems found after the first [`MAX_REPORTED`]. They are counted but not stored.
    more: usize,
}

impl Problems<'_> {
    /// Adds a problem of the value at `path`. `make` returns its fields `found` and `help`.
    fn report(&mut self, path: &[&str], make: impl FnOnce() -> (String, String)) {
        if self.found.len() < MAX_REPORTED {
            let (found, help) = make();
            self.found.push(self.scene.problem(path, found, help));
        } else {
            self.more += 1;
        }
    }

    /// Adds the validation errors `errors` of the scene's table at `path`.
    fn add(&mut self, path: &[&str], errors: Vec<ValidationError>) {
        for error in errors {
            let mut all = path.to_vec();
            all.extend(error.key.split('.').filter(|k| !k.is_empty()));
            self.report(&all, || (error.found, format!("Expected {}.", error.expected)));
        }
    }
}

impl Scene {
    /// Returns the name that diagnostics use for the table at `path`: `object "queen"`, `light 2`.
    pub(super) fn subject(&self, path: &[String]) -> String {
        subject(path, |list, index| match list {
            "object" => self.objects.get(index).map(|o| o.name.clone()),
            _ => self.lights.get(index).map(|l| l.name.clone()),
        })
    }

    pub(super) fn problem(&self, path: &[&str], found: String, help: String) -> Problem {
        let path: Vec<String> = path.iter().map(|key| key.to_string()).collect();
        Problem { subject: self.subject(&path), path, found, help }
    }

    /// Returns the names of the files that the scene refers to.
    pub(super) fn files(&self) -> impl Iterator<Item = (AssetKind, &str)> {
        let meshes = self.objects.iter().filter_map(|object| object.shape.file());
        let images = self.materials.values().flat_map(|material| material.image_files());
        let environments = self.lights.iter().filter_map(|light| light.environment()?.file());
        meshes
            .map(|name| (AssetKind::Mesh, name))
            .chain(images.map(|(_, name, _)| (AssetKind::Texture, name)))
            .chain(environments.map(|name| (AssetKind::Environment, name)))
    }

    /// Loads the files that the scene refers to and that are not loaded yet, if they fit into memory
    /// together. Unreadable files are errors in the next validation. Adds the light groups that lights
    /// and materials name.
    pub fn resolve(&mut self) {
        let of_lights = self.lights.iter().map(|light| &light.group);
        let named = of_lights.chain(self.materials.values().map(|material| &material.group));
        for name in named.filter(|name| !name.is_empty()) {
            self.groups.entry(name.clone()).or_default();
        }
        let resolver = self.resolver.clone();
        let files: Vec<_> = self.files().map(|(kind, name)| (kind, resolver.path(name))).collect();
        let refused = LazyCell::new(|| resolver.assets.check_total_memory(&files).err());
        for object in &mut self.objects {
            object.shape.resolve(|name| resolver.load(name, refused.as_ref(), Assets::mesh));
        }
        for light in self.lights.iter_mut().filter_map(Light::environment_mut) {
            light.resolve(|name| resolver.load(name, refused.as_ref(), Assets::radiance_map));
        }
        for material in self.materials.values_mut() {
            material.resolve(|name| resolver.load(name, refused.as_ref(), Assets::image));
        }
    }

    /// Returns the first 100 validation errors.
    pub fn faults(&self) -> Vec<Problem> {
        self.check().0
    }

    /// Returns [`Scene::faults`] and the number of further errors.
    pub(super) fn check(&self) -> (Vec<Problem>, usize) {
        let mut problems = Problems { scene: self, found: Vec::new(), more: 0 };
        problems.add(&["film"], self.film.validator().errors());
        problems.add(&["trace"], self.trace.validator().errors());
        problems.add(&["camera"], self.camera.faults());
        for (name, view) in &self.cameras {
            problems.add(&["cameras", name], view.faults());
        }
        problems.add(&["background"], self.background.validator().errors());
        problems.add(&["ambient"], self.ambient.validator().errors());
        for (name, group) in &self.groups {
            problems.add(&["groups", name], group.validator().errors());
        }
        for (i, light) in self.lights.iter().enumerate() {
            problems.add(&["light", &i.to_string()], light.faults());
        }
        for (name, material) in &self.materials {
            problems.add(&["materials", name], material.faults());
        }
        for (i, object) in self.objects.iter().enumerate() {
            problems.add(&["object", &i.to_string()], object.faults());
        }
        if problems.found.is_empty() {
            self.missing_coordinates(&mut problems);
        }
        self.missing_materials(&mut problems);
        self.same_names("light", self.lights.iter().map(|l| &l.name), &mut problems);
        self.same_names("object", self.objects.iter().map(|o| &o.name), &mut problems);
        (problems.found, problems.more)
    }

    /// Adds a problem for each valid object with a part whose material needs texture coordinates
    /// (`mapping = "uv"`) that its shape does not have.
    fn missing_coordinates(&self, problems: &mut Problems) {
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
            let kind = object.shape.key();
            let what = match object.shape.file() {
                Some(file) => format!("there are none in \"{}\"", truncated(file)),
                None if spaces.len() > 1 => format!("parts of a {kind} have none"),
                None => format!("a {kind} has none"),
            };
            let found = || {
                format!(
                    "the {} of material \"{}\" needs texture coordinates (mapping = \"uv\"), and \
                     {what}",
                    uv_keys[part].unwrap_or_default(),
                    truncated(materials[part]),
                )
            };
            let help = "Expected a mesh whose file has them, a rectangle or a platform. On other \
                        shapes another mapping works: \"auto\" takes the one that suits the shape.";
            let path = ["object", &i.to_string(), "material"];
            problems.report(&path, || (found(), help.to_string()));
        }
    }

    /// Adds a problem for each material that an object or a part names and that is not defined.
    fn missing_materials(&self, problems: &mut Problems) {
        let is_missing = |name: &str| !name.is_empty() && !self.materials.contains_key(name);
        for (i, object) in self.objects.iter().enumerate() {
            let whole = (Cow::from("material"), object.material.as_str());
            let parts = object.shape.named_materials().into_iter();
            let parts = parts.map(|(key, name)| (Cow::from(format!("shape.{key}")), name));
            for (key, name) in [whole].into_iter().chain(parts).filter(|(_, name)| is_missing(name))
            {
                let index = i.to_string();
                let path: Vec<_> = ["object", &index].into_iter().chain(key.split('.')).collect();
                problems.report(&path, || self.missing_material(name));
            }
        }
    }

    /// Returns phrase and help of the problem that the material `name` is not defined.
    fn missing_material(&self, name: &str) -> (String, String) {
        let defined: Vec<_> =
            self.materials.keys().take(20).map(|n| format!("\"{}\"", truncated(n))).collect();
        let help = match defined.as_slice() {
            [] => "No material is defined; one begins with [materials.NAME].".to_string(),
            names if names.len() < self.materials.len() => {
                format!("Defined: {}, and more.", names.join(", "))
            }
            names => format!("Defined: {}.", names.join(", ")),
        };
        let meant = did_you_mean(name, self.materials.keys().map(String::as_str));
        (format!("material \"{}\" is not defined", truncated(name)), help + &meant)
    }

    /// Adds a problem for each entry of the list `list` that has the name of an earlier entry.
    fn same_names<'a>(
        &self,
        list: &str,
        names: impl Iterator<Item = &'a String>,
        problems: &mut Problems,
    ) {
        let mut first = HashMap::new();
        for (i, name) in names.enumerate().filter(|(_, name)| !name.is_empty()) {
            if let Some(other) = first.get(name) {
                let found = || format!("{list} {} has the same name", other + 1);
                let help = "Expected a name of its own, or none.".to_string();
                problems.report(&[list, &i.to_string(), "name"], || (found(), help));
            } else {
                first.insert(name, i);
            }
        }
    }
}
