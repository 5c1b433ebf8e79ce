//! `zerkalo scenes`: lists, prints and copies built-in scenes. Their names on the command line.

use crate::command::args::ScenesArgs;
use crate::command::{Failure, checked_stdout, print_line};
use crate::dashboard::scene_source::{BUILT_IN, SceneSource};
use std::io::{self, Write};
use std::path::Path;
use zerkalo_scene::disk::{Existing, replace_file};

pub fn run(args: &ScenesArgs) -> Result<(), Failure> {
    let Some(name) = &args.name else {
        let widest = BUILT_IN.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        let row = |(name, text): &(&str, &str)| format!("{name:widest$}  {}", title(text));
        return print_line(&BUILT_IN.iter().map(row).collect::<Vec<_>>().join("\n"));
    };
    let (name, text) = BUILT_IN[by_part_of_name(name.trim_start_matches(':'))?];
    let Some(file) = &args.file else {
        return checked_stdout(io::stdout().write_all(text.as_bytes()));
    };
    replace_file(file, Existing::Refuse, |file| file.write_all(text.as_bytes()))?;
    let file = file.display();
    print_line(&format!("{file} written from {name}; `zerkalo {file}` opens it"))
}

/// Returns the first clause of the comment at the top of a scene file.
fn title(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix("# "));
    let comment = lines.collect::<Vec<_>>().join(" ");
    comment.split([':', '.']).next().unwrap_or_default().to_string()
}

/// Returns the scene that `path` names: `:NAME` is a built-in one, and `NAME` if there is no such file.
pub fn source(path: &Path) -> Result<SceneSource, Failure> {
    let name = path.to_string_lossy();
    if let Some(name) = name.strip_prefix(':') {
        return by_part_of_name(name).map(SceneSource::BuiltIn);
    }
    Ok(match SceneSource::of(name.trim_end_matches(".toml")) {
        built_in @ SceneSource::BuiltIn(_) if !path.exists() => built_in,
        SceneSource::BuiltIn(_) | SceneSource::New | SceneSource::File(_) => {
            SceneSource::File(path.to_path_buf())
        }
    })
}

/// Returns the index of the built-in scene called `name`, or else of the one whose name begins with
/// it or has it as a part.
fn by_part_of_name(name: &str) -> Result<usize, Failure> {
    let rules: [fn(&str, &str) -> bool; 3] = [
        |known, name| known == name,
        |known, name| known.starts_with(name),
        |known, name| known.contains(name),
    ];
    let list = |scenes: &[usize]| {
        scenes.iter().map(|index| BUILT_IN[*index].0).collect::<Vec<_>>().join(", ")
    };
    for fits in rules {
        let all = 0..BUILT_IN.len();
        let found: Vec<_> = all.filter(|index| fits(BUILT_IN[*index].0, name)).collect();
        match found[..] {
            [] => {}
            [one] => return Ok(one),
            [..] => {
                let found = list(&found);
                let message =
                    format!("several built-in scenes have {name} in their names: {found}");
                return Err(Failure::Failed(message));
            }
        }
    }
    let all: Vec<_> = (0..BUILT_IN.len()).collect();
    Err(Failure::Failed(format!("no built-in scene is called {name}; there are {}", list(&all))))
}
