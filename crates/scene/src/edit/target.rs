//! Edit targets: parts of a scene that can be selected and edited.

use crate::edit::compound::operand;
use crate::edit::part::part;
use crate::value::truncated;
use crate::{Object, Scene};

/// Target of an edit: a part of the scene that can be selected and edited.
#[allow(missing_docs, reason = "the names say it")]
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    /// Current camera.
    #[default]
    Camera,
    /// Stored camera, by its name.
    View(String),
    /// Light group, by its name.
    Group(String),
    /// Light, by its index.
    Light(usize),
    /// Object, by its index.
    Object(usize),
    /// Part of a compound: the index of the object, and that of the part in each compound, the
    /// outermost first.
    Part(usize, Vec<usize>),
    /// Material, by its name.
    Material(String),
    Settings(SceneSettings),
}

/// Table of settings, which every scene has exactly once.
#[allow(missing_docs, reason = "the names say it")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum SceneSettings {
    Ambient,
    Background,
    Film,
    Integrator,
}

/// Section of the outline of all targets.
#[allow(missing_docs, reason = "the names say it")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Section {
    Camera,
    Surroundings,
    Lights,
    Objects,
    Materials,
    Picture,
}

impl Section {
    /// Returns the heading of the section.
    pub fn title(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Surroundings => "surroundings",
            Self::Lights => "lights",
            Self::Objects => "objects",
            Self::Materials => "materials",
            Self::Picture => "picture",
        }
    }
}

/// Returns all targets, each once, with their sections, in the order of the dashboard's list, which is that of the file.
pub fn outline(scene: &Scene) -> Vec<(Section, Target)> {
    let mut list = vec![(Section::Camera, Target::Camera)];
    list.extend(scene.cameras.keys().map(|name| (Section::Camera, Target::View(name.clone()))));
    list.push((Section::Surroundings, Target::Settings(SceneSettings::Ambient)));
    list.push((Section::Surroundings, Target::Settings(SceneSettings::Background)));
    list.extend(scene.groups.keys().map(|name| (Section::Lights, Target::Group(name.clone()))));
    list.extend((0..scene.lights.len()).map(|i| (Section::Lights, Target::Light(i))));
    (0..scene.objects.len()).for_each(|i| add_tree(scene, Target::Object(i), &mut list));
    let materials = scene.materials.keys();
    list.extend(materials.map(|name| (Section::Materials, Target::Material(name.clone()))));
    list.push((Section::Picture, Target::Settings(SceneSettings::Film)));
    list.push((Section::Picture, Target::Settings(SceneSettings::Integrator)));
    list
}

/// Adds an object or a part, and the parts of it.
fn add_tree(scene: &Scene, target: Target, list: &mut Vec<(Section, Target)>) {
    let parts = target.parts(scene);
    list.push((Section::Objects, target));
    parts.into_iter().for_each(|part| add_tree(scene, part, list));
}

/// Returns the material that reflects most at normal incidence among those of `objects` and their
/// parts; `None` if none reflects.
pub(super) fn mirror_of<'a>(scene: &'a Scene, objects: &'a [Object]) -> Option<&'a str> {
    let names = objects.iter().flat_map(Object::materials);
    let known = names.filter_map(|name| {
        let material = scene.materials.get(name)?;
        Some((name, material.reflection * material.f0().0.into_iter().fold(0.0, f64::max)))
    });
    let reflecting = known.filter(|(_, k)| *k > 0.0);
    reflecting.reduce(|a, b| if b.1 > a.1 { b } else { a }).map(|(name, _)| name)
}

impl Target {
    /// Returns `true` if `scene` has the target.
    pub fn exists(&self, scene: &Scene) -> bool {
        part(scene, self).is_ok()
    }

    /// Returns the path of the target in a scene: keys and list indices, such as `object`, `3`.
    pub(super) fn path(&self) -> Vec<String> {
        let keys: &[&str] = match self {
            Self::Camera => &["camera"],
            Self::Settings(SceneSettings::Ambient) => &["ambient"],
            Self::Settings(SceneSettings::Background) => &["background"],
            Self::Settings(SceneSettings::Film) => &["film"],
            Self::Settings(SceneSettings::Integrator) => &["trace"],
            Self::View(name) => &["cameras", name],
            Self::Material(name) => &["materials", name],
            Self::Group(name) => &["groups", name],
            Self::Light(i) => &["light", &i.to_string()],
            Self::Object(i) | Self::Part(i, _) => &["object", &i.to_string()],
        };
        keys.iter().map(|key| key.to_string()).collect()
    }

    /// Returns the name in the dashboard's list: `lamp`, `light 2`, or `sphere 3` for the third
    /// object.
    pub fn label(&self, scene: &Scene) -> String {
        let named = |name: Option<&String>| name.filter(|n| !n.is_empty()).map(|n| truncated(n));
        match self {
            Self::View(name) | Self::Material(name) | Self::Group(name) => truncated(name),
            Self::Light(i) => named(scene.lights.get(*i).map(|l| &l.name))
                .unwrap_or_else(|| format!("light {}", i + 1)),
            Self::Object(i) => {
                let object = scene.objects.get(*i);
                let kind = object.map_or("object", |o| o.shape.key());
                named(object.map(|o| &o.name)).unwrap_or_else(|| format!("{kind} {}", i + 1))
            }
            Self::Part(i, path) => {
                let part = operand(scene, *i, path);
                let kind = part.map_or("part", |part| part.shape.key());
                let number = path.last().map_or(0, |i| i + 1);
                named(part.map(|part| &part.name))
                    .unwrap_or_else(|| format!("{} {number}", kind.replace('_', " ")))
            }
            // These targets are tables, named by their key.
            Self::Camera | Self::Settings(_) => self.path().concat(),
        }
    }

    /// Returns the name of the target in diagnostics: `object "queen"`, `light 2`, `camera`.
    pub fn title(&self, scene: &Scene) -> String {
        match self.compound() {
            Some(compound) => format!("{} of {}", self.label(scene), compound.title(scene)),
            None => scene.subject(&self.path()),
        }
    }

    /// Returns the name of the light group of the light, emissive material or surroundings; `None`
    /// for other targets.
    pub fn light_group(&self, scene: &Scene) -> Option<String> {
        let named =
            |group: &String, own: String| if group.is_empty() { own } else { group.clone() };
        match self {
            Self::Group(name) => Some(name.clone()),
            Self::Light(i) => Some(named(&scene.lights.get(*i)?.group, self.label(scene))),
            Self::Settings(SceneSettings::Ambient | SceneSettings::Background) => {
                Some(self.label(scene))
            }
            Self::Object(_) | Self::Part(..) | Self::Material(_) => {
                let Self::Material(name) = self.material(scene)? else { return None };
                let material = scene.materials.get(&name).filter(|material| material.emits())?;
                Some(named(&material.group, name))
            }
            Self::Camera | Self::View(_) | Self::Settings(_) => None,
        }
    }

    /// Returns this target if it is a material, or the material of this object or part. Returns `None`
    /// for other targets, and if the scene does not have the material.
    pub fn material(&self, scene: &Scene) -> Option<Self> {
        let name = match self {
            Self::Material(name) => name.as_str(),
            Self::Object(i) => &scene.objects.get(*i)?.material,
            Self::Part(i, path) => match operand(scene, *i, path)?.material.as_str() {
                "" => return self.compound()?.material(scene),
                name => name,
            },
            Self::Camera | Self::View(_) | Self::Group(_) | Self::Light(_) | Self::Settings(_) => {
                return None;
            }
        };
        scene.materials.contains_key(name).then(|| Self::Material(name.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mirror_room;
    use std::collections::HashSet;

    #[test]
    fn outline_lists_every_target_once_in_order() {
        let mut scene = mirror_room();
        scene.cameras.insert("left".into(), scene.camera.clone());
        let list = outline(&scene);
        let once: HashSet<_> = list.iter().map(|(_, target)| target).collect();
        assert_eq!(once.len(), list.len());
        assert!(list.is_sorted_by_key(|(section, _)| *section));
        assert!(list.iter().all(|(_, target)| target.exists(&scene)));
        let labels: Vec<_> = list.iter().map(|(_, s)| s.label(&scene)).collect();
        let expected = "camera left ambient background lamp floor mirror ball cube pyramid prism \
                        blue floor green mirror red yellow film trace";
        assert_eq!(labels.join(" "), expected);
    }

    #[test]
    fn targets_exist_and_have_materials() {
        let scene = mirror_room();
        assert!(!Target::Object(6).exists(&scene) && !Target::View("x".into()).exists(&scene));
        assert_eq!(Target::Object(2).material(&scene), Some(Target::Material("red".into())));
        assert_eq!(Target::Camera.material(&scene), None);
    }
}
