//! Overlays over the panels, which take the keys: help, lists, forms, prompts, questions.

use crate::dashboard::editor::Editor;
use crate::render::session::QUALITIES;
use crate::scene::Scene;
use crate::scene::edit::Target;
use crate::terminal::image::ViewerImage;
use std::path::PathBuf;
use std::sync::Arc;

/// An overlay.
#[derive(Clone, Debug)]
pub enum Overlay {
    /// All keys: [`help`](crate::dashboard::hints::help).
    Help {
        /// First visible line.
        scroll: usize,
    },
    /// Inventory of the compiled scene:
    /// [`Model::inventory`](crate::dashboard::model::Model::inventory).
    Inventory {
        /// First visible line.
        scroll: usize,
    },
    /// Noise targets and the time to each:
    /// [`Model::noise_targets`](crate::dashboard::model::Model::noise_targets).
    NoiseTargets {
        /// Index of the target under the cursor.
        cursor: usize,
    },
    /// Command palette: finds commands by fuzzy search.
    Palette(Palette),
    /// A choice from a list.
    Pick(Pick),
    /// A new object or light, confirmed or cancelled as a whole.
    Form(Form),
    /// A prompt for a line of text.
    Prompt(Prompt),
    /// A question with a few answers.
    Question(Question),
    /// Viewer of an exported image, on the whole screen.
    ViewerImage(ViewedImage),
}

impl Overlay {
    /// Cursor, first visible line and length of a list; `None` for other overlays.
    pub fn list(&mut self) -> Option<(&mut usize, Option<&mut usize>, usize)> {
        match self {
            Self::NoiseTargets { cursor } => Some((cursor, None, QUALITIES.len())),
            Self::Palette(Palette { cursor, scroll, found, .. }) => {
                Some((cursor, Some(scroll), found.len()))
            }
            Self::Pick(Pick { cursor, scroll, entries, .. }) => {
                Some((cursor, Some(scroll), entries.len()))
            }
            Self::Question(Question { cursor, answers, .. }) => Some((cursor, None, answers.len())),
            _ => None,
        }
    }
}

/// An exported image in the viewer.
#[derive(Clone, Debug)]
pub struct ViewedImage {
    /// Path of the file.
    pub path: PathBuf,
    /// The image; `None` while it is read.
    pub image: Option<Arc<ViewerImage>>,
    /// Transferred share, 0..=1.
    pub sent: f64,
}

/// Command palette: finds commands by fuzzy search.
#[derive(Clone, Debug)]
pub struct Palette {
    /// Text being typed.
    pub editor: Editor,
    /// Matching commands, best first: positions in the command table.
    pub found: Vec<usize>,
    /// Index in `found`.
    pub cursor: usize,
    /// First visible line.
    pub scroll: usize,
}

/// A choice from a list.
#[derive(Clone, Debug)]
pub struct Pick {
    /// Purpose.
    pub purpose: PickFor,
    /// Title.
    pub title: String,
    /// Names and descriptions (may be empty).
    pub entries: Vec<(String, String)>,
    /// Index of the entry under the cursor.
    pub cursor: usize,
    /// First visible line.
    pub scroll: usize,
}

/// Purpose of a choice from a list.
#[derive(Clone, Debug, PartialEq)]
pub enum PickFor {
    /// Kind of a new object.
    Object,
    /// Kind of a new light.
    Light,
    /// Value of a key of a target.
    Word(Target, String),
}

/// A new object or light. The picture previews it while the form is open.
#[derive(Clone, Debug)]
pub struct Form {
    /// Title: `new sphere`.
    pub title: String,
    /// Valid scene that includes the new object or light.
    pub scene: Arc<Scene>,
    /// The new object or light in `scene`.
    pub subject: Target,
    /// Label of its undo step.
    pub label: String,
    /// Previous selection.
    pub before: Target,
    /// Line of the cursor (`panel_lines::form`).
    pub cursor: usize,
    /// First visible line.
    pub scroll: usize,
    /// Editor of the field under the cursor.
    pub editor: Option<Editor>,
    /// Reason why the last step was refused.
    pub problem: Option<String>,
}

/// A prompt for a line of text.
#[derive(Clone, Debug)]
pub struct Prompt {
    /// Purpose.
    pub purpose: PromptFor,
    /// Title: `save as`.
    pub title: String,
    /// One-line description of valid input.
    pub help: String,
    /// Text being typed.
    pub editor: Editor,
}

/// Purpose of a prompt.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PromptFor {
    /// Path to save to.
    SaveAs,
    /// New name.
    Rename(Target),
    /// Name of a viewpoint.
    StoreView,
    /// Stop criteria.
    StopAt,
    /// Size and format of an export.
    ExportSized,
}

/// A question with a few answers, each with a letter.
#[derive(Clone, Debug)]
pub struct Question {
    /// Question, in a sentence or two.
    pub text: String,
    /// Letter, text and effect of each answer. The cursor starts on the first.
    pub answers: Vec<(char, String, Answer)>,
    /// Index of the answer under the cursor.
    pub cursor: usize,
}

/// Effect of an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// None.
    Nothing,
    /// Save, then quit.
    SaveAndQuit,
    /// Quit.
    Quit,
    /// Read the file; unsaved edits are lost.
    Load,
    /// Overwrite the scene file (`None`) or another one.
    Overwrite(Option<PathBuf>),
    /// Prompt for another path.
    SaveAs,
    /// Recover the orphaned edits.
    Recover,
    /// Discard the orphaned edits.
    Discard,
}
