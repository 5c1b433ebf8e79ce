//! Scene documents: the text of a scene file with its comments, and the scene that it describes.

use crate::asset::Assets;
use crate::diagnostic::{Diagnostic, SceneErrors};
use crate::disk::open_at_once;
use crate::format::patch::rewrite;
use crate::format::read::{SourceScene, read_text};
use crate::{AssetResolver, Scene, TomlText};
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;
use toml_edit::DocumentMut;

/// Text of a scene file and the scene that it describes. An edit changes only the values that it
/// concerns; the rest of the text is kept.
#[derive(Clone, Debug)]
pub struct Document {
    /// File name that diagnostics use.
    pub name: String,
    /// Text and scene as read. Each change starts from a copy of them, so that undoing a removal
    /// restores its comments.
    origin: (Arc<String>, Arc<Scene>),
    /// Warnings about the file as it was read ([`Scene::warnings`]), with line and column.
    pub warnings: Vec<Diagnostic>,
    text: Arc<String>,
    scene: Arc<Scene>,
}

impl Scene {
    /// Returns the text of a new scene file that describes this scene, which must be valid.
    pub fn to_text(&self) -> String {
        new_text(String::new(), &Self::default(), self)
    }
}

impl Document {
    /// Reads and validates the scene file at `path`. Returns the same errors as [`Scene::read`].
    pub fn read(path: &Path, assets: Arc<Assets>) -> Result<Self, SceneErrors> {
        Self::read_opened(path, open_at_once(path), assets)
    }

    /// Reads a scene file like [`Document::read`], once it was opened as `file`.
    ///
    /// # Errors
    /// Returns the same errors as [`Scene::read`].
    pub fn read_opened(
        path: &Path,
        file: io::Result<File>,
        assets: Arc<Assets>,
    ) -> Result<Self, SceneErrors> {
        let name = path.display().to_string();
        Self::parse_in(read_text(path, file)?, &name, AssetResolver::new(path, assets))
    }

    /// Parses and validates a scene. `name` is the file name in diagnostics. Returns the same
    /// errors as [`Scene::read`].
    pub fn parse(text: String, name: &str) -> Result<Self, SceneErrors> {
        Self::parse_in(text, name, AssetResolver::new(Path::new(name), Arc::default()))
    }

    fn parse_in(text: String, name: &str, resolver: AssetResolver) -> Result<Self, SceneErrors> {
        let source =
            SourceScene::parse(&text, name, resolver).map_err(|errors| errors.quoting(&text))?;
        let warnings = source.warnings();
        let scene = Arc::new(source.scene);
        let text = Arc::new(text);
        Ok(Self {
            name: name.to_string(),
            origin: (Arc::clone(&text), Arc::clone(&scene)),
            warnings,
            text,
            scene,
        })
    }

    /// Changes the text so that it describes `scene`, which must be valid.
    pub fn apply(&mut self, scene: &Scene) {
        let (text, old) = &self.origin;
        self.text = match *scene == **old {
            true => Arc::clone(text),
            false => Arc::new(new_text(text.to_string(), old, scene)),
        };
        self.scene = Arc::new(scene.clone());
    }

    /// Removes the comment at the top of the text that an empty line separates from the rest.
    pub fn drop_header(&mut self) {
        let body = |text: &str| {
            let lines = text.split_inclusive('\n').take_while(|line| line.starts_with('#'));
            let header: usize = lines.map(str::len).sum();
            let body = text[header..].trim_start_matches(['\r', '\n']);
            let is_apart = text[header..].trim_start_matches('\r').starts_with('\n');
            Arc::new(if is_apart { body } else { text }.to_string())
        };
        self.origin.0 = body(&self.origin.0);
        self.text = body(&self.text);
    }

    /// Returns the scene that the text describes.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Returns the scene that the text describes, shared with this document.
    pub fn shared_scene(&self) -> Arc<Scene> {
        Arc::clone(&self.scene)
    }

    /// Returns the scene that the text describes. It is copied only if the document has a clone.
    pub fn into_scene(self) -> Scene {
        drop(self.origin);
        Arc::unwrap_or_clone(self.scene)
    }

    /// Returns the text of the scene file.
    pub fn text(&self) -> &str {
        &self.text
    }
}

/// Changes `text`, which describes `old`, so that it describes `new`. Uniform line endings, a byte
/// order mark and a missing line ending at the end are kept; mixed line endings become LF.
fn new_text(text: String, old: &Scene, new: &Scene) -> String {
    let (mark, body) = match text.strip_prefix('\u{feff}') {
        Some(body) => ("\u{feff}", body),
        None => ("", text.as_str()),
    };
    let crlf = body.contains('\n') && body.matches('\n').count() == body.matches("\r\n").count();
    let open_end = !body.is_empty() && !body.ends_with('\n');
    // This cannot fail: the text was parsed before.
    let mut document: DocumentMut = body.replace("\r\n", "\n").parse().expect("text that was read");
    rewrite(&mut document, &old.to_table(), &new.to_table());
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
