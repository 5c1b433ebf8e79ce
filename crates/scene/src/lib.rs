//! Scene as the user describes it: editable, in double precision, with validation.
//!
//! [`Document`] and [`edit::Edit`] are validated once. The fields of [`Scene`] are public: a render
//! session validates the scene that it is given.

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

mod acceleration;
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

pub use crate::format::schema::FIELDS;
pub use crate::shape::{Rotate, Scale, TransformOp};
pub use acceleration::Acceleration;
pub use asset_resolver::AssetResolver;
pub use diagnostic::{Diagnostic, SceneErrors};
pub use document::Document;
pub use file::{DiskState, SaveError, SceneFile};
pub use history::History;
pub use object::Object;
pub use recovery::{Orphan, Recovery, RecoveryFile, kept_in, remove_stale, state_folder};
pub use settings::{
    Ambient, Background, BelowHorizon, FilmSettings, Filter, IntegratorSettings, RayTypes,
};
pub use validate::Problem;

use crate::camera::Camera;
use crate::light::Light;
use crate::material::Material;
use crate::value::{TableReader, TomlError, TomlValue, written};
use std::collections::BTreeMap;
use toml::de::DeValue;
use toml::{Spanned, Value};

/// Description of a whole scene, valid or not: see [`Scene::faults`].
#[derive(Clone, Debug, PartialEq, Default)]
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
    /// Lights of the scene, in the order of the file.
    pub lights: Vec<Light>,
    /// Materials of the scene, by name.
    pub materials: BTreeMap<String, Material>,
    /// Objects of the scene, in the order of the file.
    pub objects: Vec<Object>,
    /// Loader of the files (meshes, images) to which the scene refers.
    pub resolver: AssetResolver,
}

impl TomlValue for Scene {
    fn from_toml(value: &Spanned<DeValue>) -> Result<Self, TomlError> {
        let table = TableReader::new(value, FIELDS)?;
        let mut scene = Self::default();
        table.replace("ambient", &mut scene.ambient)?;
        table.replace("background", &mut scene.background)?;
        table.replace("camera", &mut scene.camera)?;
        table.replace("cameras", &mut scene.cameras)?;
        table.replace("film", &mut scene.film)?;
        table.replace("light", &mut scene.lights)?;
        table.replace("materials", &mut scene.materials)?;
        table.replace("object", &mut scene.objects)?;
        table.replace("trace", &mut scene.trace)?;
        Ok(scene)
    }

    fn to_toml(&self) -> Value {
        written(&[
            ("film", Some(&self.film)),
            ("trace", Some(&self.trace)),
            ("camera", Some(&self.camera)),
            ("cameras", Some(&self.cameras)),
            ("background", Some(&self.background)),
            ("ambient", Some(&self.ambient)),
            ("light", Some(&self.lights)),
            ("materials", Some(&self.materials)),
            ("object", Some(&self.objects)),
        ])
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
