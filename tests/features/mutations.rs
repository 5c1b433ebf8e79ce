//! Mutations of the source code, which must make the test of a feature fail. `mutate.sh` runs them;
//! the test here checks that they still apply to the source.

use crate::harness::*;

/// Mutation of the source code: replacement of one expression.
pub struct Mutation {
    /// Name of the test that must fail with the mutation.
    pub test: String,
    /// Path of the source file that is changed.
    pub file: String,
    /// Source text around the expression, which is in guillemets.
    replace: String,
    /// Expression of the same type that replaces the original one.
    by: String,
}

/// Returns all mutations by file name. Each file begins with a description after `#` and has one
/// line for each of `test`, `file`, `replace` and `by`.
pub fn all() -> BTreeMap<String, Mutation> {
    let folder = Path::new(env!("ZERKALO_ROOT")).join("tests/features/mutations");
    let read = |path: std::path::PathBuf| {
        let name = path.file_name().unwrap().to_str().unwrap().to_string();
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("# "), "{name} has no description");
        let value = |key: &str| {
            let mut lines = text.lines().filter_map(|l| l.strip_prefix(key)?.strip_prefix(' '));
            let first = lines.next().unwrap_or_else(|| panic!("{name} has no line `{key}`"));
            assert!(lines.next().is_none(), "{name} has two lines `{key}`");
            first.to_string()
        };
        let [test, file, replace, by] = ["test", "file", "replace", "by"].map(value);
        (name, Mutation { test, file, replace, by })
    };
    fs::read_dir(&folder).unwrap().map(|entry| read(entry.unwrap().path())).collect()
}

#[test]
fn every_mutation_applies_to_the_source() {
    let all = all();
    assert!(all.len() >= 30, "only {}", all.len());
    for (name, m) in all {
        let source = fs::read_to_string(Path::new(env!("ZERKALO_ROOT")).join(&m.file));
        let source = source.unwrap_or_else(|e| panic!("{name}: {}: {e}", m.file));
        let parts: Vec<&str> = m.replace.split(['«', '»']).collect();
        assert_eq!(parts.len(), 3, "{name}: `{}` needs one pair of guillemets", m.replace);
        let text = parts.concat();
        let found = source.matches(&text).count();
        assert_eq!(found, 1, "{name}: `{text}` occurs {found} times in {}", m.file);
        assert_ne!(parts[1], m.by, "{name}");
    }
}
