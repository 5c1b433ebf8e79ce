//! Overlays: help, lists, forms, prompts and questions. An overlay covers panels and receives the
//! keys.

use crate::dashboard::editor::Editor;
use crate::render::session::QUALITIES;
use crate::scene::Scene;
use crate::scene::edit::Target;
use crate::terminal::image::ViewerImage;
use std::path::PathBuf;
use std::sync::Arc;

/// An overlay, which covers panels and receives the keys.
#[derive(Clone, Debug)]
pub enum Overlay {
    /// List of all keys: [`help`](crate::dashboard::hints::help).
    Help {
        /// First visible line.
        scroll: usize,
    },
    /// Inventory of the compiled scene, a text about its contents:
    /// [`Model::inventory`](crate::dashboard::model::Model::inventory).
    Inventory {
        /// First visible line.
        scroll: usize,
    },
    /// List of noise targets with the time to reach each of them:
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
    /// Returns the cursor, the first visible line (`None` if the overlay never scrolls) and the
    /// number of entries. Returns `None` for overlays without a cursor.
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
    /// The image; `None` while the file is being read.
    pub image: Option<Arc<ViewerImage>>,
    /// Transferred fraction of the image, 0..=1.
    pub sent: f64,
}

/// Command palette, which finds commands by fuzzy search.
#[derive(Clone, Debug)]
pub struct Palette {
    /// Text being typed.
    pub editor: Editor,
    /// Indices of the matching commands in the command table, best match first.
    pub found: Vec<usize>,
    /// Index in `found`.
    pub cursor: usize,
    /// First visible line.
    pub scroll: usize,
}

/// A choice from a list.
#[derive(Clone, Debug)]
pub struct Pick {
    /// Use of the chosen entry.
    pub purpose: PickFor,
    /// Title.
    pub title: String,
    /// Name and description of each entry. The description may be empty.
    pub entries: Vec<(String, String)>,
    /// Index of the entry under the cursor.
    pub cursor: usize,
    /// First visible line.
    pub scroll: usize,
}

/// Purpose of a list from which the user chooses.
#[derive(Clone, Debug, PartialEq)]
pub enum PickFor {
    /// Kind of a new object.
    Object,
    /// Kind of a new light.
    Light,
    /// Value of a key. The fields are the part of the scene with the key, and the key.
    Word(Target, String),
}

/// A form for a new object or light. The picture previews the result while the form is open.
#[derive(Clone, Debug)]
pub struct Form {
    /// Title, such as `new sphere`.
    pub title: String,
    /// Valid scene that includes the new object or light.
    pub scene: Arc<Scene>,
    /// The new object or light in `scene`.
    pub subject: Target,
    /// Label of the undo step that adds the object or light.
    pub label: String,
    /// Selection before the form was opened.
    pub before: Target,
    /// Index of the line under the cursor in the result of `panel_lines::form`.
    pub cursor: usize,
    /// First visible line.
    pub scroll: usize,
    /// Text editor of the field under the cursor, if one is open.
    pub editor: Option<Editor>,
    /// Reason why the last change of a field was refused.
    pub problem: Option<String>,
}

/// A prompt for a line of text.
#[derive(Clone, Debug)]
pub struct Prompt {
    /// Use of the typed text.
    pub purpose: PromptFor,
    /// Title, such as `save as`.
    pub title: String,
    /// Description of valid input.
    pub help: String,
    /// Text being typed.
    pub editor: Editor,
}

/// Purpose of a prompt.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PromptFor {
    /// Path to save to.
    SaveAs,
    /// New name of this target.
    Rename(Target),
    /// Name of a new viewpoint.
    StoreView,
    /// Stop criteria.
    StopAt,
    /// Size and format of an export at another size.
    ExportSized,
}

/// A question with a few answers, each with a letter.
#[derive(Clone, Debug)]
pub struct Question {
    /// Text of the question, one or two sentences.
    pub text: String,
    /// Letter, text and effect of each answer. The cursor starts on the first answer.
    pub answers: Vec<(char, String, Answer)>,
    /// Index of the answer under the cursor.
    pub cursor: usize,
}

/// Effect of an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// No effect except closing the question.
    Nothing,
    /// Save, then quit.
    SaveAndQuit,
    /// Quit.
    Quit,
    /// Read the file; unsaved edits are lost.
    Load,
    /// Overwrite the scene file (`None`) or the file at this path.
    Overwrite(Option<PathBuf>),
    /// Prompt for another path.
    SaveAs,
    /// Recover the orphaned edits.
    Recover,
    /// Discard the orphaned edits.
    Discard,
}
