//! Check of the table in docs/features.md: it has every row, and all files and tests that it names
//! exist.

use crate::features::mutations;
use crate::harness::*;

/// Returns the names of the rows of docs/features.md: A1 to A19, B1 to B15, C1 to C4, D1 to D16, E1
/// to E3.
fn expected() -> BTreeSet<String> {
    let rows = |letter: char, last: u32| (1..=last).map(move |n| format!("{letter}{n}"));
    let last_rows = [('A', 19), ('B', 15), ('C', 4), ('D', 16), ('E', 3)];
    last_rows.into_iter().flat_map(|(letter, last)| rows(letter, last)).collect()
}

fn root() -> PathBuf {
    PathBuf::from(env!("ZERKALO_ROOT"))
}

/// Returns the texts between backticks in a cell of a Markdown table.
fn quoted(cell: &str) -> Vec<&str> {
    cell.split('`').skip(1).step_by(2).collect()
}

/// Returns the names of the tests in this folder.
fn tests() -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for entry in fs::read_dir(root().join("tests/features")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "rs") {
            continue;
        }
        let text = fs::read_to_string(path).unwrap();
        let after = text.split("#[test]\nfn ").skip(1);
        names.extend(after.map(|text| text[..text.find('(').unwrap()].to_string()));
    }
    names
}

#[test]
fn every_row_has_scene_test_source_and_mutation() {
    let text = fs::read_to_string(root().join("docs/features.md")).unwrap();
    let tests = tests();
    let mutations = mutations::all();
    let mut rows = BTreeSet::new();
    let mut named = BTreeSet::new();
    for line in text.lines().filter(|l| l.starts_with("| ") && !l.starts_with("| row")) {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
        let [row, description, scenes, test, sources, mutation] = cells[..] else {
            panic!("not six cells: {line}");
        };
        assert!(rows.insert(row.to_string()), "{row} appears twice");
        assert!(description.len() > 10, "{row} has no description");
        assert!(!quoted(scenes).is_empty(), "{row} has no scene");
        for scene in quoted(scenes) {
            assert!(shipped_path(scene).exists(), "{row}: no scene {scene}");
        }
        let [test] = quoted(test)[..] else { panic!("{row}: not one test") };
        let prefix = row.to_lowercase() + "_";
        assert!(test.starts_with(&prefix), "{row}: {test} is not named after it");
        assert!(tests.contains(test), "{row}: no test {test}");
        assert!(!quoted(sources).is_empty(), "{row} has no source");
        for source in quoted(sources) {
            assert!(Path::new(&root()).join(source).is_file(), "{row}: no source {source}");
        }
        assert!(mutation.len() > 10, "{row} has no mutation");
        for file in quoted(mutation) {
            let m = mutations.get(file).unwrap_or_else(|| panic!("{row}: no mutation {file}"));
            assert_eq!(m.test, test, "{row}: {file} belongs to another test");
            named.insert(file.to_string());
        }
    }
    assert_eq!(rows, expected(), "rows of the table");
    for (file, m) in &mutations {
        assert!(named.contains(file), "{file} is in no row");
        assert!(tests.contains(&m.test), "{file}: no test {}", m.test);
    }
}
