//! The scene: what the user wrote, checked, in double precision, editable.
mod asset_resolver;
mod builtin;
mod diagnostic;
mod document;
pub mod edit;
mod file;
mod format;
mod history;
mod lints;
mod object;
mod recovery;
mod reference;
mod settings;
mod validate;

pub use crate::primitive::Acceleration;
pub use crate::scene::format::schema::FIELDS;
pub use crate::shape::{Rotate, Scale, TRANSFORM_OP_FIELDS, TransformOp};
pub use asset_resolver::AssetResolver;
pub use builtin::{BUILT_IN, built_in, starter};
pub use diagnostic::{Diagnostic, SceneErrors};
pub use document::Document;
pub use file::{DiskState, SaveError, SceneFile};
pub use history::History;
pub use object::{OBJECT_FIELDS, Object};
pub use recovery::{Orphan, Recovery, RecoveryFile, kept_in, remove_stale, state_folder};
pub use reference::reference;
pub use settings::{
    AMBIENT_FIELDS, Ambient, BACKGROUND_FIELDS, Background, BelowHorizon, FILM_FIELDS,
    FilmSettings, Filter, IntegratorSettings, MAX_PIXELS, RayTypes, TRACE_FIELDS,
};
pub use validate::Problem;

use crate::camera::Camera;
use crate::light::Light;
use crate::material::Material;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A whole scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// The picture's raster.
    pub film: FilmSettings,
    /// How far paths are followed.
    pub trace: IntegratorSettings,
    /// The view.
    pub camera: Camera,
    /// Other viewpoints by name, to come back to. The picture is taken from `camera`.
    pub cameras: BTreeMap<String, Camera>,
    /// What a ray sees that meets nothing.
    pub background: Background,
    /// Light from everywhere.
    pub ambient: Ambient,
    /// Lights.
    #[serde(rename = "light")]
    pub lights: Vec<Light>,
    /// Finishes by name.
    pub materials: BTreeMap<String, Material>,
    /// Things.
    #[serde(rename = "object")]
    pub objects: Vec<Object>,
    /// Where the files are that it names.
    #[serde(skip)]
    pub library: AssetResolver,
}

#[cfg(test)]
mod file_test;
#[cfg(test)]
mod recovery_test;
#[cfg(test)]
mod tables_test;
