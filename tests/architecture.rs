//! Guards of the map in ARCHITECTURE.md: which folders of `src` import which others, and which
//! folders use each external crate.

use crate::harness::*;

/// Folders of `src`, each with the folders that it may import. A folder imports only folders below
/// it in this list.
const FOLDERS: &[(&str, &[&str])] = &[
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
            "disk",
            "process_memory",
            "sampling",
            "lanes",
        ],
    ),
    (
        "dashboard",
        &[
            "terminal", "render", "world", "scene", "shape", "material", "asset", "light",
            "camera", "value", "film", "disk", "sampling", "lanes",
        ],
    ),
    ("terminal", &[]),
    ("measure", &["render", "world", "scene", "material", "film", "sampling"]),
    (
        "render",
        &[
            "world",
            "scene",
            "material",
            "camera",
            "value",
            "film",
            "disk",
            "process_memory",
            "sampling",
            "lanes",
        ],
    ),
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
    (
        "scene",
        &[
            "shape",
            "primitive",
            "material",
            "asset",
            "light",
            "camera",
            "value",
            "disk",
            "process_memory",
        ],
    ),
    ("shape", &["primitive", "asset", "value", "lanes"]),
    ("material", &["asset", "value", "sampling", "lanes"]),
    ("light", &["asset", "value", "sampling", "lanes"]),
    ("asset", &["primitive", "value", "disk", "process_memory"]),
    ("primitive", &["bvh", "lanes"]),
    ("bvh", &["lanes"]),
    ("camera", &["value", "lanes"]),
    ("film", &["value", "disk", "lanes"]),
    ("value", &[]),
    ("disk", &[]),
    ("process_memory", &[]),
    ("sampling", &["lanes"]),
    ("lanes", &[]),
];

/// External crates, each with the folders that may use it.
const CRATES: &[(&str, &[&str])] = &[
    ("base64", &["asset", "terminal"]),
    ("bytemuck", &["asset"]),
    ("clap", &["command"]),
    ("colorous", &["terminal"]),
    ("crc32fast", &["film"]),
    ("crossbeam_channel", &["render", "dashboard", "terminal"]),
    ("crossterm", &["terminal"]),
    ("csv", &["command"]),
    ("exr", &["asset", "film"]),
    ("gltf", &["asset"]),
    ("icy_sixel", &["terminal"]),
    ("indicatif", &["command"]),
    ("nucleo_matcher", &["dashboard"]),
    ("plotters", &["measure"]),
    ("ply_rs_bw", &["asset"]),
    ("png", &["asset", "film"]),
    ("ratatui", &["dashboard", "terminal"]),
    ("rayon", &["render"]),
    // `scene` uses rustix in tests only.
    ("rustix", &["render", "dashboard", "terminal", "process_memory", "scene", "disk"]),
    ("safe_arch", &["lanes"]),
    ("serde", &["command", "measure"]),
    ("serde_json", &["command"]),
    ("signal_hook", &["command", "dashboard"]),
    ("stl_io", &["asset"]),
    ("strsim", &["scene"]),
    // `asset` uses tempfile in tests only.
    ("tempfile", &["film", "disk", "command", "scene", "dashboard", "asset"]),
    ("toml", &["scene", "shape", "material", "light", "camera", "value"]),
    ("tobj", &["asset"]),
    ("toml_edit", &["scene"]),
    ("tui_input", &["dashboard"]),
    ("unicode_width", &["dashboard", "terminal"]),
    ("vte", &["terminal"]),
    ("wide", &["lanes"]),
    ("zune_jpeg", &["asset"]),
];

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

/// Returns the folder of a file under `src`. `main.rs` counts as a folder of its own; `lib.rs`
/// belongs to none.
fn folder_of(path: &Path) -> Option<String> {
    let inside = path.strip_prefix("src").ok()?;
    let first = inside.iter().next()?.to_str()?;
    let folder = first.strip_suffix(".rs").unwrap_or(first);
    (folder != "lib").then(|| folder.to_string())
}

/// Returns `text` without comments and string literals, which contain no imports.
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
            // Character literals that contain a quotation mark or an escape.
            '\'' if chars.peek() == Some(&'"') => drop(chars.next()),
            '\'' if chars.peek() == Some(&'\\') => drop(chars.nth(1)),
            _ => code.push(c),
        }
    }
    code
}

/// Returns the first path segment after each `prefix`, such as `crate::`. For a group in braces,
/// returns the first segments of all its members.
fn first_names(code: &str, prefix: &str) -> BTreeSet<String> {
    let name = |text: &str| {
        text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    let mut names = BTreeSet::new();
    for (position, _) in code.match_indices(prefix) {
        let before = code[..position].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':' || c == '$') {
            continue;
        }
        let after = &code[position + prefix.len()..];
        let Some(group) = after.strip_prefix('{') else {
            names.insert(name(after));
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
fn imported_names_are_found() {
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
fn allowed_imports_run_one_way() {
    for (i, (folder, allowed)) in FOLDERS.iter().enumerate() {
        for imported in *allowed {
            let j = FOLDERS.iter().position(|(f, _)| f == imported);
            assert!(
                j.is_some_and(|j| j > i),
                "`{folder}` -> `{imported}` is unknown or runs upwards"
            );
        }
    }
}

#[test]
fn folders_import_only_what_the_map_allows() {
    let mut wrong = Vec::new();
    for (path, text) in files("src") {
        let Some(folder) = folder_of(&path) else { continue };
        let Some((_, allowed)) = FOLDERS.iter().find(|(f, _)| *f == folder) else {
            wrong.push(format!("{}: the folder `{folder}` is not on the map", path.display()));
            continue;
        };
        let code = code(&text);
        let prefix = if folder == "main" { "zerkalo::" } else { "crate::" };
        for imported in first_names(&code, prefix) {
            if imported != folder && !allowed.contains(&imported.as_str()) {
                wrong.push(format!("{}: `{folder}` may not import `{imported}`", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn crates_are_used_only_where_the_map_allows() {
    let mut wrong = Vec::new();
    for (path, text) in files("src") {
        let Some(folder) = folder_of(&path) else { continue };
        let code = code(&text);
        for (name, allowed) in CRATES {
            // A sibling module of the same name (`film::png`) shadows the crate.
            let module = path.parent().unwrap().join(format!("{name}.rs"));
            let is_module = Path::new(env!("CARGO_MANIFEST_DIR")).join(module).exists();
            let used = !first_names(&code, &format!("{name}::")).is_empty()
                || code.contains(&format!("use {name};"));
            if used && !is_module && !allowed.contains(&folder.as_str()) {
                wrong.push(format!("{}: `{folder}` may not use `{name}`", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_guarded_crate_is_a_dependency() {
    let manifest = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")).unwrap();
    for (name, _) in CRATES {
        let is_dependency = manifest.lines().any(|line| {
            let key = line.split([' ', '=']).next().unwrap_or_default();
            key.replace('-', "_") == *name
        });
        assert!(is_dependency, "`{name}` is guarded here but not in Cargo.toml");
    }
}
