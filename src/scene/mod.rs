//! The scene: what the user wrote, checked, in double precision, editable.

use crate::camera::Camera;
use crate::light::Light;
use crate::material::Material;
use crate::value::Color;
use glam::DAffine3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A whole scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Default)]
#[serde(default, deny_unknown_fields)]
pub struct Scene {
    /// The picture's raster.
    pub film: FilmSettings,
    /// How far paths are followed.
    pub trace: Trace,
    /// The view.
    pub camera: Camera,
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
}

/// The picture's raster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilmSettings {
    /// Width and height [pixels].
    pub size: [u32; 2],
    /// How samples spread over a pixel.
    pub filter: Filter,
    /// The most samples that a pixel with a glossy reflection gets; 0: no cap.
    pub rays_per_pixel: u32,
}

/// How samples spread over a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// Evenly over the pixel's square.
    Box,
    /// All in its centre: no anti-aliasing.
    Center,
}

/// How far paths are followed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Trace {
    /// What is traced at all.
    pub level: Level,
    /// The most surfaces that a path meets after the first: 0 is no reflection.
    pub depth: u32,
    /// A path ends when what it could still add is weighted by less than this.
    pub min_weight: f64,
    /// What becomes of a reflected ray that would dip under the surface.
    pub horizon: Horizon,
}

/// What is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// Camera rays only: no shadows, no reflections.
    Primary,
    /// Camera rays and shadow rays.
    Shadows,
    /// Everything.
    Full,
}

/// What becomes of a reflected ray that would dip under the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Horizon {
    /// It is mirrored at the surface: no light is lost.
    Fold,
    /// It is lost.
    Absorb,
}

/// What a ray sees that meets nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Background {
    /// Radiance.
    pub color: Color,
}

/// Light from everywhere, without shadows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ambient {
    /// i_a of k_a i_a.
    pub color: Color,
}

/// A thing: a shape, where it stands, what it is made of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name, unique in the scene.
    #[serde(default)]
    pub name: String,
    /// Key of `materials`.
    #[serde(default)]
    pub material: String,
    // pub shape: Shape,
    // pub transform: Vec<Step>,
}

impl Object {
    /// The transform's steps in order, as one map.
    pub fn scene_from_object(&self) -> DAffine3 {
        DAffine3::IDENTITY
    }
}

impl Default for FilmSettings {
    fn default() -> Self {
        Self { size: [640, 480], filter: Filter::Box, rays_per_pixel: 0 }
    }
}

impl Default for Trace {
    fn default() -> Self {
        Self { level: Level::Full, depth: 16, min_weight: 0.0, horizon: Horizon::Fold }
    }
}

impl Default for Background {
    fn default() -> Self {
        Self { color: Color::BLACK }
    }
}

impl Default for Ambient {
    fn default() -> Self {
        Self { color: Color::BLACK }
    }
}
