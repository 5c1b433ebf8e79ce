//! A scene file as text with its comments, beside the scene that it describes.

use super::Scene;
use super::locate::located;
use super::message::{Message, SceneErrors};
use super::read::read_text;
use std::path::Path;

/// A scene file: its text, and what it says.
#[derive(Clone, Debug)]
pub struct Document {
    name: String,
    text: String,
    scene: Scene,
}

impl Document {
    /// Reads and checks the scene file at `path`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read(path: &Path) -> Result<Self, SceneErrors> {
        read_text(path).and_then(|text| Self::parse(text, &path.display().to_string()))
    }

    /// Reads and checks a scene from `text`; messages call it `name`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: String, name: &str) -> Result<Self, SceneErrors> {
        let scene = Scene::parse(&text, name)?;
        Ok(Self { name: name.to_string(), text, scene })
    }

    /// The scene that the text describes.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The text, as it stands in the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// [`Scene::warnings`] with file, line and column, in the order of the file.
    pub fn warnings(&self) -> Vec<Message> {
        located(&self.name, &self.text, self.scene.warnings())
    }
}
