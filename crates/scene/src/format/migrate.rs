//! Migration of scene files. Keys and values that were renamed since earlier versions of the format
//! are called former words. Reading treats a former word like the present word; saving writes the
//! present word.

use crate::Acceleration;
use crate::diagnostic::{Diagnostic, FirstDiagnostics};
use crate::format::parts::Part;
use crate::format::source_map::{line_column, subject_in};
use toml::Spanned;
use toml::de::{DeTable, DeValue};
use toml_edit::{DocumentMut, Item, Key};

/// Key or value that was renamed: `(former name, current name)`.
type Pair = (&'static str, &'static str);

const SCENE: &[Pair] = &[("views", "cameras")];
const TRACE: &[Pair] = &[
    ("depth", "max_depth"),
    ("min_weight", "min_throughput"),
    ("level", "ray_types"),
    ("horizon", "below_horizon"),
];
const MATERIAL: &[Pair] = &[("index", "ior"), ("reflectance", "f0")];
const SHAPE: &[Pair] = &[("unit_cylinder", "unit_frustum")];

/// Returns the renamed keys of the table at `path` in a scene file, each as `(former name, current
/// name)`.
fn keys_at(path: &[String]) -> &'static [Pair] {
    match path {
        [] => SCENE,
        [trace] if trace == "trace" => TRACE,
        [materials, _] if materials == "materials" => MATERIAL,
        [object, .., shape] if object == "object" && shape == "shape" => SHAPE,
        _ => &[],
    }
}

/// Returns `(key, pairs)` for the table at `path` in a scene file. `key` is the key of this table
/// whose values were renamed. Each pair is `(former value, current value)`. Returns `None` if no
/// values in this table were renamed.
fn values_at(path: &[String]) -> Option<(&'static str, Vec<Pair>)> {
    match path {
        [film] if film == "film" => Some(("filter", vec![("center", "point")])),
        [trace] if trace == "trace" => {
            let pair = |a: Acceleration| Some((a.former_name()?, a.name()));
            Some(("acceleration", Acceleration::ALL.into_iter().filter_map(pair).collect()))
        }
        _ => None,
    }
}

/// Use of a former name of a key or value in a scene file.
#[derive(Clone, Debug)]
pub(crate) struct FormerWord {
    /// Byte offset of the former name in the file.
    pub start: usize,
    /// Path of keys to the table that contains the former name. All keys of the path are current
    /// names.
    pub table: Vec<String>,
    /// Key that has the former name as its value; `None` if the former name is itself a key.
    key: Option<&'static str>,
    former: &'static str,
    present: &'static str,
}

/// Replaces the former words in `root` by the current ones and returns them. A former word is a key
/// or value that was renamed since an earlier version of the scene format. The current word gets
/// the byte range of the former one. `root` is the parsed `part` of the file with the text `text`.
/// Adds an error to `errors` for each table that has a key under both names.
pub(crate) fn migrate(
    text: &str,
    root: &mut DeTable,
    part: &Part,
    errors: &mut FirstDiagnostics,
) -> Vec<FormerWord> {
    let mut migration =
        Migration { part, path: Vec::new(), words: Vec::new(), conflicts: Vec::new() };
    migration.table(root);
    for (FormerWord { start, table, former, present, .. }, other) in &migration.conflicts {
        errors.add(*start, || {
            let (line, column) = line_column(text, *other);
            Diagnostic {
                subject: subject_in(root, table, part.first_object),
                found: format!("`{former}` is the former name of `{present}`, which is given, too"),
                help: format!("Expected only `{present}`, at {line}:{column}."),
                ..Diagnostic::default()
            }
        });
    }
    migration.words
}

struct Migration<'a> {
    part: &'a Part,
    path: Vec<String>,
    words: Vec<FormerWord>,
    /// Keys that a table has under both names, each with the byte offset of the current name in the
    /// file.
    conflicts: Vec<(FormerWord, usize)>,
}

impl Migration<'_> {
    fn table(&mut self, table: &mut DeTable) {
        for (former, present) in keys_at(&self.path) {
            self.key(table, former, present);
        }
        if let Some((key, pairs)) = values_at(&self.path) {
            self.value(table, key, &pairs);
        }
        for (key, value) in table.iter_mut() {
            if matches!(value.get_ref(), DeValue::Table(_) | DeValue::Array(_)) {
                self.path.push(key.get_ref().to_string());
                match value.get_mut() {
                    DeValue::Table(table) => self.table(table),
                    DeValue::Array(list) => self.entries(list),
                    _ => {}
                }
                self.path.pop();
            }
        }
    }

    fn entries(&mut self, list: &mut [Spanned<DeValue>]) {
        let first = self.part.first_index(&self.path);
        for (i, entry) in (first..).zip(list) {
            if let DeValue::Table(table) = entry.get_mut() {
                self.path.push(i.to_string());
                self.table(table);
                self.path.pop();
            }
        }
    }

    fn key(&mut self, table: &mut DeTable, former: &'static str, present: &'static str) {
        let Some((key, value)) = table.remove_entry(former) else { return };
        let start = self.part.in_file(key.span().start);
        let word = FormerWord { start, table: self.path.clone(), key: None, former, present };
        if let Some((other, _)) = table.get_key_value(present) {
            self.conflicts.push((word, self.part.in_file(other.span().start)));
        } else {
            self.words.push(word);
            table.insert(Spanned::new(key.span(), present.into()), value);
        }
    }

    fn value(&mut self, table: &mut DeTable, key: &'static str, pairs: &[Pair]) {
        let Some(value) = table.get_mut(key) else { return };
        let start = self.part.in_file(value.span().start);
        if let DeValue::String(word) = value.get_mut()
            && let Some(&(former, present)) = pairs.iter().find(|(former, _)| former == word)
        {
            *word = present.into();
            let table = self.path.clone();
            self.words.push(FormerWord { start, table, key: Some(key), former, present });
        }
    }
}

/// Returns the warning that a file has `count` former words (obsolete names of keys or values). It
/// quotes the first of them, which is given with the name of its table in diagnostics. `file` and
/// `text` are name and text of the file.
pub(crate) fn warning(
    (file, text): (&str, &str),
    (first, subject): &(FormerWord, String),
    count: usize,
) -> Diagnostic {
    let FormerWord { former, present, .. } = first;
    let name = match first.key {
        Some(key) => format!("`{key} = \"{former}\"` is now called `{key} = \"{present}\"`"),
        None => format!("`{former}` is now called `{present}`"),
    };
    let (count, help) = match count {
        1 => (String::new(), "Saving writes the new name."),
        n => (format!(" ({n} former names in this file)"), "Saving writes the new names."),
    };
    Diagnostic {
        file: file.to_string(),
        line_column: Some(line_column(text, first.start)),
        subject: subject.clone(),
        found: name + &count,
        help: help.to_string(),
    }
}

/// Replaces the former names `words` in `document` by the current ones. Order, layout and comments
/// are kept.
pub(crate) fn write_present(document: &mut DocumentMut, words: &[FormerWord]) {
    for word in words {
        let table = word.table.iter().try_fold(document.as_item_mut(), |item, key| {
            if item.is_table_like() {
                item.get_mut(key)
            } else {
                item.get_mut(key.parse::<usize>().ok()?)
            }
        });
        let Some(table) = table else { continue };
        match word.key {
            None => rename_key(table, word.former, word.present),
            Some(key) => {
                if let Some(value) = table.get_mut(key).and_then(Item::as_value_mut) {
                    let decor = value.decor().clone();
                    *value = word.present.into();
                    *value.decor_mut() = decor;
                }
            }
        }
    }
}

/// Renames the key `former` of `table`. The order of the entries is kept.
fn rename_key(table: &mut Item, former: &str, present: &str) {
    let renamed = |key: Key| {
        if key.get() != former {
            return key;
        }
        let decor = (key.leaf_decor().clone(), key.dotted_decor().clone());
        Key::new(present).with_leaf_decor(decor.0).with_dotted_decor(decor.1)
    };
    let Some(table) = table.as_table_like_mut() else { return };
    let names: Vec<String> = table.iter().map(|(name, _)| name.to_string()).collect();
    for name in names {
        let key = table.key(&name).cloned();
        if let (Some(key), Some(value)) = (key, table.remove(&name)) {
            table.entry_format(&renamed(key)).or_insert(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Document, Scene};

    /// Scene file of an earlier version with every key and value that was renamed since. The keys
    /// are written as table headers, as dotted keys and in inline tables.
    const FORMER: &str = r##"# A scene of an earlier version.
film = { filter = "center", size = [64, 48] } # small
ambient.color = [0.5, 0.5, 0.5]

[trace] # how far
depth = 7 # deep
min_weight = 0.01
level = "shadows"
# What dips.
horizon = "absorb"
acceleration = "hierarchy" # a tree

[views.left] # from the left
eye = [1.0, 2.0, 3.0]
target = [0.0, 0.0, 0.0]

# The other side.
[views.right]
eye = [4.0, 2.0, 3.0]
target = [0.0, 0.0, 0.0]

[materials]
glass = { diffuse = 0.0, transmission = 1.0, index = 1.3, roughness = 0.1 } # bends
[materials.index]
reflectance = [0.5, 0.25, 0.125] # a name, and a key
color = "#804020"

[[object]]
shape.unit_cylinder.s = 0.5 # narrow
material = "index"

[[object]]
material = "glass"
shape.union.of = [
    # first
    { shape.sphere = { center = [0.0, 0.0, 0.0], radius = 1.0 } },
    { shape.unit_cylinder = { s = 0.25 }, material = "index" }, # second
]
"##;

    const PAIRS: [(&str, &str); 10] = [
        ("views", "cameras"),
        ("\ndepth", "\nmax_depth"),
        ("min_weight", "min_throughput"),
        ("\nlevel", "\nray_types"),
        ("\nhorizon", "\nbelow_horizon"),
        ("\"hierarchy\"", "\"bvh\""),
        ("\"center\"", "\"point\""),
        ("index = 1.3", "ior = 1.3"),
        ("reflectance", "f0"),
        ("unit_cylinder", "unit_frustum"),
    ];

    fn present() -> String {
        PAIRS
            .iter()
            .fold(FORMER.to_string(), |text, (former, present)| text.replace(former, present))
    }

    #[test]
    fn former_words_read_as_the_present_ones() {
        let former = Document::parse(FORMER.to_string(), "old.toml").unwrap();
        assert_eq!(former.text(), FORMER, "reading leaves the text alone");
        let present = Document::parse(present(), "new.toml").unwrap();
        assert_eq!(former.scene(), present.scene());
        assert_eq!(present.warnings(), []);
        let warnings: Vec<_> = former.warnings().iter().map(|w| w.to_string()).collect();
        let expected = "old.toml:2:19  film: `filter = \"center\"` is now called \
                        `filter = \"point\"` (11 former names in this file).\n\
                        \x20              Saving writes the new names.";
        assert_eq!(warnings, [expected]);
    }

    #[test]
    fn saving_writes_present_words_and_keeps_comments_and_order() {
        let mut document = Document::parse(FORMER.to_string(), "old.toml").unwrap();
        let scene: Scene = document.scene().clone();
        document.apply(&scene);
        assert_eq!(document.text(), present());
        let mut edited = scene.clone();
        edited.trace.max_depth = 3;
        document.apply(&edited);
        assert_eq!(document.text(), present().replace("max_depth = 7", "max_depth = 3"));
        document.apply(&scene);
        assert_eq!(document.text(), present());
    }

    #[test]
    fn one_former_word_is_named_alone() {
        let text = "ambient.color = [1, 1, 1]\n[[object]]\nname = \"glass\"\nshape.unit_cylinder = { s = 0.5 }\n";
        let document = Document::parse(text.to_string(), "old.toml").unwrap();
        assert_eq!(
            document.warnings()[0].to_string(),
            "old.toml:4:7  object \"glass\": `unit_cylinder` is now called `unit_frustum`.\n\
             \x20             Saving writes the new name."
        );
    }

    #[test]
    fn former_and_present_key_together_are_an_error() {
        for (text, expected) in [
            (
                "[materials.glass]\nior = 1.5\nroughness = 0.1\nindex = 1.3\n",
                "old.toml:4:1  material \"glass\": `index` is the former name of `ior`, which is \
                 given, too.\n              Expected only `ior`, at 2:1.",
            ),
            (
                "[views.a]\ntarget = [0, 0, 0]\n[cameras.b]\ntarget = [0, 0, 0]\n",
                "old.toml:1:2  `views` is the former name of `cameras`, which is given, too.\n\
                 \x20             Expected only `cameras`, at 3:2.",
            ),
        ] {
            let errors = Document::parse(text.to_string(), "old.toml").unwrap_err();
            assert_eq!(errors.to_string(), expected);
        }
    }

    #[test]
    fn diagnostics_point_into_the_file_as_it_is() {
        let text = "materials.glass = { index = 1.5, roughness = -1.0 }\n";
        let errors = Document::parse(text.to_string(), "old.toml").unwrap_err();
        assert!(errors.to_string().starts_with("old.toml:1:46  material \"glass\""), "{errors}");
    }

    #[test]
    fn acceleration_opens_under_every_former_name() {
        for (former, present) in super::values_at(&["trace".to_string()]).unwrap().1 {
            let read = |name: &str| {
                let text = format!("trace.acceleration = \"{name}\"\n");
                Scene::parse(&text, "old.toml").unwrap()
            };
            assert_eq!(read(former), read(present), "{former}");
        }
    }
}
