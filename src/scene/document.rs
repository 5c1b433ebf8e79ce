//! A scene file as text with its comments, beside the scene that it describes.

use crate::asset::Assets;
use crate::scene::diagnostic::{Diagnostic, SceneErrors};
use crate::scene::format::migrate::{FormerWord, write_present};
use crate::scene::format::patch::rewrite;
use crate::scene::format::read::{SourceScene, read_text};
use crate::scene::{AssetResolver, Scene};
use std::path::Path;
use std::sync::Arc;
use toml_edit::DocumentMut;

/// A scene file: its text, and the scene that it describes. Edits of the scene change only those
/// values in the text that differ; comments, order and layout of everything else stay.
#[derive(Clone, Debug)]
pub struct Document {
    name: String,
    /// As read. Every edit starts from here, so that what is undone comes back with its comments.
    origin: (String, Scene),
    /// Words of earlier versions in the text as read.
    former_words: Vec<FormerWord>,
    /// Warnings about the text as read.
    warnings: Vec<Diagnostic>,
    text: String,
    scene: Scene,
}

impl Document {
    /// Reads and checks the scene file at `path`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read(path: &Path) -> Result<Self, SceneErrors> {
        Self::read_with(path, Arc::default())
    }

    /// As [`Document::read`]; what the files hold that the scene names is remembered in `assets`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read_with(path: &Path, assets: Arc<Assets>) -> Result<Self, SceneErrors> {
        let name = path.display().to_string();
        read_text(path)
            .and_then(|text| Self::parse_in(text, &name, AssetResolver::of(path, assets)))
    }

    /// Reads and checks a scene from `text`; messages call it `name`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: String, name: &str) -> Result<Self, SceneErrors> {
        Self::parse_in(text, name, AssetResolver::of(Path::new(name), Arc::default()))
    }

    fn parse_in(text: String, name: &str, library: AssetResolver) -> Result<Self, SceneErrors> {
        let source = SourceScene::parse(&text, name, library)?;
        let warnings = source.warnings();
        let (scene, former_words) = (source.scene, source.former_words);
        Ok(Self {
            name: name.to_string(),
            origin: (text.clone(), scene.clone()),
            former_words,
            warnings,
            text,
            scene,
        })
    }

    /// A new file for `scene`, which has no faults; messages call it `name`.
    pub fn new(scene: &Scene, name: &str) -> Self {
        let text = new_text(String::new(), &[], &Scene::default(), scene);
        Self {
            name: name.to_string(),
            origin: (text.clone(), scene.clone()),
            former_words: Vec::new(),
            warnings: Vec::new(),
            text,
            scene: scene.clone(),
        }
    }

    /// Makes the text describe `scene`, which has no faults.
    pub fn apply(&mut self, scene: &Scene) {
        let (text, old) = &self.origin;
        self.text = if scene == old && self.former_words.is_empty() {
            text.clone()
        } else {
            new_text(text.clone(), &self.former_words, old, scene)
        };
        self.scene = scene.clone();
    }

    /// The same document under another name.
    pub(super) fn renamed(mut self, name: &str) -> Self {
        self.name = name.to_string();
        self
    }

    /// What messages call the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The scene that the text describes.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The text, as it stands in the file.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Warnings about the file as it was read, in its order: [`Scene::warnings`] with file, line and
    /// column, and one about words of earlier versions.
    pub fn warnings(&self) -> &[Diagnostic] {
        &self.warnings
    }
}

/// `text`, which describes `old`, made to describe `new`. Line ends stay what they are if they are
/// all alike (a mixture becomes LF); a byte order mark and a missing line end at the end of the
/// file stay.
fn new_text(text: String, former_words: &[FormerWord], old: &Scene, new: &Scene) -> String {
    let (mark, body) = match text.strip_prefix('\u{feff}') {
        Some(body) => ("\u{feff}", body),
        None => ("", text.as_str()),
    };
    let crlf = body.contains('\n') && body.matches('\n').count() == body.matches("\r\n").count();
    let open_end = !body.is_empty() && !body.ends_with('\n');
    // The text was read as a scene, and a scene has no value that TOML lacks: neither can fail.
    let mut document: DocumentMut = body.replace("\r\n", "\n").parse().expect("text that was read");
    let tree = |scene| toml::Table::try_from(scene).expect("a scene is a TOML table");
    write_present(&mut document, former_words);
    rewrite(&mut document, &tree(old), &tree(new));
    let mut body = document.to_string();
    if body.starts_with("\n[") {
        body.remove(0);
    }
    if open_end && body.ends_with('\n') {
        body.pop();
    }
    if crlf {
        body = body.replace('\n', "\r\n");
    }
    mark.to_string() + &body
}
