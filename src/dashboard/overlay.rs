//! Overlays of the dashboard: lists, forms, prompts and questions. An overlay covers panels
//! and receives the keys.

use crate::dashboard::{Editor, FieldList, ListCursor, UpdateContext};
use std::path::PathBuf;
use std::sync::Arc;
use zerkalo_render::session::QUALITIES;
use zerkalo_scene::Scene;
use zerkalo_scene::edit::{Target, Word};
use zerkalo_terminal::image::ViewerImage;

#[derive(Clone, Debug)]
pub enum Overlay {
    /// List of [`noise_targets`](crate::dashboard::noise_targets).
    NoiseTargets(ListCursor),
    Pick(Pick),
    Form(Form),
    Prompt(Prompt),
    Question(Question),
    ViewerImage(ViewedImage),
}

impl Overlay {
    /// Returns the cursor and the number of entries; `None` for overlays without a list of entries.
    pub fn list(&mut self) -> Option<(&mut ListCursor, usize)> {
        match self {
            Self::NoiseTargets(at) => Some((at, QUALITIES.len())),
            Self::Pick(pick) => Some((&mut pick.at, pick.found.len())),
            Self::Question(question) => Some((&mut question.at, question.answers.len())),
            Self::Form(_) | Self::Prompt(_) | Self::ViewerImage(_) => None,
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
    /// `true` if the terminal stores the file instead of showing it.
    pub downloads: bool,
}

/// List of commands, kinds or values, from which the user picks one. A search filters it.
#[derive(Clone, Debug)]
pub struct Pick {
    pub title: String,
    pub entries: Vec<PickEntry>,
    /// Editor of the search text.
    pub editor: Editor,
    /// Indices of the `entries` that match the search text, best match first.
    pub found: Vec<usize>,
    /// Cursor in `found`.
    pub at: ListCursor,
    /// `true` if the text may also be a command, such as `set roughness 0.3`.
    pub takes_commands: bool,
    /// Function that is called with the name of the picked entry.
    pub(super) take: fn(&mut UpdateContext<'_>, &str),
}

#[derive(Clone, Debug)]
pub struct PickEntry {
    pub name: String,
    /// Description of a kind or value, or chapter of a command; may be empty.
    pub note: String,
    /// Keys of a command; empty for other entries.
    pub keys: String,
    /// Other words by which the search finds the entry.
    pub also: String,
    /// `true` if a search lists the entry after others that match as well.
    pub comes_late: bool,
}

impl From<Word> for PickEntry {
    fn from(Word { name, doc }: Word) -> Self {
        Self::new(name, &doc)
    }
}

impl PickEntry {
    pub fn new(name: String, note: &str) -> Self {
        let (keys, also) = (String::new(), String::new());
        Self { name, note: note.to_string(), keys, also, comes_late: false }
    }
}

/// Form for a new object or light, which the picture previews. The user confirms or cancels the
/// form as a whole.
#[derive(Clone, Debug)]
pub struct Form {
    /// Title, such as `new sphere`.
    pub title: String,
    /// Valid scene that includes the new object or light.
    pub scene: Arc<Scene>,
    pub target: Target,
    /// Label of the undo step.
    pub label: String,
    /// State of the list, whose lines are those of `panel_lines::form`.
    pub fields: FieldList,
}

/// Prompt in which the user types a line of text.
#[derive(Clone, Debug)]
pub struct Prompt {
    /// Title, such as `save as`.
    pub title: String,
    /// Description of valid text, for the user.
    pub help: String,
    pub editor: Editor,
    pub takes_path: bool,
    /// Function that applies the text, or returns the reason why the text is not valid.
    pub(super) apply: fn(&mut UpdateContext<'_>, &str) -> Result<(), String>,
}

/// Question to the user. Each answer has a letter that chooses it.
#[derive(Clone, Debug)]
pub struct Question {
    pub text: String,
    pub(super) answers: Vec<Answer>,
    pub at: ListCursor,
}

/// Answer to a question: its letter, its text, and the function that carries it out.
pub(super) type Answer = (char, &'static str, fn(&mut UpdateContext<'_>));
