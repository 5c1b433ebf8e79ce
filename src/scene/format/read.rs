//! Reading of scene files: text to validated scene.

use crate::scene::diagnostic::{Diagnostic, SceneErrors};
use crate::scene::format::migrate::{self, FormerWord, migrate};
use crate::scene::format::schema;
use crate::scene::format::source_map::{line_column, with_locations};
use crate::scene::{AssetResolver, Scene};
use serde::Deserialize;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, Deserializer};

/// Largest scene file that is read [bytes]. A file of this size has some hundred thousand objects.
const MAX_BYTES: u64 = 64 << 20;

impl Scene {
    /// Reads and validates the scene file at `path`.
    ///
    /// # Errors
    /// All errors, with line and column: not readable, not UTF-8, not TOML, unknown keys, wrong
    /// types, values out of range, undefined names. Values are validated only if keys and types are
    /// right.
    pub fn read(path: &Path) -> Result<Self, SceneErrors> {
        let resolver = AssetResolver::new(path, Arc::default());
        read_text(path, |path| File::open(path))
            .and_then(|t| Self::parse_in(&t, &path.display().to_string(), resolver))
    }

    /// Parses and validates a scene from `text`. `name` is the file name in diagnostics; file names
    /// in the scene are relative to the folder of `name`.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneErrors> {
        Self::parse_in(text, name, AssetResolver::new(Path::new(name), Arc::default()))
    }

    /// Parses and validates a scene like [`Scene::parse`]. `resolver` reads the files that the
    /// scene refers to.
    pub(crate) fn parse_in(
        text: &str,
        name: &str,
        resolver: AssetResolver,
    ) -> Result<Self, SceneErrors> {
        SourceScene::parse(text, name, resolver).map(|source| source.scene)
    }
}

/// A valid scene and the parsed text that describes it, so that the text is parsed once and the
/// scene validated once.
pub(crate) struct SourceScene<'a> {
    pub scene: Scene,
    pub former_words: Vec<FormerWord>,
    name: &'a str,
    text: &'a str,
    root: Spanned<DeTable<'a>>,
}

impl<'a> SourceScene<'a> {
    /// Parses and validates a scene from `text`. `name` is the file name in diagnostics.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub(crate) fn parse(
        text: &'a str,
        name: &'a str,
        resolver: AssetResolver,
    ) -> Result<Self, SceneErrors> {
        let (mut root, syntax) = DeTable::parse_recoverable(text);
        let start = |error: &toml::de::Error| error.span().map_or(0, |span| span.start);
        if let Some(error) = syntax.iter().min_by_key(|error| start(error)) {
            let line_column = Some(line_column(text, start(error)));
            let found = format!("this is not TOML: {}", error.message());
            return Err(SceneErrors::at(name, line_column, found, ""));
        }
        if root.get_ref().is_empty() {
            return Err(SceneErrors::at(
                name,
                Some((1, 1)),
                "the file holds no scene".to_string(),
                "Expected at least one [[object]]; `zerkalo new FILE` writes a scene to start from.",
            ));
        }
        let (former_words, mut errors) = migrate(name, text, root.get_mut());
        errors.extend(schema::check(name, text, &root));
        if !errors.is_empty() {
            return Err(SceneErrors::new(errors));
        }
        let mut scene = Scene::deserialize(Deserializer::from(root.clone())).map_err(|error| {
            let line_column = error.span().map(|span| line_column(text, span.start));
            SceneErrors::at(name, line_column, error.message().to_string(), "")
        })?;
        scene.resolver = resolver;
        scene.resolve();
        match scene.faults() {
            problems if problems.is_empty() => Ok(Self { scene, former_words, name, text, root }),
            problems => Err(SceneErrors::new(with_locations(name, text, root.get_ref(), problems))),
        }
    }

    /// Returns the lints of the scene and the warning about former words, sorted by location.
    pub(crate) fn warnings(&self) -> Vec<Diagnostic> {
        let (name, text, root) = (self.name, self.text, self.root.get_ref());
        let mut warnings = with_locations(name, text, root, self.scene.warnings());
        warnings.extend(self.migration_warning());
        warnings.sort_by_key(|warning| warning.line_column);
        warnings
    }

    /// Returns the warning about former words; `None` if the file has none.
    pub(crate) fn migration_warning(&self) -> Option<Diagnostic> {
        migrate::warning(self.name, self.text, self.root.get_ref(), &self.former_words)
    }
}

/// Returns the text of the scene file at `path`, which `open` opens.
pub(crate) fn read_text(
    path: &Path,
    open: impl Fn(&Path) -> io::Result<File>,
) -> Result<String, SceneErrors> {
    let name = path.display().to_string();
    let fail = |found: &str, help: &str| SceneErrors::of_file(&name, found.to_string(), help);
    let io = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            fail("there is no such file", "`zerkalo new FILE` writes a scene to start from.")
        }
        std::io::ErrorKind::PermissionDenied => {
            fail("permission to read the file is denied", "Check who may read it.")
        }
        std::io::ErrorKind::InvalidInput => {
            fail(&error.to_string(), "Expected a scene file (TOML).")
        }
        _ => fail(&format!("the file cannot be read: {error}"), ""),
    };
    let file = open(path).map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(fail("this is a directory", "Expected a scene file (TOML)."));
    }
    let mut bytes = Vec::new();
    // Reading stops one byte above the limit: this byte shows that a file is too large, and an
    // endless device is not read for ever.
    file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(io)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(fail(
            &format!("the file is larger than {} MiB", MAX_BYTES >> 20),
            "Expected a scene file (TOML).",
        ));
    }
    String::from_utf8(bytes).map_err(|error| {
        let good = error.utf8_error().valid_up_to();
        let bytes = error.as_bytes();
        let text = String::from_utf8_lossy(&bytes[..good]);
        SceneErrors::at(
            &name,
            Some(line_column(&text, good)),
            format!("this is not UTF-8 text: byte 0x{:02x}", bytes[good]),
            "Expected a scene file (TOML), saved as UTF-8.",
        )
    })
}
