//! Messages that `update` receives, and effects that it returns.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use zerkalo_render::film::{Display, LinearImage};
use zerkalo_render::schedule::Stop;
use zerkalo_render::session::{Snapshot, View, WatchReport};
use zerkalo_scene::{SaveError, Scene, SceneErrors};
use zerkalo_terminal::event::{Key, Mouse};
use zerkalo_terminal::flow::LinkStatus;
use zerkalo_terminal::image::ViewerImage;

/// Message to `update`: an event that changes the model.
#[derive(Debug)]
pub enum Message {
    /// Key that was pressed.
    Key(Key),
    /// Mouse event. Successive mouse drags that wait in the queue are merged into one event, which
    /// has the newest position.
    Mouse(Mouse),
    /// Pasted text, which is never interpreted as keys.
    Paste(String),
    /// New size of the terminal in columns and rows.
    Resize([u16; 2]),
    /// Latest snapshot of the renderer: the state of the render at one moment, with the picture so
    /// far.
    Snapshot(Box<Snapshot>),
    /// State of the files that `zerkalo watch` shows.
    Watched(Box<WatchReport>),
    /// Result of [`Effect::Pin`]: the picture to keep for later comparison, and its mean number of
    /// samples per pixel.
    Pinned(Arc<LinearImage>, f64),
    /// Result of saving this scene by [`Effect::Save`]: the path of the written file, or the error.
    Saved(Arc<Scene>, Result<PathBuf, SaveError>),
    /// Scene that was read from the scene file by [`Effect::Load`], or the errors in the file.
    Loaded(Box<Result<Arc<Scene>, SceneErrors>>),
    /// Another program has changed the scene file since this program last read or wrote it.
    ChangedOnDisk,
    /// Unsaved edits of this scene that a crashed run of the program has left.
    OrphanedEdits(OrphanedEdits),
    /// Warning that is shown until the next key.
    Warning(String),
    /// Image that was exported, or the reason of the failure.
    Exported(Result<Exported, String>),
    /// Path of the checkpoint that [`Effect::Checkpoint`] has written, or the reason of the
    /// failure.
    CheckpointWritten(Result<PathBuf, String>),
    /// Progress of a render for an exported image ([`Effect::ExportSized`]), 0..=1.
    ExportProgress(f64),
    /// Image that [`Effect::ViewImage`] has read from the file at this path and encoded for the
    /// terminal, or the reason of the failure.
    ViewerImage(PathBuf, Result<Arc<ViewerImage>, String>),
    /// Fraction of the viewed image's bytes that have been sent to the terminal, 0..=1.
    ImageSent(f64),
    /// Status of the connection to a remote terminal; `None` for a local terminal.
    LinkStatus(Option<LinkStatus>),
    /// Expiry of a timeout: the time of
    /// [`Model::next_timeout`](crate::dashboard::model::Model::next_timeout) has come.
    Tick,
}

/// Unsaved edits that a crashed run of the program has left, and that the user can recover.
#[derive(Clone, Debug, PartialEq)]
pub struct OrphanedEdits {
    /// Scene with the unsaved edits.
    pub scene: Arc<Scene>,
    /// Age of the recovery file that contains the edits, at the time when their recovery is
    /// offered.
    pub age: Duration,
    /// `true` if the scene file has changed since the edits were written.
    pub changed: bool,
}

/// Description of an exported image file.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// Path of the image file.
    pub path: PathBuf,
    /// Width and height of the image in pixels.
    pub size: [usize; 2],
    /// Mean number of samples per pixel of the image.
    pub spp: f64,
    /// Estimated RMSE of the image after the display transform, in 8-bit levels; `None` without an
    /// estimate.
    pub noise_levels: Option<f64>,
    /// Argument of scp that copies the image file, such as `user@host:path`.
    pub scp: String,
}

/// File format of an exported image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// PNG: the picture as displayed, 8 bits per channel.
    Png,
    /// OpenEXR: the picture in linear radiance.
    Exr,
}

impl Format {
    /// Returns the file name extension of the format.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
        }
    }
}

/// Channel of the render that the picture's panel shows: the rendered picture itself, a statistic
/// of each tile, or a property of the first hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DisplayChannel {
    /// Rendered picture (beauty pass).
    #[default]
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
    /// All channels of the picture that the dashboard can show, in the order in which a key cycles
    /// through them.
    pub const ALL: [Self; 6] =
        [Self::Beauty, Self::Noise, Self::Samples, Self::Objects, Self::Normals, Self::Depth];

    /// Channels that are computed from a film alone, without a scene.
    pub const OF_FILM: [Self; 3] = [Self::Beauty, Self::Noise, Self::Samples];

    /// Returns the channel's name on the screen.
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

/// Effect: a request from `update` to the event loop. If several effects of one kind are pending,
/// only the last one is executed. Saves and exports are exceptions: all are executed.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Render this scene. Existing samples are kept if only lighting has changed: intensity or
    /// colour of a light, a light switched on or off, ambient light, background.
    Show(Arc<Scene>),
    /// Use this display transform (exposure and tone curve) to measure noise and to write images.
    Display(Display),
    /// Render until the first of these stop criteria is reached.
    Stop(Stop),
    /// Put into all later snapshots the data that the view requests: pictures at the view's
    /// resolution, and the values of one film pixel. The resolution is in half cells (upper or
    /// lower halves of terminal cells).
    View(View),
    /// Pause (`true`) or resume (`false`) the render.
    Pause(bool),
    /// Discard all samples and restart rendering.
    Restart,
    /// Render with this number of threads, at least 1.
    Threads(usize),
    /// Give the render's threads low (`true`) or normal (`false`) priority.
    LowPriority(bool),
    /// Return the current picture as [`Message::Pinned`]. The model stores it, so that the user can
    /// compare later pictures with it.
    Pin,
    /// Write the scene to its file, or to `path`, which becomes the scene's file.
    Save {
        /// Scene to write to the file.
        scene: Arc<Scene>,
        /// Path of the file to write; `None` for the scene's own file. A relative path starts at
        /// the working directory.
        path: Option<PathBuf>,
        /// `true` if changes by other programs, or an existing file at `path`, may be overwritten.
        overwrite: bool,
    },
    /// Read the scene file again.
    Load,
    /// Write the current picture as an image. Its file gets the next free name derived from the
    /// scene's name, such as `room-2.png`.
    Export(Format),
    /// Write the samples of this scene as a checkpoint. Its file gets the next free name derived
    /// from the scene's name.
    Checkpoint(Arc<Scene>),
    /// Render the scene at a size of the user's choice until the first of the criteria `stop` is
    /// reached, while the main render continues. Write the picture to a file with the next free
    /// name.
    ExportSized {
        /// Scene to render; its film has the requested size.
        scene: Arc<Scene>,
        /// File format of the image.
        format: Format,
        /// Exposure and tone curve of the image.
        display: Display,
        /// Stop criteria of the exported image's render.
        stop: Stop,
    },
    /// Cancel the render of [`Effect::ExportSized`]. No image is written then, unless the write has
    /// already begun.
    CancelExport,
    /// Write the scene with its unsaved edits to the recovery file. If the program crashes or a
    /// signal ends it, its next start offers to recover the edits. `None` removes the file.
    Autosave(Option<Arc<Scene>>),
    /// Recover the offered edits of a crashed run of the program. They become unsaved edits of the
    /// scene.
    Recover,
    /// Discard the offered edits of a crashed run of the program.
    Discard,
    /// Read an exported image and encode it for the image viewer.
    ViewImage {
        /// Path of the PNG or EXR file to view.
        path: PathBuf,
        /// Display transform (exposure and tone curve) for images in linear radiance.
        display: Display,
        /// Columns and rows of the terminal.
        screen: [u16; 2],
    },
    /// Copy this path to the clipboard of the user's machine by means of the terminal.
    Copy(PathBuf),
    /// Suspend the program and give the terminal to the shell.
    Suspend,
    /// End the program.
    Quit,
}
