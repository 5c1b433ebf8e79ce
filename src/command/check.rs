//! `zerkalo check`: validates a scene and prints its contents.

use crate::command::args::CheckArgs;
use crate::command::{Failure, print_json, print_line, scene_or_errors, warn, warn_of_doubts};
use serde::Serialize;
use zerkalo_render::memory_budget;
use zerkalo_scene::Diagnostic;
use zerkalo_world::{self as world, AnyWorld};

/// Results of `--json`. docs/command-line.md describes the keys.
#[derive(Serialize)]
struct Checked<'a> {
    valid: bool,
    scene: String,
    size: [u32; 2],
    contains: &'a str,
    lights: &'a [String],
    memory_bytes: u64,
    warnings: Vec<String>,
    biased: &'a [String],
}

/// Results of `--json` for a scene with errors.
#[derive(Serialize)]
struct Invalid<'a> {
    valid: bool,
    errors: Vec<SceneError<'a>>,
}

#[derive(Serialize)]
struct SceneError<'a> {
    line: Option<usize>,
    column: Option<usize>,
    subject: &'a str,
    found: &'a str,
    help: &'a str,
}

impl<'a> SceneError<'a> {
    fn of(message: &'a Diagnostic) -> Self {
        let (line, column) = message.line_column.unzip();
        let Diagnostic { subject, found, help, .. } = message;
        Self { line, column, subject, found, help }
    }
}

pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let document = match scene_or_errors(&args.scene)? {
        Ok(document) => document,
        Err(errors) => {
            if args.json.json {
                let errors = errors.messages.iter().map(SceneError::of).collect();
                print_json(&Invalid { valid: false, errors })?;
            }
            return Err(Failure::Failed(errors.with_excerpts()));
        }
    };
    warn_of_doubts(&document);
    let scene = document.scene();
    let world = AnyWorld::compile(scene, &world::Options::default());
    let size = scene.film.size;
    let groups = world.info().groups.names(scene);
    let mut warnings: Vec<_> = document.warnings.iter().map(ToString::to_string).collect();
    if let Err(reason) = memory_budget::check(size, groups.len(), 0) {
        warn(&format!("warning: {reason}."));
        warnings.push(reason.to_string());
    }
    let checked = Checked {
        valid: true,
        scene: args.scene.display().to_string(),
        size,
        contains: &world.info().inventory,
        lights: &groups,
        memory_bytes: memory_budget::needed(size, groups.len()),
        warnings,
        biased: &world.info().biases,
    };
    if args.json.json {
        return print_json(&checked);
    }
    let Checked { scene, size: [width, height], contains, memory_bytes, .. } = &checked;
    print_line(&format!("{scene}: valid"))?;
    print_line(&format!("  contains  {contains}"))?;
    print_line(&format!("  picture   {width} x {height} pixels"))?;
    print_line(&format!("  lights    {} separate: {}", groups.len(), groups.join(", ")))?;
    let megabytes = (*memory_bytes as f64 * 1e-6).max(1.0);
    print_line(&format!("  memory    {megabytes:.0} MB for the samples"))?;
    checked.biased.iter().try_for_each(|bias| print_line(&format!("  biased    {bias}")))
}
