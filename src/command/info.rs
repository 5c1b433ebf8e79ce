//! `zerkalo info`: prints the origin of a picture or film file, and compares it with a scene.

use crate::command::args::InfoArgs;
use crate::command::load_progress::LoadReporter;
use crate::command::{Failure, print_line};
use crate::film::FileMetadata;
use crate::render::SampleInputs;
use crate::render::export::scene_hash;
use crate::scene::Document;
use std::path::Path;

pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let metadata = FileMetadata::read(&args.file).map_err(Failure::Failed)?;
    let [width, height] = metadata.size;
    let groups = metadata.film.as_ref().map(|film| film.group_names.join(", "));
    let first = format!("{}: {}, {width} x {height} pixels", args.file.display(), metadata.format);
    print_line(&first)?;
    let groups = groups.map(|names| ("Light groups".to_string(), names));
    let widest = metadata.entries.iter().map(|(key, _)| key.len()).max().unwrap_or(0);
    for (key, value) in metadata.entries.iter().chain(&groups) {
        print_line(&format!("  {key:widest$}  {value}"))?;
    }
    match &args.scene {
        Some(path) => compare(&metadata, path, args),
        None => Ok(()),
    }
}

/// Compares the file with the scene at `path`.
fn compare(metadata: &FileMetadata, path: &Path, args: &InfoArgs) -> Result<(), Failure> {
    let document = Document::read_with(path, LoadReporter::new().assets)
        .map_err(|e| Failure::Failed(e.to_string()))?;
    let scene = document.scene();
    let [file, shown] = [&args.file, path].map(|path| path.display());
    let Some(hash) = metadata.get("Scene hash") else {
        let what = format!("{file} has no scene hash; zerkalo did not write it");
        return Err(Failure::Failed(what));
    };
    if hash == scene_hash(document.text(), scene) {
        return print_line(&format!(
            "scene: {shown} and the files that it names are those of {file}"
        ));
    }
    // The size is an option of `render`.
    let mut sized = scene.clone();
    sized.film.size = metadata.size.map(|n| n as u32);
    let inputs = metadata.film.as_ref().and_then(SampleInputs::of);
    match inputs.map(|inputs| inputs.fit(&sized)) {
        Some(true) => print_line(&format!(
            "scene: the pictures of {shown} and {file} differ in light weights, names or layout of \
             the text only; --resume keeps the samples"
        )),
        _ => Err(Failure::Failed(format!("{file} shows another scene than {shown} describes"))),
    }
}
