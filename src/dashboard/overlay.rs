//! Overlays of the dashboard: help, lists, forms, prompts and questions. An overlay covers panels
//! and receives the keys.

use crate::dashboard::{Editor, FieldList, UpdateContext};
use std::path::PathBuf;
use std::sync::Arc;
use zerkalo_render::session::QUALITIES;
use zerkalo_scene::Scene;
use zerkalo_scene::edit::Target;
use zerkalo_terminal::image::ViewerImage;

#[derive(Clone, Debug)]
pub enum Overlay {
    /// List of all keys.
    Help {
        scroll: usize,
    },
    /// List of the compiled scene's features.
    Inventory {
        scroll: usize,
    },
    /// List of [`noise_targets`](crate::dashboard::noise_targets).
    NoiseTargets {
        cursor: usize,
    },
    CommandPalette(CommandPalette),
    Pick(Pick),
    Form(Form),
    Prompt(Prompt),
    Question(Question),
    ViewerImage(ViewedImage),
}

impl Overlay {
    /// Returns the cursor, the index of the first visible entry (`None` if the list never scrolls)
    /// and the number of entries. Returns `None` for overlays without a cursor.
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

/// Exported image that the viewer shows, on the whole screen.
#[derive(Clone, Debug)]
pub struct ViewedImage {
    pub path: PathBuf,
    /// Encoded image; `None` while the file is being read and encoded.
    pub image: Option<Arc<ViewerImage>>,
    /// Fraction that the terminal has received, 0..=1.
    pub sent: f64,
}

/// Command palette, which finds commands by fuzzy search.
#[derive(Clone, Debug)]
pub struct CommandPalette {
    pub editor: Editor,
    /// Indices of the matching commands in the command table, best match first.
    pub found: Vec<usize>,
    /// Index in `found`.
    pub cursor: usize,
    pub scroll: usize,
}

/// List from which the user picks an entry.
#[derive(Clone, Debug)]
pub struct Pick {
    pub title: String,
    /// Name and description of each entry.
    pub entries: Vec<(String, String)>,
    pub cursor: usize,
    /// Index of the first visible entry.
    pub scroll: usize,
    /// Function that is called with the name of the picked entry.
    pub(super) take: fn(&mut UpdateContext<'_>, &str),
}

/// Form for a new object or light, which the picture previews, confirmed or cancelled as a whole.
#[derive(Clone, Debug)]
pub struct Form {
    /// Title, such as `new sphere`.
    pub title: String,
    /// Valid scene that includes the new object or light.
    pub scene: Arc<Scene>,
    pub subject: Target,
    /// Label of the undo step.
    pub label: String,
    /// Part of the scene that is selected again if the form is cancelled.
    pub before: Target,
    /// State of the list, whose lines are those of `panel_lines::form`.
    pub fields: FieldList,
    /// Reason why the last change of a field was refused.
    pub problem: Option<String>,
}

/// Prompt in which the user types a line of text.
#[derive(Clone, Debug)]
pub struct Prompt {
    /// Title, such as `save as`.
    pub title: String,
    /// Description of valid text, for the user.
    pub help: String,
    pub editor: Editor,
    /// Function that applies the text, or returns the reason why the text is not valid.
    pub(super) apply: fn(&mut UpdateContext<'_>, &str) -> Result<(), String>,
}

/// Question to the user. Each answer has a letter that chooses it.
#[derive(Clone, Debug)]
pub struct Question {
    pub text: String,
    /// Letter, text and effect of each answer.
    pub answers: Vec<(char, &'static str, Answer)>,
    pub cursor: usize,
}

/// Effect of an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    Nothing,
    SaveAndQuit,
    Quit,
    /// Read the scene file again; unsaved edits are lost.
    Load,
    /// Save over the file at this path; `None` for the scene file.
    Overwrite(Option<PathBuf>),
    SaveAs,
    Recover,
    Discard,
}
