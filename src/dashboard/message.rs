//! Messages that `update` receives, and effects that it returns.

use crate::dashboard::SceneSource;
use crate::dashboard::pictures::KeptPicture;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use zerkalo_render::BOUNCE_SHARES;
use zerkalo_render::film::Display;
use zerkalo_render::schedule::{Interval, Stop};
use zerkalo_render::session::{Snapshot, View, WatchReport};
use zerkalo_scene::{SaveError, Scene, SceneErrors};
use zerkalo_terminal::Capabilities;
use zerkalo_terminal::event::{Key, Mouse};
use zerkalo_terminal::image::ViewerImage;

/// Event that changes the model.
#[derive(Debug)]
pub enum Message {
    Key(Key),
    /// Mouse event. Successive drags that wait in the queue are merged into one.
    Mouse(Mouse),
    /// Pasted text, which is never interpreted as keys.
    Paste(String),
    /// New columns and rows of the terminal.
    Resize([u16; 2]),
    Snapshot(Box<Snapshot>),
    /// State of the files that `zerkalo watch` shows.
    Watched(Box<WatchReport>),
    /// Result of [`Effect::Pin`].
    Pinned(KeptPicture),
    /// Result of [`Effect::MeasureBounces`]; `None` without noise.
    Bounces(Option<[f64; BOUNCE_SHARES]>),
    /// Result of [`Effect::Save`]: the scene, and the path of the written file or the error.
    Saved(Arc<Scene>, Result<PathBuf, SaveError>),
    /// Result of [`Effect::Load`].
    Loaded(Box<Result<Arc<Scene>, SceneErrors>>),
    /// Another program has written a valid scene to the scene file, with this difference.
    ChangedOnDisk(String),
    /// Another program has written errors to the scene file.
    BrokenOnDisk(SceneErrors),
    /// The scene file is again as it was before another program wrote errors to it.
    MendedOnDisk,
    /// Result of [`Effect::Open`].
    Opened(Box<Result<OpenedScene, SceneErrors>>),
    /// Result of [`Effect::ListScenes`]: names for [`SceneSource::of`], each with a note.
    Scenes(Vec<(String, &'static str)>),
    /// Result of [`Effect::CompletePath`]: the text, and the paths that begin with it.
    Paths(String, Vec<String>),
    /// Another program has changed a mesh or image of the scene.
    AssetsChanged,
    OrphanedEdits(OrphanedEdits),
    /// Warning that is shown until the next key.
    Warning(String),
    /// Written image or checkpoint, or the reason why it could not be written.
    Exported(Result<Exported, String>),
    /// Progress of [`Effect::ExportSized`], 0..=1, and time until its end; `None` at its end.
    ExportProgress(Option<(f64, Option<Interval>)>),
    /// Result of [`Effect::ViewImage`] for the file at this path.
    ViewerImage(PathBuf, Result<Arc<ViewerImage>, String>),
    /// Fraction of the viewed image that the terminal has received, 0..=1.
    ImageSent(f64),
    /// Measured or fixed rate of output in bytes per second; `None` for a local terminal.
    ConnectionRate(Option<f64>),
    /// New capabilities of the terminal, which include the size of its cells.
    Terminal(Box<Capabilities>),
    /// Time has passed, so that the notice disappears.
    Tick,
}

/// Scene that replaces the present one.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenedScene {
    pub scene: Arc<Scene>,
    pub path: Option<PathBuf>,
    pub name: String,
    /// `true` if the file does not exist yet.
    pub is_new: bool,
}

/// Unsaved edits that a crashed run of the program has left.
#[derive(Clone, Debug, PartialEq)]
pub struct OrphanedEdits {
    pub scene: Arc<Scene>,
    /// Age of the recovery file when the recovery is offered.
    pub age: Duration,
    /// `true` if the scene file has changed since the edits were autosaved.
    pub changed: bool,
}

/// Exported file: an image or a checkpoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    pub path: PathBuf,
    /// Description, such as `640x480  212 spp  noise 0.50 levels`.
    pub description: String,
    /// Advice on the next step, such as the command that copies an image from another machine.
    pub advice: String,
    /// `false` for a checkpoint.
    pub is_image: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Picture as displayed, 8 bits per channel.
    Png,
    /// Picture in linear radiance, with channels of replicates, light groups and counts.
    Exr,
    /// Picture in linear radiance.
    PlainExr,
}

impl Format {
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr | Self::PlainExr => "exr",
        }
    }
}

/// Contents of the picture's panel: a channel of the live render, or a comparison with the pinned
/// picture, an earlier one that the user has stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DisplayChannel {
    /// Rendered picture.
    #[default]
    Beauty,
    /// Estimated error of each tile.
    Noise,
    /// Samples per pixel of each tile.
    Samples,
    /// Object ids of the first hits.
    Objects,
    /// Surface normals of the first hits.
    Normals,
    /// Distance of the first hits from the eye.
    Depth,
    Pinned,
    /// Live picture minus the pinned one, in false colour.
    Difference,
    /// Pinned picture on the left, live one on the right.
    SideBySide,
    /// Pinned picture to the left of a border, live one to the right.
    Wipe,
}

impl DisplayChannel {
    /// Channels of the live render, in the order in which a key cycles through them.
    pub const LIVE: [Self; 6] =
        [Self::Beauty, Self::Noise, Self::Samples, Self::Objects, Self::Normals, Self::Depth];

    /// Channels that need a film but no scene.
    pub const OF_FILM: [Self; 3] = [Self::Beauty, Self::Noise, Self::Samples];

    /// Comparisons of the live picture, in the order in which a key cycles through them.
    pub const COMPARISONS: [Self; 4] =
        [Self::Beauty, Self::Difference, Self::SideBySide, Self::Wipe];

    /// Returns `true` if it shows the pinned picture.
    pub fn compares(self) -> bool {
        matches!(self, Self::Pinned | Self::Difference | Self::SideBySide | Self::Wipe)
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Beauty => "beauty",
            Self::Noise => "noise",
            Self::Samples => "samples",
            Self::Objects => "objects",
            Self::Normals => "normals",
            Self::Depth => "depth",
            Self::Pinned => "pinned picture",
            Self::Difference => "live − pinned",
            Self::SideBySide => "pinned and live",
            Self::Wipe => "pinned | live",
        }
    }
}

/// Request from `update` to the event loop. If one update requests several effects of one kind,
/// only the last one is executed, except for saves and exports.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Render this scene. Samples that are valid for it are kept.
    Show(Arc<Scene>),
    /// Use this display transform to measure noise and to write images.
    Display(Display),
    /// Render until the first of these stop criteria is reached.
    Stop(Stop),
    /// Set the size of the pictures in later snapshots, and the pixel whose values they have.
    View(View),
    /// Discard all samples and restart rendering.
    Restart,
    /// Measure the shares of the bounces in the noise, for this time in seconds, and return them as
    /// [`Message::Bounces`].
    MeasureBounces(f64),
    /// Return the current picture as [`Message::Pinned`].
    Pin {
        /// Label of the last undo step of its scene.
        step: String,
        /// `true` if the user keeps it.
        is_pinned: bool,
    },
    /// Write the scene to its file, or to `path`, which becomes the scene's file.
    Save {
        scene: Arc<Scene>,
        /// Path relative to the working directory; `None` for the scene's own file.
        path: Option<PathBuf>,
        /// `true` if changes by other programs, or another file, may be overwritten.
        overwrite: bool,
    },
    /// Read the scene file again.
    Load,
    /// Replace the scene by another one. The recovery file of the present one is removed.
    Open(SceneSource),
    /// List the scenes that can be opened.
    ListScenes,
    /// List the paths that begin with this text.
    CompletePath {
        text: String,
        /// `true` if they are relative to the folder of the scene file.
        beside_scene: bool,
    },
    /// Write the current picture as an image with the next free name, such as `room-2.png`.
    Export(Format),
    /// Write the samples of this scene as a checkpoint with the next free name.
    Checkpoint(Arc<Scene>),
    /// Render the scene at a size of the user's choice, beside the main render, and write the
    /// picture with the next free name.
    ExportSized {
        /// Scene whose film has the requested size.
        scene: Arc<Scene>,
        format: Format,
        display: Display,
        stop: Stop,
    },
    /// Write the picture of [`Effect::ExportSized`] as it is.
    FinishExport,
    /// Cancel the render of [`Effect::ExportSized`]. No image is written then, unless the write has
    /// begun.
    CancelExport,
    /// Write the scene to the recovery file. After a crash, the next start offers its edits. `None`
    /// removes the file.
    Autosave(Option<Arc<Scene>>),
    /// Take over the recovery file of a crashed run, whose edits the user has accepted.
    Recover,
    /// Discard the offered edits of a crashed run.
    Discard,
    /// Read an exported image and encode it for the image viewer.
    ViewImage {
        path: PathBuf,
        /// Display transform for images in linear radiance.
        display: Display,
        screen: [u16; 2],
        /// `true` if the terminal stores the file instead of showing it.
        downloads: bool,
    },
    /// Copy this path to the clipboard through the terminal.
    Copy(PathBuf),
    Suspend,
    Quit,
}
