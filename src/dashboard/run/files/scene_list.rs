//! Scenes that can be opened: recent files, files in the folder, built-in scenes.

use crate::dashboard::scene_source::BUILT_IN;
use std::fs;
use std::path::{Path, PathBuf};

/// Number of recent files that are kept.
const RECENT: usize = 9;

/// Returns names for [`SceneSource::of`](crate::dashboard::SceneSource::of), each with a note.
/// `folder` is that of the present scene file, `state` the state folder of the user.
pub fn names(folder: Option<&Path>, state: Option<&Path>) -> Vec<(String, &'static str)> {
    let mut names: Vec<(String, &'static str)> = Vec::new();
    let mut add = |path: &Path, note| {
        let name = path.strip_prefix("./").unwrap_or(path).display().to_string();
        if !names.iter().any(|(known, _)| *known == name) {
            names.push((name, note));
        }
    };
    recent(state).iter().for_each(|path| add(path, "recent"));
    for folder in folder.into_iter().chain([Path::new("."), Path::new("scenes")]) {
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut files: Vec<_> = entries.map(|entry| entry.path()).collect();
        files.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
        files.sort();
        files.iter().for_each(|path| add(path, "file"));
    }
    BUILT_IN.iter().for_each(|(name, _)| add(Path::new(name), "built in"));
    names
}

/// Returns the recent files that still exist, relative to the working directory if they are in it.
fn recent(state: Option<&Path>) -> Vec<PathBuf> {
    let text = state.and_then(|state| fs::read_to_string(list(state)).ok()).unwrap_or_default();
    let here = std::env::current_dir().unwrap_or_default();
    let paths = text.lines().map(PathBuf::from).filter(|path| path.is_file());
    paths.map(|path| path.strip_prefix(&here).map_or(path.clone(), Path::to_path_buf)).collect()
}

/// Puts the scene file at `path` first in the list of recent files. An error is ignored: the list is
/// a convenience.
pub fn remember(path: &Path, state: &Path) {
    let Ok(path) = std::path::absolute(path) else { return };
    let path = path.display().to_string();
    let old = fs::read_to_string(list(state)).unwrap_or_default();
    let others = old.lines().filter(|line| *line != path).take(RECENT - 1);
    let lines: Vec<_> = [path.as_str()].into_iter().chain(others).collect();
    let _ = fs::create_dir_all(state).and_then(|()| fs::write(list(state), lines.join("\n")));
}

fn list(state: &Path) -> PathBuf {
    state.join("recent")
}

/// Returns the paths in `folder` that begin with `text`, in order. Those of folders end with a slash.
pub fn paths(folder: &Path, text: &str) -> Vec<String> {
    let (parent, begun) = text.split_at(text.rfind('/').map_or(0, |slash| slash + 1));
    let place = Path::new(".").join(folder).join(parent);
    let entries = fs::read_dir(place).into_iter().flatten().flatten();
    let named = entries.filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        let is_wanted = name.starts_with(begun) && name.starts_with('.') == begun.starts_with('.');
        let slash = if entry.path().is_dir() { "/" } else { "" };
        is_wanted.then(|| format!("{parent}{name}{slash}"))
    });
    let mut paths: Vec<_> = named.collect();
    paths.sort();
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_begin_with_the_typed_text() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("meshes")).unwrap();
        for name in ["meshes/duck.obj", "meshes/dune.obj", "meshes/.duck", "mesh.obj"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let paths = |text| paths(folder.path(), text).join(" ");
        assert_eq!(paths("me"), "mesh.obj meshes/");
        assert_eq!(paths("meshes/du"), "meshes/duck.obj meshes/dune.obj");
        assert_eq!([paths("nowhere/d"), paths("x")], ["", ""]);
    }
}
