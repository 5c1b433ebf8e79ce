//! Scene of the unit tests.

use crate::Scene;

/// Text of `scenes/mirror-room.toml`.
pub const MIRROR_ROOM: &str =
    include_str!(concat!(env!("ZERKALO_ROOT"), "scenes/mirror-room.toml"));

pub fn mirror_room() -> Scene {
    Scene::parse(MIRROR_ROOM, "mirror-room.toml").unwrap_or_else(|e| panic!("{e}"))
}
