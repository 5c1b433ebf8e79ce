//! Scenes that the dashboard opens: files, built-in scenes, and a new one.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_scene::asset::Assets;
use zerkalo_scene::{Recovery, SceneErrors, SceneFile};

/// Text of a scene without objects.
pub const NEW: &str = include_str!("new_scene.toml");

/// Names and texts of the built-in scenes. The first one opens without an argument.
pub const BUILT_IN: [(&str, &str); 6] = [
    ("lamp-and-mirror", include_str!("../../scenes/lamp-and-mirror.toml")),
    ("mirror-room", include_str!("../../scenes/mirror-room.toml")),
    ("goblet", include_str!("../../scenes/features/goblet.toml")),
    ("gallery-glass", include_str!("../../scenes/gallery-glass.toml")),
    ("gallery-dusk", include_str!("../../scenes/gallery-dusk.toml")),
    ("gallery-water", include_str!("../../scenes/gallery-water.toml")),
];

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneSource {
    New,
    /// Index in [`BUILT_IN`].
    BuiltIn(usize),
    File(PathBuf),
}

impl SceneSource {
    /// Returns the built-in scene called `name`, or else the file at this path.
    pub fn of(name: &str) -> Self {
        let path = PathBuf::from(name);
        let built_in = BUILT_IN.iter().position(|(known, _)| *known == name);
        built_in.filter(|_| !path.exists()).map_or(Self::File(path), Self::BuiltIn)
    }

    /// Reads the scene. A scene file that [`is_new`] has the text [`NEW`].
    pub fn open(&self, assets: Arc<Assets>) -> Result<SceneFile, SceneErrors> {
        match self {
            Self::New => SceneFile::untitled(NEW.to_string(), "untitled.toml"),
            Self::BuiltIn(index) => {
                let (name, text) = BUILT_IN[*index];
                SceneFile::untitled(text.to_string(), &format!("{name}.toml"))
            }
            Self::File(path) if is_new(path) => SceneFile::recovered(path, NEW.to_string()),
            Self::File(path) => SceneFile::open_with(path, assets),
        }
    }
}

/// Returns `true` if `path` names a scene file that can be created: there is no such file or it is
/// empty, there are no unsaved edits of it, its extension is `toml`, and its folder exists.
pub fn is_new(path: &Path) -> bool {
    let missing = |error: std::io::Error| error.kind() == ErrorKind::NotFound;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let is_empty = path.metadata().is_ok_and(|file| file.is_file() && file.len() == 0);
    path.extension().is_some_and(|extension| extension == "toml")
        && (is_empty || path.symlink_metadata().is_err_and(missing))
        && Recovery::new(Some(path), "", None).find().orphans.is_empty()
        && folder.unwrap_or(Path::new(".")).is_dir()
}
