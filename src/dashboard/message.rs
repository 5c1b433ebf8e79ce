//! What comes in and what goes out: everything that `update` learns, and everything that it asks for.

use super::input::{Key, Mouse};
use crate::film::{Display, Linear};
use crate::render::schedule::Stop;
use crate::render::session::Snapshot;
use crate::scene::{Scene, SceneErrors};
use std::path::PathBuf;
use std::sync::Arc;

/// What happened.
#[derive(Debug)]
pub enum Message {
    /// A key was pressed.
    Key(Key),
    /// The mouse did something.
    Mouse(Mouse),
    /// Text was pasted; it never fires shortcuts.
    Paste(String),
    /// The terminal has this many columns and rows now.
    Resize([u16; 2]),
    /// The renderer has news.
    Snapshot(Box<Snapshot>),
    /// The picture that was asked for with [`Effect::Keep`].
    Kept(Arc<Linear>),
    /// A scene was written to its file.
    Saved(Result<Written, SaveError>),
    /// The file was read: because it changed, or because it was asked for.
    Loaded(Box<Result<Arc<Scene>, SceneErrors>>),
    /// Somebody else has written the file.
    ChangedOnDisk,
    /// A picture was written, or not, and why.
    Exported(Result<Export, String>),
    /// How far a render at another size is, 0..=1.
    ExportProgress(f64),
    /// Time has passed and nothing else happened.
    Tick,
}
