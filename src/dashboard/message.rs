//! Messages that `update` receives, and effects that it returns.

use crate::film::{Display, LinearImage};
use crate::render::schedule::Stop;
use crate::render::session::{Snapshot, WatchReport};
use crate::scene::{SaveError, Scene, SceneErrors};
use crate::terminal::event::{Key, Mouse};
use crate::terminal::flow::LinkStatus;
use crate::terminal::image::ViewerImage;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// An event that `update` receives.
#[derive(Debug)]
pub enum Message {
    /// A key was pressed.
    Key(Key),
    /// Mouse event. Pending drags are joined: only the newest position is reported.
    Mouse(Mouse),
    /// Pasted text, which is never interpreted as keys.
    Paste(String),
    /// New size of the terminal in columns and rows.
    Resize([u16; 2]),
    /// Latest snapshot of the renderer.
    Snapshot(Box<Snapshot>),
    /// State of the files that `zerkalo watch` shows.
    Watched(Box<WatchReport>),
    /// Result of [`Effect::Pin`]: the picture and its mean samples per pixel.
    Pinned(Arc<LinearImage>, f64),
    /// Result of [`Effect::Save`] for this scene.
    Saved(Arc<Scene>, Result<PathBuf, SaveError>),
    /// Result of [`Effect::Load`].
    Loaded(Box<Result<Arc<Scene>, SceneErrors>>),
    /// Another program has changed the scene file since this program last read or wrote it.
    ChangedOnDisk,
    /// Unsaved edits of this scene from a crashed session.
    OrphanedEdits(OrphanedEdits),
    /// Warning, to be shown until the next key.
    Warning(String),
    /// Result of an export.
    Exported(Result<Exported, String>),
    /// Result of [`Effect::Checkpoint`].
    CheckpointWritten(Result<PathBuf, String>),
    /// Progress of [`Effect::ExportSized`], 0..=1.
    ExportProgress(f64),
    /// Result of [`Effect::ViewImage`] for this path.
    ViewerImage(PathBuf, Result<Arc<ViewerImage>, String>),
    /// Transferred fraction of the image in the viewer, 0..=1.
    ImageSent(f64),
    /// Status of the connection to a remote terminal; `None` for a local terminal.
    LinkStatus(Option<LinkStatus>),
    /// A timeout has expired: the time of
    /// [`Model::next_timeout`](crate::dashboard::model::Model::next_timeout) has come.
    Tick,
}

/// Unsaved edits of a crashed session.
#[derive(Clone, Debug, PartialEq)]
pub struct OrphanedEdits {
    /// Scene with the edits.
    pub scene: Arc<Scene>,
    /// Time since the edits were last written to the recovery file.
    pub age: Duration,
    /// `true` if the scene file has changed since the edits were written.
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
    /// Estimated RMSE of the displayed picture in 8-bit levels; `None` without an estimate.
    pub noise_codes: Option<f64>,
    /// Argument of scp that copies the file, such as `user@host:path`.
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

/// Channel of the render that the picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DisplayChannel {
    /// Rendered picture.
    Beauty,
    /// Estimated error of each tile, in false colour.
    Noise,
    /// Samples per pixel of each tile, in false colour.
    Samples,
    /// Object ids of the camera rays' first hits, in one colour per object.
    Objects,
    /// Surface normals of the camera rays' first hits.
    Normals,
    /// Distance of the camera rays' first hits from the eye, in false colour.
    Depth,
}

impl DisplayChannel {
    /// Every channel, in the order in which the key cycles through them.
    pub const ALL: [Self; 6] =
        [Self::Beauty, Self::Noise, Self::Samples, Self::Objects, Self::Normals, Self::Depth];

    /// Channels of a film, which need no scene.
    pub const OF_FILM: [Self; 3] = [Self::Beauty, Self::Noise, Self::Samples];

    /// Returns the name of the channel.
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

/// A request from `update` to the event loop. If several effects of one kind are pending, only the
/// last one is executed, except for saves and exports.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Render this scene. Existing samples are kept if only lighting has changed: intensity or
    /// colour of a light, a light switched on or off, ambient light, background.
    Show(Arc<Scene>),
    /// Use this display transform to measure noise and to write images.
    Display(Display),
    /// Use these stop criteria.
    Stop(Stop),
    /// Resample snapshots to these columns and rows of half cells.
    Raster([usize; 2]),
    /// Pause (`true`) or resume (`false`) tracing.
    Pause(bool),
    /// Discard all samples and restart rendering.
    Restart,
    /// Use this number of tracing threads, at least 1.
    Threads(usize),
    /// Give the tracing threads low (`true`) or normal (`false`) priority.
    LowPriority(bool),
    /// Include the values of this film pixel (column, row) in snapshots; with `None`, those of no
    /// pixel.
    Probe(Option<[usize; 2]>),
    /// Return the current picture as [`Message::Pinned`], for comparison.
    Pin,
    /// Write the scene to its file, or to `path`, which becomes the scene's file.
    Save {
        /// Scene to write.
        scene: Arc<Scene>,
        /// Path other than the scene's own, relative to the working directory.
        path: Option<PathBuf>,
        /// Permission to overwrite changes by other programs, or an existing file at `path`.
        overwrite: bool,
    },
    /// Read the scene file.
    Load,
    /// Write the current picture to the next free file name derived from the scene's name.
    Export(Format),
    /// Write the samples of this scene as a checkpoint to the next free file name derived from the
    /// scene's name.
    Checkpoint(Arc<Scene>),
    /// Render the scene at another size until `stop`, while the main render continues, and write
    /// the picture to the next free file name.
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
    /// Cancel the render of [`Effect::ExportSized`], so that it writes nothing.
    CancelExport,
    /// Write the scene with unsaved edits to the recovery file, from which the next start offers to
    /// recover them. `None` removes the file.
    Autosave(Option<Arc<Scene>>),
    /// Adopt the orphaned edits as the unsaved edits of this session.
    Recover,
    /// Discard the orphaned edits.
    Discard,
    /// Read and encode an exported image for the viewer.
    ViewImage {
        /// Path of a PNG or EXR file.
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
