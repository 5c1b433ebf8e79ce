//! What can lie over the panels and take the keys: help, lists, forms, prompts, questions.

use crate::dashboard::editor::Editor;
use crate::scene::Scene;
use crate::scene::edit::Target;
use crate::terminal::image::ViewerImage;
use std::path::PathBuf;
use std::sync::Arc;

/// What lies over the panels.
#[derive(Clone, Debug)]
pub enum Overlay {
    /// All keys: [`help`](crate::dashboard::hints::help).
    Help {
        /// First line shown.
        scroll: usize,
    },
    /// What the compiled scene contains: [`Model::inventory`](crate::dashboard::model::Model::inventory).
    Inventory {
        /// First line shown.
        scroll: usize,
    },
    /// What each quality costs: [`Model::qualities`](crate::dashboard::model::Model::qualities).
    Quality {
        /// Position of the chosen one.
        cursor: usize,
    },
    /// Finds an action by typing.
    Palette(Palette),
    /// One of a list.
    Pick(Pick),
    /// A new object or light, confirmed or cancelled as a whole.
    Form(Form),
    /// A line of text that is asked for.
    Prompt(Prompt),
    /// A question with a few answers.
    Question(Question),
    /// A picture that was written, on the whole screen.
    ViewerImage(ViewedImage),
}

/// A picture that was written, being looked at.
#[derive(Clone, Debug)]
pub struct ViewedImage {
    /// Its file.
    pub path: PathBuf,
    /// The picture; `None`: it is being read.
    pub still: Option<Arc<ViewerImage>>,
    /// How much of its transfer the terminal has been sent, 0..=1.
    pub sent: f64,
}

/// Finds an action by typing.
#[derive(Clone, Debug)]
pub struct Palette {
    /// What is typed.
    pub editor: Editor,
    /// Matching commands, best first: positions in the command table.
    pub found: Vec<usize>,
    /// Position in `found`.
    pub cursor: usize,
    /// First line shown.
    pub scroll: usize,
}

/// One of a list.
#[derive(Clone, Debug)]
pub struct Pick {
    /// What for.
    pub purpose: PickFor,
    /// Heading.
    pub title: String,
    /// Names, and what they mean (may be empty).
    pub entries: Vec<(String, String)>,
    /// Position of the chosen entry.
    pub cursor: usize,
    /// First line shown.
    pub scroll: usize,
}

/// What a choice from a list is for.
#[derive(Clone, Debug, PartialEq)]
pub enum PickFor {
    /// The kind of a new object.
    Object,
    /// The kind of a new light.
    Light,
    /// The word behind a key of a subject.
    Word(Target, String),
}

/// A new object or light. The picture shows the scene with it while the form is open.
#[derive(Clone, Debug)]
pub struct Form {
    /// `new sphere`.
    pub title: String,
    /// The scene with the new thing as filled in so far; without faults.
    pub scene: Arc<Scene>,
    /// The new thing, in `scene`.
    pub subject: Target,
    /// What undoing it will be called.
    pub label: String,
    /// What was selected before.
    pub before: Target,
    /// Position in the lines of the form (`panels::form`).
    pub cursor: usize,
    /// First line shown.
    pub scroll: usize,
    /// The value being typed.
    pub editor: Option<Editor>,
    /// Why the last step was refused.
    pub problem: Option<String>,
}

/// A line of text that is asked for.
#[derive(Clone, Debug)]
pub struct Prompt {
    /// What for.
    pub purpose: PromptFor,
    /// `save as`.
    pub title: String,
    /// What may be typed, in a line.
    pub help: String,
    /// What is typed.
    pub editor: Editor,
}

/// What a typed line is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PromptFor {
    /// A path to save to.
    SaveAs,
    /// A new name.
    Rename(Target),
    /// A name for the viewpoint.
    StoreView,
    /// When to stop.
    StopAt,
    /// Size and format of an export.
    ExportSized,
}

/// A question with a few answers, each with a letter.
#[derive(Clone, Debug)]
pub struct Question {
    /// What is asked, in a sentence or two.
    pub text: String,
    /// Letter, words, what happens. The first is chosen at first.
    pub answers: Vec<(char, String, Answer)>,
    /// Position of the chosen answer.
    pub cursor: usize,
}

/// What an answer does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Nothing.
    Nothing,
    /// Saves, then quits.
    SaveAndQuit,
    /// Quits.
    Quit,
    /// Reads the file; unsaved edits are lost.
    Load,
    /// Writes the file whatever stands there: the scene's own (`None`) or another.
    Overwrite(Option<PathBuf>),
    /// Asks for another name.
    SaveAs,
    /// Takes up the edits that were left behind.
    TakeUp,
    /// Throws them away.
    Discard,
}
