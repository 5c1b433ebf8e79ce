//! Scene as the user describes it: editable, in double precision, with validation.
//!
//! The scene of a [`Document`] or an [`edit::Edit`] has been validated. Any other [`Scene`] may be
//! invalid, because its fields are public: a render session validates the scene that it is given.

#[cfg(not(unix))]
compile_error!("zerkalo needs a Unix system (Linux, macOS, BSD): it uses POSIX file locks.");

pub mod asset;
pub mod camera;
pub mod disk;
pub mod light;
pub mod material;
pub mod process_memory;
pub mod shape;
pub mod value;

mod asset_resolver;
mod contents_hash;
mod diagnostic;
mod document;
pub mod edit;
mod file;
mod format;
mod history;
mod lints;
mod object;
mod recovery;
mod settings;
mod validate;

pub use crate::format::TomlText;
pub use crate::format::schema::FIELDS;
pub use crate::shape::{Rotate, Scale, TransformOp};
pub use asset_resolver::AssetResolver;
pub use diagnostic::{Diagnostic, SceneErrors};
pub use document::Document;
pub use file::{DiskState, SaveError, SceneFile};
pub use history::History;
pub use object::Object;
pub use recovery::{Orphan, Recovery, RecoveryFile, state_folder};
pub use settings::{
    Acceleration, Ambient, Background, BelowHorizon, FilmSettings, Filter, IntegratorSettings,
    RayTypes, Tone,
};
pub use validate::Problem;

use crate::camera::Camera;
use crate::light::{Light, LightGroup};
use crate::material::Material;
use crate::value::{FieldValue, KeyNode, ValueType, children};
use std::collections::BTreeMap;

/// Description of a whole scene. [`Scene::faults`] checks it.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Film settings: size, pixel filter, sample limit.
    pub film: FilmSettings,
    /// Integrator settings: kinds of rays, limits of paths, acceleration structure.
    pub trace: IntegratorSettings,
    /// Current camera of the scene.
    pub camera: Camera,
    /// Stored cameras, by name.
    pub cameras: BTreeMap<String, Camera>,
    /// Radiance of rays that hit no surface.
    pub background: Background,
    /// Ambient light: uniform, without shadows.
    pub ambient: Ambient,
    /// Mixes of light groups, by name.
    pub groups: BTreeMap<String, LightGroup>,
    /// Lights of the scene, in the order of the file.
    pub lights: Vec<Light>,
    /// Materials of the scene, by name.
    pub materials: BTreeMap<String, Material>,
    /// Objects of the scene, in the order of the file.
    pub objects: Vec<Object>,
    /// Loader of the files (meshes, images) to which the scene refers.
    pub resolver: AssetResolver,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            film: FilmSettings::default(),
            trace: IntegratorSettings::default(),
            camera: Camera::at_origin(),
            cameras: BTreeMap::new(),
            background: Background::default(),
            ambient: Ambient::default(),
            groups: BTreeMap::new(),
            lights: Vec::new(),
            materials: BTreeMap::new(),
            objects: Vec::new(),
            resolver: AssetResolver::default(),
        }
    }
}

impl FieldValue for Scene {
    const TYPE: ValueType = ValueType::Table(FIELDS);
}

impl KeyNode for Scene {
    children! {
        "film" => film,
        "trace" => trace,
        "camera" => camera,
        "cameras" => cameras,
        "background" => background,
        "ambient" => ambient,
        "groups" => groups,
        "light" => lights,
        "materials" => materials,
        "object" => objects
    }

    fn make_child(&mut self, key: &str) -> Option<&mut dyn KeyNode> {
        if key == "camera" {
            self.camera = Camera::default();
        }
        self.child_mut(key)
    }
}

#[cfg(test)]
mod file_test;
#[cfg(test)]
mod recovery_test;
#[cfg(test)]
mod tables_test;
#[cfg(test)]
mod testing;
