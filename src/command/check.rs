//! `zerkalo check`: validates a scene and prints its contents.

use crate::command::args::CheckArgs;
use crate::command::{Failure, print_json, print_line, scene_or_errors, warn, warn_of_doubts};
use serde_json::{Value, json};
use zerkalo_render::memory_budget;
use zerkalo_scene::Diagnostic;
use zerkalo_world::{self as world, AnyWorld};

pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let document = match scene_or_errors(&args.scene)? {
        Ok(document) => document,
        Err(errors) => {
            if args.json.json {
                let errors: Vec<_> = errors.messages.iter().map(error_json).collect();
                print_json(&json!({"valid": false, "errors": errors}))?;
            }
            return Err(Failure::Failed(errors.with_excerpts()));
        }
    };
    warn_of_doubts(&document);
    let scene = document.scene();
    let world = AnyWorld::compile(scene, &world::Options::default());
    let size = scene.film.size;
    let sizes = world.info().groups.members.iter().map(|group| group.emitting().len());
    let names = world.info().groups.names(scene).into_iter();
    let with_size = |(name, lights)| match lights {
        0 | 1 => name,
        _ if name == format!("{lights} lights") => name,
        _ => format!("{name} ({lights} lights)"),
    };
    let groups: Vec<String> = names.zip(sizes).map(with_size).collect();
    let mut warnings: Vec<_> = document.warnings.iter().map(ToString::to_string).collect();
    if let Err(reason) = memory_budget::check(size, groups.len(), 0) {
        warn(&format!("warning: {reason}."));
        warnings.push(reason.to_string());
    }
    let info = world.info();
    let bytes = memory_budget::needed(size, groups.len());
    if args.json.json {
        return print_json(&json!({
            "valid": true,
            "scene": args.scene.display().to_string(),
            "size": size,
            "contains": &*info.inventory,
            "lights": groups,
            "memory_bytes": bytes,
            "warnings": warnings,
            "biased": info.biases,
        }));
    }
    let [width, height] = size;
    print_line(&format!("{}: valid", args.scene.display()))?;
    print_line(&format!("  contains  {}", info.inventory))?;
    print_line(&format!("  picture   {width} x {height} pixels"))?;
    print_line(&format!("  lights    {} separate: {}", groups.len(), groups.join(", ")))?;
    print_line(&format!("  memory    {:.0} MB for the samples", (bytes as f64 * 1e-6).max(1.0)))?;
    info.biases.iter().try_for_each(|bias| print_line(&format!("  biased    {bias}")))
}

fn error_json(message: &Diagnostic) -> Value {
    let (line, column) = message.line_column.unzip();
    let Diagnostic { subject, found, help, .. } = message;
    json!({"line": line, "column": column, "subject": subject, "found": found, "help": help})
}
