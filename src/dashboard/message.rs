//! What comes in and what goes out: everything that `update` learns, and everything that it asks for.

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

/// What happened.
#[derive(Debug)]
pub enum Message {
    /// A key was pressed.
    Key(Key),
    /// The mouse did something. Of several drags that wait, only the newest need come.
    Mouse(Mouse),
    /// Text was pasted; it never fires shortcuts.
    Paste(String),
    /// The terminal has this many columns and rows now.
    Resize([u16; 2]),
    /// The renderer has news.
    Snapshot(Box<Snapshot>),
    /// The picture that was asked for with [`Effect::Keep`], and its samples per pixel.
    Kept(Arc<LinearImage>, f64),
    /// This scene was written to this path, or not, and why. After [`Effect::Save`].
    Saved(Arc<Scene>, Result<PathBuf, SaveError>),
    /// The file was read. After [`Effect::Load`].
    Loaded(Box<Result<Arc<Scene>, SceneErrors>>),
    /// Somebody else has written the file since it was last read or written.
    ChangedOnDisk,
    /// A program that did not end by itself has left unsaved edits of this scene.
    OrphanedEdits(OrphanedEdits),
    /// Something about unsaved edits that the user ought to know.
    Trouble(String),
    /// A picture was written, or not, and why.
    Exported(Result<Exported, String>),
    /// How far the render of [`Effect::ExportSized`] is, 0..=1.
    ExportProgress(f64),
    /// The picture at this path was made ready to be looked at, or not, and why. After [`Effect::Look`].
    ViewerImage(PathBuf, Result<Arc<ViewerImage>, String>),
    /// How much of a picture that is looked at has been sent, 0..=1.
    StillSent(f64),
    /// What is known of the line to the terminal.
    LinkStatus(Option<LinkStatus>),
    /// Time has passed. At least once a second while something on the screen depends on it
    /// ([`Model::wakes_at`](crate::dashboard::model::Model::wakes_at)).
    Tick,
}

/// Unsaved edits of a program that did not end by itself.
#[derive(Clone, Debug, PartialEq)]
pub struct OrphanedEdits {
    /// The scene with the edits.
    pub scene: Arc<Scene>,
    /// How long ago they were kept.
    pub age: Duration,
    /// The scene's file is not what it was then.
    pub changed: bool,
}

/// A picture that was written.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// Where.
    pub path: PathBuf,
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// Mean samples per pixel.
    pub spp: f64,
    /// Estimated RMSE as displayed, in codes, if there is an estimate.
    pub noise_codes: Option<f64>,
    /// `user@host:path` as scp takes it.
    pub scp: String,
}

/// A format of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// As displayed, 8 bits a channel.
    Png,
    /// Linear light.
    Exr,
}

impl Format {
    /// The file name's extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
        }
    }
}

/// What the picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum DisplayChannel {
    /// The picture.
    Beauty,
    /// Estimated error of the tiles, false colour.
    Noise,
    /// Samples per pixel of the tiles, false colour.
    Samples,
    /// Which object is seen.
    Objects,
    /// Normals of the surfaces seen.
    Normals,
    /// Distance from the eye, false colour.
    Depth,
}

impl DisplayChannel {
    /// Every channel, in the order of the key that walks them.
    pub const ALL: [Self; 6] =
        [Self::Beauty, Self::Noise, Self::Samples, Self::Objects, Self::Normals, Self::Depth];

    /// Its name.
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

/// What `update` asks for. Of several of one kind in a row only the last matters, except for saving
/// and exporting.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// Render this scene. Where only light has changed (intensity, colour, on and off, ambient,
    /// background) the samples are kept.
    Show(Arc<Scene>),
    /// The display whose codes the noise is told in.
    Display(Display),
    /// When to stop.
    Stop(Stop),
    /// The picture is painted on this many columns and rows of half cells.
    Raster([usize; 2]),
    /// Stop tracing, or go on.
    Pause(bool),
    /// Begin the picture anew.
    Restart,
    /// Trace with that many threads, at least 1.
    Threads(usize),
    /// Low priority of the tracing threads, or normal.
    LowPriority(bool),
    /// Snapshots tell about this pixel of the film (column, row); `None`: about none.
    Probe(Option<[usize; 2]>),
    /// Tell the picture as it is, for comparison.
    Keep,
    /// Write the scene to its file, or to `path`, which becomes its file.
    Save {
        /// What to write.
        scene: Arc<Scene>,
        /// Where, if not to its own file. Relative to the working directory.
        path: Option<PathBuf>,
        /// Although somebody else has written the file, or there is one at `path` already.
        overwrite: bool,
    },
    /// Read the file.
    Load,
    /// Write the picture as it stands, under the next free name made of the scene's.
    Export(Format),
    /// Render the scene at another size until `stop`, beside the running work, and write it under
    /// the next free name.
    ExportSized {
        /// What to render; its film has the size asked for.
        scene: Arc<Scene>,
        /// The format.
        format: Format,
        /// Exposure and tone curve.
        display: Display,
        /// When it is done.
        stop: Stop,
    },
    /// End the render of `ExportSized`; nothing is written.
    CancelExport,
    /// Keep these unsaved edits where the next start finds them; `None`: there are none any more.
    KeepEdits(Option<Arc<Scene>>),
    /// The edits that were left behind are the unsaved ones of this program now.
    TakeUp,
    /// The edits that were left behind are not wanted.
    Discard,
    /// Make this picture ready to be looked at, on a screen of so many columns and rows.
    Look {
        /// A PNG or an EXR.
        path: PathBuf,
        /// How linear light is shown.
        display: Display,
        /// Columns and rows.
        screen: [u16; 2],
    },
    /// Put the path of this file into the clipboard of the terminal.
    Copy(PathBuf),
    /// Give the terminal to the shell until it calls back.
    Suspend,
    /// End the program.
    Quit,
}
