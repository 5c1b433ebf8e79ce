//! Stories of the dashboard: a scene, user input, and the expected state, without terminal,
//! renderer or disk.

mod actions;
mod beginning;
mod compounds;
mod editing;
mod files;
mod mouse;
mod moving_picture;
mod random;
mod recovery;
mod roughness;
mod simulated_dashboard;
mod table;
mod typing;
mod view;
mod watch;
mod zoom;

use crate::harness::*;
use simulated_dashboard::{Desk, FILE, ROOM};
use zerkalo::dashboard::message::{
    DisplayChannel, Effect, Exported, Format, Message, OpenedScene, OrphanedEdits,
};
use zerkalo::dashboard::model::Model;
use zerkalo::dashboard::overlay::Overlay;
use zerkalo::dashboard::update::commands::{COMMANDS, lookup};
use zerkalo::dashboard::update::update;
use zerkalo_scene::SaveError;
use zerkalo_terminal::event::{Button, Code, Key, Mouse, MouseKind};
