//! Overlays of the dashboard: help, lists, forms, prompts and questions. An overlay covers panels
//! and receives the keys.

use crate::dashboard::editor::Editor;
use crate::dashboard::model::FieldList;
use crate::dashboard::update::UpdateContext;
use std::path::PathBuf;
use std::sync::Arc;
use zerkalo_render::session::QUALITIES;
use zerkalo_scene::Scene;
use zerkalo_scene::edit::Target;
use zerkalo_terminal::image::ViewerImage;

/// Overlay of the dashboard, which covers panels and receives the keys.
#[derive(Clone, Debug)]
pub enum Overlay {
    /// List of all keys and their commands: [`help`](crate::dashboard::hints::help).
    Help {
        /// Index of the first visible line of the help.
        scroll: usize,
    },
    /// List of the compiled scene's features:
    /// [`Model::inventory`](crate::dashboard::model::Model::inventory).
    Inventory {
        /// Index of the first visible line of the inventory.
        scroll: usize,
    },
    /// List of noise targets (noise values at which rendering can stop) with the time to reach each
    /// of them: [`noise_targets`](crate::dashboard::noise_targets).
    NoiseTargets {
        /// Index of the noise target under the cursor.
        cursor: usize,
    },
    /// Command palette: finds commands by fuzzy search.
    CommandPalette(CommandPalette),
    /// List from which the user picks an entry.
    Pick(Pick),
    /// Form for a new object or light, confirmed or cancelled as a whole.
    Form(Form),
    /// Prompt in which the user types a line of text.
    Prompt(Prompt),
    /// Question to the user, with a few answers to choose from.
    Question(Question),
    /// Viewer of an exported image, on the whole screen.
    ViewerImage(ViewedImage),
}

impl Overlay {
    /// Returns the state of the list in the open overlay as three values: the index of the entry
    /// under the cursor, the index of the first visible entry, and the number of entries. The
    /// second value is `None` if the list never scrolls. Returns `None` for overlays without a
    /// cursor.
    pub fn list(&mut self) -> Option<(&mut usize, Option<&mut usize>, usize)> {
        match self {
            Self::NoiseTargets { cursor } => Some((cursor, None, QUALITIES.len())),
            Self::CommandPalette(CommandPalette { cursor, scroll, found, .. }) => {
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

/// Exported image that the viewer shows.
#[derive(Clone, Debug)]
pub struct ViewedImage {
    /// Path of the image file.
    pub path: PathBuf,
    /// Image scaled and encoded for the terminal; `None` while the file is being read and encoded.
    pub image: Option<Arc<ViewerImage>>,
    /// Fraction of the image's bytes that have been sent to the terminal, 0..=1.
    pub sent: f64,
}

/// Command palette, which finds commands by fuzzy search.
#[derive(Clone, Debug)]
pub struct CommandPalette {
    /// Editor of the search text.
    pub editor: Editor,
    /// Indices of the matching commands in the command table, best match first.
    pub found: Vec<usize>,
    /// Index in `found` of the command under the cursor.
    pub cursor: usize,
    /// Index of the first visible line of found commands.
    pub scroll: usize,
}

/// List from which the user picks an entry.
#[derive(Clone, Debug)]
pub struct Pick {
    /// Title of the list of entries.
    pub title: String,
    /// Name and description of each entry. The description may be empty.
    pub entries: Vec<(String, String)>,
    /// Index of the entry under the cursor.
    pub cursor: usize,
    /// Index of the first visible entry of the list.
    pub scroll: usize,
    /// Function that is called with the name of the picked entry.
    pub(super) take: fn(&mut UpdateContext<'_>, &str),
}

/// Form for a new object or light, which the picture previews while the form is open.
#[derive(Clone, Debug)]
pub struct Form {
    /// Title of the form, such as `new sphere`.
    pub title: String,
    /// Valid scene that includes the new object or light.
    pub scene: Arc<Scene>,
    /// New object or light in `scene`.
    pub subject: Target,
    /// Label of the undo step that adds the object or light.
    pub label: String,
    /// Part of the scene that was selected before the form was opened. It is selected again if the
    /// form is cancelled.
    pub before: Target,
    /// Cursor, scroll position and text editor of the form. `panel_lines::form` returns its lines.
    pub fields: FieldList,
    /// Reason why the last change of a field was refused; `None` if it was accepted.
    pub problem: Option<String>,
}

/// Prompt in which the user types a line of text, such as a path.
#[derive(Clone, Debug)]
pub struct Prompt {
    /// Title of the prompt, such as `save as`.
    pub title: String,
    /// Description of valid text, for the user.
    pub help: String,
    /// Editor of the text.
    pub editor: Editor,
    /// Function that applies the text, or returns the reason why the text is not valid.
    pub(super) apply: fn(&mut UpdateContext<'_>, &str) -> Result<(), String>,
}

/// Question to the user, with a few answers. Each answer has a letter that chooses it.
#[derive(Clone, Debug)]
pub struct Question {
    /// Text of the question, one or two sentences.
    pub text: String,
    /// Letter, text and effect of each answer. The cursor starts on the first answer.
    pub answers: Vec<(char, &'static str, Answer)>,
    /// Index of the answer under the cursor.
    pub cursor: usize,
}

/// Effect of the answer that the user chooses for a question.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// No effect except closing the question.
    Nothing,
    /// Save the scene, then end the program.
    SaveAndQuit,
    /// End the program.
    Quit,
    /// Read the scene file again; unsaved edits are lost.
    Load,
    /// Save the scene over the file at this path, or over the scene file if the path is `None`.
    Overwrite(Option<PathBuf>),
    /// Open the prompt for another path to save to.
    SaveAs,
    /// Recover the unsaved edits that a crashed run of the program has left.
    Recover,
    /// Discard the unsaved edits that a crashed run of the program has left.
    Discard,
}
