//! The scene files that come with the program, and those that must be refused.

use std::path::{Path, PathBuf};
use zerkalo::scene::{Document, Scene};

fn files(folder: &str) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{folder}: {e}"))
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    paths.sort();
    paths
}

/// Compares `text` with the file at `path`; with ZERKALO_BLESS set writes it there instead.
fn golden(path: &Path, text: &str) {
    if std::env::var_os("ZERKALO_BLESS").is_some() {
        std::fs::write(path, text).unwrap();
        return;
    }
    let stored = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        stored == text,
        "{} is not what the program says now. It says:\n{text}\nIf that is right: \
         ZERKALO_BLESS=1 cargo test --test scene_files",
        path.display()
    );
}

#[test]
fn every_bad_scene_is_refused_with_its_words() {
    let paths = files("tests/bad-scenes");
    assert!(paths.len() >= 40, "only {} bad scenes", paths.len());
    for path in paths {
        let error = match Scene::read(&path) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{} was read without complaint", path.display()),
        };
        let steering =
            |c: &char| c.is_control() && *c != '\n' || ('\u{202a}'..='\u{202e}').contains(c);
        assert_eq!(error.chars().find(steering), None, "{error:?}");
        golden(&path.with_extension("txt"), &(error + "\n"));
    }
}

/// Scenes that are meant to be warned about, and the words of the warning.
const WARNED: &[(&str, &str)] = &[("brighter-than-its-light.toml", "more than the light")];

#[test]
fn every_scene_can_be_read_and_says_what_it_shows() {
    let paths = files("scenes");
    assert!(paths.len() >= 30, "only {} scenes", paths.len());
    for path in paths {
        let document = Document::read(&path).unwrap_or_else(|e| panic!("{e}"));
        let text = document.text();
        assert!(text.starts_with("# "), "{} opens without a comment", path.display());
        let file = path.file_name().unwrap().to_str().unwrap();
        let expected = WARNED.iter().find(|(name, _)| *name == file).map(|(_, words)| *words);
        let warnings: Vec<_> = document.warnings().iter().map(|w| w.to_string()).collect();
        match expected {
            None => assert_eq!(warnings, [] as [&str; 0]),
            Some(words) => {
                assert!(warnings.len() == 1 && warnings[0].contains(words), "{warnings:?}")
            }
        }
        // Scenes that a comment refers to exist.
        for word in text.split('`').filter(|w| w.ends_with(".toml")) {
            assert!(Path::new("scenes").join(word).exists(), "{} names {word}", path.display());
        }
    }
}

#[test]
fn the_reference_is_fresh() {
    golden(Path::new("docs/scene-format.md"), &zerkalo::scene::reference());
}
