//! Edit targets: parts of a scene that can be selected and edited.

use crate::value::truncated;
use crate::{Object, Scene};

/// Target of an edit: a part of the scene that can be selected and edited.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    /// Current camera of the scene.
    #[default]
    Camera,
    /// Stored camera, by its name.
    View(String),
    /// Ambient light of the scene.
    Ambient,
    /// Background: the radiance of rays that hit no surface.
    Background,
    /// Light, by its index in the scene's list of lights, counted from 0.
    Light(usize),
    /// Object, by its index in the scene's list of objects, counted from 0.
    Object(usize),
    /// Material, by its name.
    Material(String),
    /// Film settings, such as the size of the picture.
    Film,
    /// Integrator settings, such as the largest number of reflections.
    IntegratorSettings,
}

/// Section of the outline: the list of all editable parts of a scene in the dashboard. An edit has
/// a [`Target`], never a section; sections only group the targets on the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Section {
    /// Section of the outline that lists the current camera and the stored cameras.
    Camera,
    /// Section of the outline that lists the ambient light and the background.
    Surroundings,
    /// Section of the outline that lists all lights of the scene.
    Lights,
    /// Section of the outline that lists the objects of which a part or the whole has a reflecting
    /// material.
    Mirrors,
    /// Section of the outline that lists the objects without a reflecting material.
    Objects,
    /// Section of the outline that lists all materials of the scene.
    Materials,
    /// Section of the outline that lists the settings of film and integrator.
    Picture,
}

impl Section {
    /// Returns the heading of this section in the dashboard's list of all parts of the scene.
    pub fn title(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Surroundings => "surroundings",
            Self::Lights => "lights",
            Self::Mirrors => "mirrors",
            Self::Objects => "objects",
            Self::Materials => "materials",
            Self::Picture => "picture",
        }
    }
}

/// Returns all edit targets of the scene, each once, in the order in which the dashboard lists
/// them. Each is a pair `(section of the list, target)`.
pub fn outline(scene: &Scene) -> Vec<(Section, Target)> {
    let mut list = vec![(Section::Camera, Target::Camera)];
    list.extend(scene.cameras.keys().map(|name| (Section::Camera, Target::View(name.clone()))));
    list.push((Section::Surroundings, Target::Ambient));
    list.push((Section::Surroundings, Target::Background));
    list.extend((0..scene.lights.len()).map(|i| (Section::Lights, Target::Light(i))));
    let (mirrors, others): (Vec<_>, Vec<_>) =
        (0..scene.objects.len()).partition(|i| reflects(scene, *i));
    list.extend(mirrors.into_iter().map(|i| (Section::Mirrors, Target::Object(i))));
    list.extend(others.into_iter().map(|i| (Section::Objects, Target::Object(i))));
    let materials = scene.materials.keys();
    list.extend(materials.map(|name| (Section::Materials, Target::Material(name.clone()))));
    list.push((Section::Picture, Target::Film));
    list.push((Section::Picture, Target::IntegratorSettings));
    list
}

/// Returns `true` if the object at `index`, or a part of it, has a reflecting material.
pub(super) fn reflects(scene: &Scene, index: usize) -> bool {
    mirror_of(scene, index).is_some()
}

/// Returns `(name, coefficient)`: the material with the largest reflection coefficient in the
/// object at `index` and its parts, and this coefficient. Returns `None` if none of its materials
/// reflects.
pub(super) fn mirror_of(scene: &Scene, index: usize) -> Option<(&str, f64)> {
    let names = scene.objects.get(index).map(Object::materials).unwrap_or_default();
    let known =
        names.into_iter().filter_map(|name| Some((name, scene.materials.get(name)?.reflection)));
    known.filter(|(_, k)| *k > 0.0).reduce(|a, b| if b.1 > a.1 { b } else { a })
}

impl Target {
    /// Returns `true` if `scene` contains the light, object, material or stored camera that this
    /// target names. Every scene has the other targets.
    pub fn exists(&self, scene: &Scene) -> bool {
        match self {
            Self::View(name) => scene.cameras.contains_key(name),
            Self::Light(i) => *i < scene.lights.len(),
            Self::Object(i) => *i < scene.objects.len(),
            Self::Material(name) => scene.materials.contains_key(name),
            Self::Camera
            | Self::Ambient
            | Self::Background
            | Self::Film
            | Self::IntegratorSettings => true,
        }
    }

    /// Returns the path of the target in a scene file: keys and list indices (from 0), such as
    /// `object`, `3`.
    pub(super) fn path(&self) -> Vec<String> {
        let keys: &[&str] = match self {
            Self::Camera => &["camera"],
            Self::Ambient => &["ambient"],
            Self::Background => &["background"],
            Self::Film => &["film"],
            Self::IntegratorSettings => &["trace"],
            Self::View(name) => &["cameras", name],
            Self::Material(name) => &["materials", name],
            Self::Light(i) => &["light", &i.to_string()],
            Self::Object(i) => &["object", &i.to_string()],
        };
        keys.iter().map(|key| key.to_string()).collect()
    }

    /// Returns the name of the target in the dashboard's list: `lamp`, `light 2`. An object without
    /// a name is named by its kind and its number among all objects: `sphere 3` is the third
    /// object. Names from files are sanitised and truncated to 40 characters.
    pub fn label(&self, scene: &Scene) -> String {
        let named = |name: Option<&String>| name.filter(|n| !n.is_empty()).map(|n| truncated(n));
        match self {
            Self::View(name) | Self::Material(name) => truncated(name),
            Self::Light(i) => named(scene.lights.get(*i).map(|l| &l.name))
                .unwrap_or_else(|| format!("light {}", i + 1)),
            Self::Object(i) => {
                let object = scene.objects.get(*i);
                let kind = object.map_or("object", |o| o.shape.key());
                named(object.map(|o| &o.name)).unwrap_or_else(|| format!("{kind} {}", i + 1))
            }
            // The other targets are tables, named by their key.
            other => other.path().concat(),
        }
    }

    /// Returns the name of the target in diagnostics: `object "queen"`, `light 2`, `camera`.
    pub fn title(&self, scene: &Scene) -> String {
        scene.subject(&self.path())
    }

    /// Returns the target of a material: that of the object if this target is an object, or this
    /// target itself if it is a material. Returns `None` for other targets, or if the scene does
    /// not have the material.
    pub fn material(&self, scene: &Scene) -> Option<Self> {
        match self {
            Self::Material(_) => self.exists(scene).then(|| self.clone()),
            Self::Object(i) => {
                let name = &scene.objects.get(*i)?.material;
                scene.materials.contains_key(name).then(|| Self::Material(name.clone()))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::built_in;
    use std::collections::HashSet;

    #[test]
    fn outline_lists_every_target_once_in_order() {
        let mut scene = built_in();
        scene.cameras.insert("left".into(), scene.camera.clone());
        let list = outline(&scene);
        let once: HashSet<_> = list.iter().map(|(_, subject)| subject).collect();
        assert_eq!(once.len(), list.len());
        assert!(list.is_sorted_by_key(|(section, _)| *section));
        assert!(list.iter().all(|(_, subject)| subject.exists(&scene)));
        let labels: Vec<_> = list.iter().map(|(_, s)| s.label(&scene)).collect();
        let expected = "camera left ambient background lamp floor mirror ball cube pyramid prism \
                        blue floor green mirror red yellow film trace";
        assert_eq!(labels.join(" "), expected);
    }

    #[test]
    fn targets_exist_and_have_materials() {
        let scene = built_in();
        assert!(!Target::Object(6).exists(&scene) && !Target::View("x".into()).exists(&scene));
        assert_eq!(Target::Object(2).material(&scene), Some(Target::Material("red".into())));
        assert_eq!(Target::Camera.material(&scene), None);
    }
}
