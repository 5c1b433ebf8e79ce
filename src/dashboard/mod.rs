//! Dashboard: the user interface in the terminal, for editing a scene while it is rendered.
//!
//! `update` handles a `Message`: it changes the `Model` and returns `Effect`s, without access to
//! clock, files or terminal. `view` draws a model into a buffer of cells. `run` is the event loop,
//! which executes the effects.

// The dashboard is public only for tests. Many names of fields and variants need no comment.
#![allow(missing_docs)]

pub mod convergence;
pub mod editor;
pub mod graphics;
pub mod hints;
pub mod key_context;
pub mod layout;
pub mod loupe;
pub mod marks;
pub mod message;
pub mod model;
pub mod noise_targets;
pub mod overlay;
pub mod overlay_layout;
pub mod panel_lines;
pub mod pictures;
pub mod preferences;
pub mod run;
pub mod scene_source;
mod search;
#[cfg(test)]
mod testing;
pub mod text;
pub mod update;
pub mod view;

// Names that most modules of the dashboard use.
use convergence::Convergence;
use editor::Editor;
use key_context::KeyContext;
use layout::{BORDER, Focus, Layout};
use message::{DisplayChannel, Effect, Exported, Format, Message, OpenedScene, OrphanedEdits};
use model::{Drag, FieldList, Mode, Model, WatchTable, short_name};
use overlay::{Answer, Form, Overlay, Pick, PickEntry, Prompt, Question, ViewedImage};
use panel_lines::{FieldLine, ListCursor, OutlineEntry, OutlineLine, PanelLine};
use preferences::Preferences;
use scene_source::SceneSource;
use update::UpdateContext;
