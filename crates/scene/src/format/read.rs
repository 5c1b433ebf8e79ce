//! Reading of scene files: from text to a validated scene.

use crate::diagnostic::{Diagnostic, FirstDiagnostics, SceneErrors};
use crate::format::parts::{PART_BYTES, Part, split};
use crate::format::schema;
use crate::format::source_map::{line_column, locate};
use crate::process_memory::missing_memory;
use crate::value::{FieldValue, nearest_file, written};
use crate::{AssetResolver, Document, Scene};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;
use toml::de::DeTable;
use toml::{Table, Value};

/// Largest size of a scene file [bytes], which suffices for about four million objects.
pub(crate) const MAX_BYTES: u64 = 256 << 20;

/// Estimated peak memory per byte of a scene file, while its objects are converted for rendering. A
/// million spheres in 53 MB take 768 MB; shorter objects take more per byte.
const SCENE_BYTES: u64 = 20;

impl Scene {
    /// Reads and validates the scene file at `path`. Returns the first 100 errors, with line and
    /// column. If keys or types have errors, values are not validated.
    pub fn read(path: &Path) -> Result<Self, SceneErrors> {
        Document::read(path, Arc::default()).map(Document::into_scene)
    }

    /// Parses and validates a scene. `name` is the file name in diagnostics. The file names in the
    /// scene are relative to its folder. Returns the same errors as [`Scene::read`].
    pub fn parse(text: &str, name: &str) -> Result<Self, SceneErrors> {
        Self::parse_in(text, name, AssetResolver::new(Path::new(name), Arc::default()))
    }

    /// Parses a scene like [`Scene::parse`]; `resolver` reads the files that it refers to.
    pub fn parse_in(text: &str, name: &str, resolver: AssetResolver) -> Result<Self, SceneErrors> {
        SourceScene::parse(text, name, resolver).map(|source| source.scene)
    }
}

/// Valid scene, and the text that describes it.
pub(crate) struct SourceScene<'a> {
    pub scene: Scene,
    name: &'a str,
    text: &'a str,
    parts: Vec<Part>,
}

impl<'a> SourceScene<'a> {
    /// Parses and validates a scene. `name` is the file name in diagnostics.
    pub(crate) fn parse(
        text: &'a str,
        name: &'a str,
        resolver: AssetResolver,
    ) -> Result<Self, SceneErrors> {
        Self::parse_parts(text, name, resolver, split(text, PART_BYTES))
    }

    /// Parses and validates a scene from the `parts` of `text`.
    fn parse_parts(
        text: &'a str,
        name: &'a str,
        resolver: AssetResolver,
        parts: Vec<Part>,
    ) -> Result<Self, SceneErrors> {
        let mut source = Self { scene: Scene::default(), name, text, parts };
        if !source.read_parts()? {
            // Objects outside sections belong to the same list: the file is parsed as a whole.
            return Self::parse_parts(text, name, resolver, vec![Part::whole(text)]);
        }
        source.scene.resolver = resolver;
        source.scene.resolve();
        let (problems, more) = source.scene.check();
        if problems.is_empty() {
            return Ok(source);
        }
        let mut errors = FirstDiagnostics::default();
        locate(text, &source.parts, problems, &mut errors);
        errors.more += more;
        Err(errors.located(name, text))
    }

    /// Reads the parts and checks keys and types. Returns `true` if all parts were read, `false` if
    /// the file has objects outside `[[object]]` sections and must be read as a whole.
    fn read_parts(&mut self) -> Result<bool, SceneErrors> {
        let (name, text) = (self.name, self.text);
        let mut errors = FirstDiagnostics::default();
        let mut syntax: Option<(usize, String)> = None;
        let is_split = self.parts.len() > 1;
        for (number, part) in self.parts.iter().enumerate() {
            let part_text = part.text(text);
            let (root, part_syntax) = DeTable::parse_recoverable(&part_text);
            let start = |error: &toml::de::Error| error.span().map_or(0, |span| span.start);
            if let Some(error) = part_syntax.iter().min_by_key(|error| start(error)) {
                let at = part.in_file(start(error));
                if syntax.as_ref().is_none_or(|(first, _)| at < *first) {
                    syntax = Some((at, error.message().to_string()));
                }
            }
            if syntax.is_some() {
                continue;
            }
            if is_split && number == 0 && root.get_ref().contains_key("object") {
                return Ok(false);
            }
            if !is_split && root.get_ref().is_empty() {
                return Err(SceneErrors::at(
                    name,
                    Some((1, 1)),
                    "the file holds no scene".to_string(),
                    "Expected at least one [[object]]; `zerkalo new FILE` writes a scene to start from.",
                ));
            }
            schema::read(&root, Scene::TYPE, &mut self.scene, part, &mut errors);
        }
        if let Some((at, message)) = syntax {
            let found = format!("this is not TOML: {message}");
            return Err(SceneErrors::at(name, Some(line_column(text, at)), found, ""));
        }
        if !errors.is_empty() {
            return Err(errors.located(name, text));
        }
        self.scene.objects.shrink_to_fit();
        Ok(true)
    }

    /// Returns the warnings about doubtful values, sorted by location.
    pub(crate) fn warnings(&self) -> Vec<Diagnostic> {
        let mut found = FirstDiagnostics::default();
        locate(self.text, &self.parts, self.scene.warnings(), &mut found);
        found.located(self.name, self.text).messages
    }
}

/// Conversion from and to TOML, for types that are tables of scene files.
pub trait TomlText: FieldValue {
    /// Parses the keys and values of one table, without a check of ranges.
    fn from_text(text: &str) -> Result<Self, SceneErrors> {
        let mut value = Self::default();
        let mut errors = FirstDiagnostics::default();
        let root = DeTable::parse(text)
            .map_err(|error| SceneErrors::at("", None, error.message().to_string(), ""))?;
        schema::read(&root, Self::TYPE, &mut value, &Part::whole(text), &mut errors);
        match errors.is_empty() {
            true => Ok(value),
            false => Err(errors.located("", text)),
        }
    }

    /// Converts `self` to a table of a scene file.
    fn to_table(&self) -> Table {
        match written(Self::TYPE, self) {
            Value::Table(table) => table,
            _ => Table::new(),
        }
    }
}

impl<T: FieldValue> TomlText for T {}

/// Returns the text of the scene file at `path`, which was opened as `file`.
pub(crate) fn read_text(path: &Path, file: io::Result<File>) -> Result<String, SceneErrors> {
    let name = path.display().to_string();
    let fail = |found: &str, help: &str| SceneErrors::at(&name, None, found.to_string(), help);
    let io = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => {
            let near = nearest_file(path).map(|near| format!(" Did you mean {near}?"));
            let help = "`zerkalo new FILE` writes a scene to start from.";
            fail("there is no such file", &(help.to_string() + &near.unwrap_or_default()))
        }
        std::io::ErrorKind::PermissionDenied => {
            fail("permission to read the file is denied", "Check who may read it.")
        }
        std::io::ErrorKind::InvalidInput => {
            fail(&error.to_string(), "Expected a scene file (TOML).")
        }
        _ => fail(&format!("the file cannot be read: {error}"), ""),
    };
    let file = file.map_err(io)?;
    let metadata = file.metadata().map_err(io)?;
    if metadata.is_dir() {
        return Err(fail("this is a directory", "Expected a scene file (TOML)."));
    }
    let needed = metadata.len().min(MAX_BYTES).saturating_mul(SCENE_BYTES);
    if let Some(missing) = missing_memory(needed) {
        let help = "Expected fewer objects, or more free memory.";
        return Err(fail(&format!("the scene {missing}"), help));
    }
    let mut bytes = Vec::new();
    // One byte above the limit is read, to notice files that are too large and endless devices.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Object;
    use std::fs;

    /// Parses the scene `text` twice: in parts of one object each, and as a whole. Returns the two
    /// results in this order.
    fn both(text: &str, name: &str) -> [Result<Scene, SceneErrors>; 2] {
        // Both parses use the same cache of assets, because meshes compare as equal only if the
        // file was read once.
        let assets = Arc::default();
        let parse = |parts: Vec<Part>| {
            let resolver = AssetResolver::new(Path::new(name), Arc::clone(&assets));
            let source = SourceScene::parse_parts(text, name, resolver, parts)?;
            // The warnings are compared, too: each becomes the name of an additional object in the
            // scene.
            let warnings: Vec<_> = source.warnings().iter().map(ToString::to_string).collect();
            let mut scene = source.scene;
            scene.objects.extend(warnings.into_iter().map(|name| Object { name, ..ball() }));
            Ok(scene)
        };
        [parse(split(text, 1)), parse(vec![Part::whole(text)])]
    }

    fn ball() -> Object {
        let text = "[[object]]\nshape.sphere = { center = [0, 0, 0], radius = 1 }\n";
        Scene::parse(text, "ball.toml").unwrap().objects.remove(0)
    }

    #[test]
    fn parts_of_a_file_give_the_scene_and_the_errors_of_the_whole() {
        let root = Path::new(env!("ZERKALO_ROOT"));
        for folder in ["scenes/features", "tests/bad-scenes"] {
            let mut count = 0;
            for entry in fs::read_dir(root.join(folder)).unwrap() {
                let path = entry.unwrap().path();
                let is_toml = path.extension().is_some_and(|e| e == "toml");
                let Ok(text) = fs::read_to_string(&path) else { continue };
                if is_toml {
                    let [parts, whole] = both(&text, &path.display().to_string());
                    assert_eq!(parts, whole, "{}", path.display());
                    count += 1;
                }
            }
            assert!(count > 20, "{count} files in {folder}");
        }
    }

    #[test]
    fn parts_agree_with_the_whole_in_special_cases() {
        let ball = "shape.sphere = { center = [0, 0, 0], radius = 1 }\n";
        for text in [
            format!("object = []\n[[object]]\n{ball}"),
            format!("[[object]]\n{ball}[[\"object\"]]\n{ball}"),
            format!("[[object]]\n{ball}[materials.a]\n[object.x]\n"),
            format!("[[object]]\n{ball}[[object]]\nname = 'a\n[[object]]\n{ball}"),
            format!("[[object]]\nradius = 1\n[[object]]\nname = \"b\"\nsize = 2\n{ball}"),
            format!("[[object]]\n{ball}[[object]]\n{ball}material = \"gold\"\n[[object]]\n"),
            format!("[[object]]\n{ball}name = \"a\"\n[[object]]\n{ball}name = \"a\"\n"),
            format!("[[object]]\n{ball}[[object]]\n{}", ball.replace("radius = 1", "radius = -1")),
        ] {
            let [parts, whole] = both(&text, "a.toml");
            assert_eq!(parts, whole, "{text}");
        }
    }

    #[test]
    fn a_hundred_errors_are_reported_and_the_others_counted() {
        let keys = |n: usize| (0..n).map(|i| format!("k{i} = 1\n")).collect::<String>();
        let named = |n: usize| {
            let ball =
                "[[object]]\nname = \"a\"\nshape.sphere = { center = [0, 0, 0], radius = 1 }\n";
            ball.repeat(n)
        };
        let radii =
            |n: usize| named(n).replace("radius = 1", "radius = -1").replace("\"a\"", "\"\"");
        for (text, line) in [(keys(1000), 100), (named(1001), 302), (radii(1000), 300)] {
            let errors = Scene::parse(&text, "a.toml").unwrap_err();
            assert_eq!((errors.messages.len(), errors.more), (100, 900), "{errors}");
            assert_eq!(errors.messages[99].line_column.unwrap().0, line, "{errors}");
            assert!(errors.to_string().ends_with("\n… and 980 more."), "{errors}");
        }
    }

    /// Checks that errors are found in linear time. The scene file has one error in each object. A
    /// file with twice the number of objects takes about twice the time. Errors beyond the reported
    /// ones are only counted.
    #[test]
    fn errors_of_large_files_are_found_in_one_pass() {
        // Each lookup of a line from the beginning of this file would read 2 MB; 20,000 of them
        // would take half a minute.
        let text = "[[object]]\nname = \"a\"\nshape.sphere = { center = [0, 0, 0], radius = 1 }\n";
        let errors = Scene::parse(&text.repeat(20_000), "a.toml").unwrap_err();
        assert_eq!((errors.messages.len(), errors.more), (100, 19_899));
    }
}
