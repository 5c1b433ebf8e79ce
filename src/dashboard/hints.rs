//! Texts derived from the command table: hint line, help and docs/keys.md.

use crate::dashboard::panel_lines::ListLine;
use crate::dashboard::update::commands::{COMMANDS, Hint, HintLine};
use crate::dashboard::{KeyContext, Model, Overlay};

/// Line of the help: keys with the contexts in which they work, and the command's label.
pub type HelpLine = ListLine<(String, &'static str)>;

/// Returns the state that selects the hints. Returns `None` under an exported image, which leaves
/// no room for a hint line.
fn hint_line(model: &Model) -> Option<HintLine> {
    Some(match &model.overlay {
        Some(Overlay::Help { .. }) => HintLine::Reading,
        Some(Overlay::Pick(_) | Overlay::NoiseTargets(_) | Overlay::Question(_)) => HintLine::List,
        Some(Overlay::ViewerImage(_)) => return None,
        Some(Overlay::Form(form)) if form.fields.editor.is_none() => HintLine::Form,
        Some(Overlay::Form(_) | Overlay::Prompt(_)) => HintLine::Typing,
        None if model.inspector.editor.is_some() => HintLine::Typing,
        None if model.watch.is_some() && model.context() != KeyContext::Probing => {
            HintLine::Watching
        }
        None if model.first_time && model.context() == KeyContext::Picture => HintLine::First,
        None => HintLine::In(model.context()),
    })
}

/// Returns the hints for the state `line`, sorted by position.
fn hints_of(line: HintLine) -> Vec<&'static Hint> {
    let mut hints: Vec<_> = COMMANDS
        .iter()
        .flat_map(|command| command.hints)
        .filter(|hint| hint.lines.contains(&line))
        .collect();
    hints.sort_by_key(|hint| hint.position);
    hints
}

/// Returns the hints for the model's state, sorted by position.
pub fn hints(model: &Model) -> Vec<&'static Hint> {
    hint_line(model).map_or_else(Vec::new, hints_of)
}

/// Returns the lines of the help: all commands, or those that can run in `zerkalo watch`.
pub fn help(model: &Model) -> Vec<HelpLine> {
    let mut lines = Vec::new();
    for command in COMMANDS.iter().filter(|command| command.is_listed(model)) {
        let heading = HelpLine::Heading(command.chapter.to_string());
        if !lines.contains(&heading) {
            lines.push(heading);
        }
        let keys = match model.watch {
            Some(_) => command.watch_keys(str::to_string),
            None => command.all_keys(str::to_string),
        };
        let keys = if keys.is_empty() { ":".to_string() } else { keys };
        lines.push(HelpLine::Entry((keys, command.label)));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hint_belongs_to_command_with_key_in_context() {
        for command in COMMANDS {
            for hint in command.hints {
                for line in hint.lines {
                    let context = match line {
                        HintLine::First => KeyContext::Picture,
                        HintLine::In(context) => *context,
                        HintLine::Watching => KeyContext::Outline,
                        HintLine::List | HintLine::Form | HintLine::Typing | HintLine::Reading => {
                            KeyContext::Overlay
                        }
                    };
                    let has_key =
                        command.keys.iter().any(|(c, _)| context.chain().any(|other| other == *c));
                    assert!(has_key, "{} in {line:?}", command.label);
                    let same_line = hints_of(*line);
                    let same_place = same_line.iter().filter(|h| h.position == hint.position);
                    assert_eq!(same_place.count(), 1, "{} in {line:?}", command.label);
                }
            }
        }
    }

    #[test]
    fn help_lists_every_command() {
        let lines = help(&Model::default());
        let rows = lines.iter().filter(|line| line.entry().is_some()).count();
        assert_eq!(rows, COMMANDS.len());
        let chapters = COMMANDS.chunk_by(|a, b| a.chapter == b.chapter);
        assert_eq!(lines.len() - rows, chapters.count(), "the commands of a chapter are together");
    }
}
