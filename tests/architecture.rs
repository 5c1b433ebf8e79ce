//! The map of the rooms in ARCHITECTURE.md, held: who may import whom, which room knows which crate,
//! and how long a file may be.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Every room and what it may import, from left to right: nothing looks left.
const ROOMS: &[(&str, &[&str])] = &[
    ("main", &["command"]),
    (
        "command",
        &[
            "dashboard",
            "terminal",
            "measure",
            "render",
            "world",
            "scene",
            "shape",
            "primitive",
            "material",
            "asset",
            "light",
            "camera",
            "value",
            "film",
            "sampling",
            "lanes",
        ],
    ),
    (
        "dashboard",
        &[
            "terminal", "render", "world", "scene", "shape", "material", "asset", "light",
            "camera", "value", "film", "sampling", "lanes",
        ],
    ),
    ("terminal", &["value", "film"]),
    ("measure", &["render", "world", "scene", "material", "film", "sampling"]),
    ("render", &["world", "scene", "material", "camera", "value", "film", "sampling", "lanes"]),
    (
        "world",
        &[
            "scene",
            "shape",
            "primitive",
            "bvh",
            "material",
            "asset",
            "light",
            "camera",
            "value",
            "sampling",
            "lanes",
        ],
    ),
    ("scene", &["shape", "primitive", "material", "asset", "light", "camera", "value"]),
    ("shape", &["primitive", "asset", "value", "lanes"]),
    ("primitive", &["asset", "bvh", "value", "lanes"]),
    ("material", &["asset", "value", "sampling", "lanes"]),
    ("asset", &["bvh", "value"]),
    ("bvh", &["lanes"]),
    ("light", &["value", "lanes"]),
    ("camera", &["value", "lanes"]),
    ("value", &[]),
    ("film", &["lanes"]),
    ("sampling", &["lanes"]),
    ("lanes", &[]),
];

/// Crates that only some rooms know.
const CRATES: &[(&str, &[&str])] = &[
    ("base64", &["asset", "terminal"]),
    ("clap", &["command"]),
    ("colorous", &["terminal"]),
    ("crossbeam_channel", &["render", "dashboard", "terminal"]),
    ("crossterm", &["terminal"]),
    ("csv", &["command"]),
    ("epaint_default_fonts", &["measure"]),
    ("exr", &["film"]),
    ("gltf", &["asset"]),
    ("icy_sixel", &["terminal"]),
    ("image", &["asset"]),
    ("indicatif", &["command"]),
    ("nucleo_matcher", &["dashboard"]),
    ("obvhs", &["asset", "bvh", "primitive", "world"]),
    ("plotters", &["measure"]),
    ("ply_rs_bw", &["asset"]),
    ("png", &["film"]),
    ("ratatui", &["dashboard", "terminal"]),
    ("rayon", &["render"]),
    ("rustix", &["render", "dashboard", "terminal"]),
    ("safe_arch", &["lanes"]),
    ("serde", &["command", "scene", "shape", "primitive", "material", "light", "camera", "value"]),
    ("serde_json", &["command"]),
    ("signal_hook", &["command", "dashboard"]),
    ("stl_io", &["asset"]),
    // In `asset` only tests do.
    ("tempfile", &["film", "command", "scene", "dashboard", "asset"]),
    // Descriptions read their own examples in tests.
    ("toml", &["scene", "shape", "material", "light", "camera", "value"]),
    ("tobj", &["asset"]),
    ("toml_edit", &["scene"]),
    ("tui_input", &["dashboard"]),
    ("unicode_width", &["dashboard", "terminal"]),
    ("vte", &["terminal"]),
    ("wide", &["lanes"]),
];

/// Every Rust file under `folder`, with its text.
fn files(folder: &str) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join(folder)];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for path in entries.map(|e| e.unwrap().path()) {
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = fs::read_to_string(&path).unwrap();
                files.push((path.strip_prefix(root).unwrap().to_path_buf(), text));
            }
        }
    }
    files.sort();
    files
}

/// The room that a file under `src` belongs to; `lib.rs` belongs to none.
fn room(path: &Path) -> Option<String> {
    let inside = path.strip_prefix("src").ok()?;
    let first = inside.iter().next()?.to_str()?;
    let room = first.strip_suffix(".rs").unwrap_or(first);
    (room != "lib").then(|| room.to_string())
}

/// The text without comments and strings, in which names would be no imports.
fn code(text: &str) -> String {
    let mut code = String::new();
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '/' if chars.peek() == Some(&'/') => {
                chars.by_ref().find(|c| *c == '\n');
                code.push('\n');
            }
            '"' => {
                while let Some(c) = chars.next() {
                    match c {
                        '\\' => drop(chars.next()),
                        '"' => break,
                        _ => {}
                    }
                }
                code.push_str("\"\"");
            }
            // Characters that would look like the beginning of a string or of an escape in one.
            '\'' if chars.peek() == Some(&'"') => drop(chars.next()),
            '\'' if chars.peek() == Some(&'\\') => drop(chars.nth(1)),
            _ => code.push(c),
        }
    }
    code
}

/// The first names after each `prefix` (`crate::`): one, or those of a group in braces.
fn first_names(code: &str, prefix: &str) -> BTreeSet<String> {
    let name = |text: &str| {
        text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let mut names = BTreeSet::new();
    for (at, _) in code.match_indices(prefix) {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
            continue;
        }
        let rest = &code[at + prefix.len()..];
        let Some(group) = rest.strip_prefix('{') else {
            names.insert(name(rest));
            continue;
        };
        let mut depth = 0;
        let mut start = 0;
        for (i, c) in group.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth > 0 => depth -= 1,
                ',' | '}' if depth == 0 => {
                    names.insert(name(&group[start..i]));
                    start = i + 1;
                    if c == '}' {
                        break;
                    }
                }
                _ => {}
            }
        }
    }
    names.remove("");
    names
}

#[test]
fn names_are_found_where_they_import() {
    let source = r#"
        use crate::film::{Film, Mix};  // crate::comment
        use crate::{lanes, scene::{Scene, light}, value::Color};
        fn f() -> crate::world::AnyWorld { "crate::string"; '"'; my_crate::no() }
    "#;
    let found = first_names(&code(source), "crate::");
    let expected = ["film", "lanes", "scene", "value", "world"].map(String::from);
    assert_eq!(found, BTreeSet::from(expected));
}

#[test]
fn the_map_has_no_way_back() {
    for (i, (room, may)) in ROOMS.iter().enumerate() {
        for other in *may {
            let j = ROOMS.iter().position(|(r, _)| r == other);
            assert!(j.is_some_and(|j| j > i), "`{room}` -> `{other}` looks left or nowhere");
        }
    }
}

#[test]
fn rooms_import_only_what_the_map_allows() {
    let mut wrong = Vec::new();
    for (path, text) in files("src") {
        let Some(room) = room(&path) else { continue };
        let Some((_, may)) = ROOMS.iter().find(|(r, _)| *r == room) else {
            wrong.push(format!("{}: the room `{room}` is not on the map", path.display()));
            continue;
        };
        let code = code(&text);
        let prefix = if room == "main" { "zerkalo::" } else { "crate::" };
        for other in first_names(&code, prefix) {
            if other != room && !may.contains(&other.as_str()) {
                wrong.push(format!("{}: `{room}` may not import `{other}`", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn crates_are_known_only_where_the_map_says() {
    let mut wrong = Vec::new();
    for (path, text) in files("src") {
        let Some(room) = room(&path) else { continue };
        let code = code(&text);
        for (name, rooms) in CRATES {
            // A module of the same name inside the room (`film::png`) is not the crate.
            let own = path.parent().unwrap().join(format!("{name}.rs"));
            let is_module = Path::new(env!("CARGO_MANIFEST_DIR")).join(own).exists();
            let used = !first_names(&code, &format!("{name}::")).is_empty()
                || code.contains(&format!("use {name};"));
            if used && !is_module && !rooms.contains(&room.as_str()) {
                wrong.push(format!("{}: `{room}` may not know `{name}`", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_guarded_crate_is_a_dependency() {
    let manifest = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).unwrap();
    for (name, _) in CRATES {
        let known = manifest.lines().any(|line| {
            let key = line.split([' ', '=']).next().unwrap_or_default();
            key.replace('-', "_") == *name
        });
        assert!(known, "`{name}` is guarded here but not in Cargo.toml");
    }
}
