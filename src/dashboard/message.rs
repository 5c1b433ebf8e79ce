//! Messages that `update` takes and effects that it returns.

use crate::film::{Display, LinearImage};
use crate::render::schedule::Stop;
use crate::render::session::Snapshot;
use crate::scene::{SaveError, Scene, SceneErrors};
use crate::terminal::event::{Key, Mouse};
use crate::terminal::flow::LinkStatus;
use crate::terminal::image::ViewerImage;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// An event that `update` takes.
#[derive(Debug)]
pub enum Message {
    /// A key was pressed.
    Key(Key),
    /// Mouse event. Of several pending drags only the newest is required.
    Mouse(Mouse),
    /// Pasted text; never interpreted as keys.
    Paste(String),
    /// New size of the terminal in columns and rows.
    Resize([u16; 2]),
    /// Latest snapshot of the renderer.
    Snapshot(Box<Snapshot>),
    /// Picture requested by [`Effect::Pin`], and its mean samples per pixel.
    Pinned(Arc<LinearImage>, f64),
    /// Result of [`Effect::Save`] for this scene.
    Saved(Arc<Scene>, Result<PathBuf, SaveError>),
    /// Result of [`Effect::Load`].
    Loaded(Box<Result<Arc<Scene>, SceneErrors>>),
    /// Another program has written the file since it was last read or written.
    ChangedOnDisk,
    /// Unsaved edits of this scene, left by a crashed session.
    OrphanedEdits(OrphanedEdits),
    /// Warning about unsaved edits.
    Warning(String),
    /// Result of an export.
    Exported(Result<Exported, String>),
    /// Progress of [`Effect::ExportSized`], 0..=1.
    ExportProgress(f64),
    /// Result of [`Effect::ViewImage`] for this path.
    ViewerImage(PathBuf, Result<Arc<ViewerImage>, String>),
    /// Transferred share of the image in the viewer, 0..=1.
    ImageSent(f64),
    /// Status of the connection to a remote terminal.
    LinkStatus(Option<LinkStatus>),
    /// A moment that the model waits for has come
    /// ([`Model::next_timeout`](crate::dashboard::model::Model::next_timeout)).
    Tick,
}

/// Unsaved edits of a crashed session.
#[derive(Clone, Debug, PartialEq)]
pub struct OrphanedEdits {
    /// Scene with the edits.
    pub scene: Arc<Scene>,
    /// Time since the last autosave.
    pub age: Duration,
    /// The scene file has changed since then.
    pub changed: bool,
}

/// An exported image.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// Path of the file.
    pub path: PathBuf,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Mean samples per pixel.
    pub spp: f64,
    /// Estimated RMSE as displayed, in 8-bit levels, if there is an estimate.
    pub noise_codes: Option<f64>,
    /// `user@host:path` for scp.
    pub scp: String,
}

/// File format of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG: as displayed, 8 bits per channel.
    Png,
    /// OpenEXR: linear radiance.
    Exr,
}

impl Format {
    /// File name extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
        }
    }
}

/// Channel that the picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DisplayChannel {
    /// Rendered picture.
    Beauty,
    /// Estimated error of tiles, false colour.
    Noise,
    /// Samples per pixel of tiles, false colour.
    Samples,
    /// Object ids of the first hits.
    Objects,
    /// Surface normals of the first hits.
    Normals,
    /// Distance of the first hits from the eye, false colour.
    Depth,
}

impl DisplayChannel {
    /// Every channel, in the order in which the key cycles through them.
    pub const ALL: [Self; 6] =
        [Self::Beauty, Self::Noise, Self::Samples, Self::Objects, Self::Normals, Self::Depth];

    /// Name of the channel.
    pub fn name(self) -> &'static str {
        match self {
            Self::Beauty => "beauty",
            Self::Noise => "noise",
            Self::Samples => "samples",
            Self::Objects => "objects",
            Self::Normals => "normals",
            Self::Depth => "depth",
        }
    }
}

/// A request of `update` to the event loop. Of several requests of one kind in a row only the last
/// matters, except for saving and exporting.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Render this scene. Samples are kept where only light has changed (intensity, colour, on and
    /// off, ambient, background).
    Show(Arc<Scene>),
    /// Display transform that noise is measured through.
    Display(Display),
    /// Stop criteria.
    Stop(Stop),
    /// Columns and rows of half cells that snapshots are resampled to.
    Raster([usize; 2]),
    /// Pause (`true`) or resume (`false`) tracing.
    Pause(bool),
    /// Restart the picture.
    Restart,
    /// Number of tracing threads, at least 1.
    Threads(usize),
    /// Low (`true`) or normal priority of the tracing threads.
    LowPriority(bool),
    /// Pixel of the film (column, row) whose values snapshots report.
    Probe(Option<[usize; 2]>),
    /// Return the current picture, for comparison.
    Pin,
    /// Write the scene to its file, or to `path`, which becomes its file.
    Save {
        /// Scene to write.
        scene: Arc<Scene>,
        /// Path other than the scene's own, relative to the working directory.
        path: Option<PathBuf>,
        /// Overwrite changes by other programs, or an existing file at `path`.
        overwrite: bool,
    },
    /// Read the scene file.
    Load,
    /// Write the current picture under the next free name derived from the scene's.
    Export(Format),
    /// Render the scene at another size until `stop`, beside the main render, and write it under
    /// the next free name.
    ExportSized {
        /// Scene whose film has the requested size.
        scene: Arc<Scene>,
        /// File format.
        format: Format,
        /// Exposure and tone curve.
        display: Display,
        /// Stop criteria.
        stop: Stop,
    },
    /// Cancel the render of `ExportSized`; nothing is written.
    CancelExport,
    /// Write these unsaved edits to the recovery file, which the next start offers; `None` removes
    /// it.
    Autosave(Option<Arc<Scene>>),
    /// The orphaned edits become the unsaved edits of this session.
    Recover,
    /// Discard the orphaned edits.
    Discard,
    /// Prepare an exported image for the viewer.
    ViewImage {
        /// Path of a PNG or EXR.
        path: PathBuf,
        /// Display transform for linear images.
        display: Display,
        /// Columns and rows of the terminal.
        screen: [u16; 2],
    },
    /// Copy the path of this file to the terminal's clipboard.
    Copy(PathBuf),
    /// Suspend the program and give the terminal to the shell.
    Suspend,
    /// Quit.
    Quit,
}
