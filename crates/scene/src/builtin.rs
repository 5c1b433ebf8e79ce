//! Scenes that are compiled into the program.

use crate::Scene;

/// Text of the scene that the dashboard opens without a file: `scenes/lamp-and-mirror.toml`.
pub const OPENING: &str = include_str!("../../../scenes/lamp-and-mirror.toml");

/// File name under which [`OPENING`] is saved.
pub const OPENING_NAME: &str = "lamp-and-mirror.toml";

/// Text of the built-in scene, the mirror room: `scenes/mirror-room.toml`.
pub const BUILT_IN: &str = include_str!("../../../scenes/mirror-room.toml");

/// Returns the built-in scene, the mirror room.
pub fn built_in() -> Scene {
    Scene::parse(BUILT_IN, "mirror-room.toml").expect("the built-in scene is tested")
}

/// Returns the text of a small scene with comments, from which users start a scene of their own.
pub fn starter() -> &'static str {
    include_str!("starter.toml")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn builtin_scenes_read_without_warnings() {
        assert!(built_in().objects.len() >= 6);
        for text in [OPENING, BUILT_IN, starter()] {
            let scene = Scene::parse(text, "text").unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(scene.warnings(), []);
            assert!(text.starts_with("# "));
        }
    }

    #[test]
    fn starter_scene_names_every_shape() {
        for (key, _) in crate::shape::EXAMPLES {
            assert!(starter().contains(key), "{key}");
        }
    }
}
