//! Key hints in the last row of the screen, selected from the command table.

use crate::dashboard::update::commands::{Command, Hint, HintLine};
use crate::dashboard::{KeyContext, Model, Overlay, PanelLine};
use zerkalo_scene::edit::Widget;

/// Returns the state of `model` that selects the hints. Returns `None` while an exported image
/// covers the hint line.
fn hint_line(model: &Model) -> Option<HintLine> {
    Some(match &model.overlay {
        Some(Overlay::NoiseTargets(_) | Overlay::Question(_)) => HintLine::List,
        Some(Overlay::Pick(_)) => HintLine::Search,
        Some(Overlay::ViewerImage(_)) => return None,
        None | Some(Overlay::Form(_)) if model.field_list().filter.is_some() => HintLine::Search,
        Some(Overlay::Prompt(_)) => HintLine::Typing,
        None | Some(Overlay::Form(_)) if model.field_list().editor.is_some() => {
            let lines = model.field_lines();
            let field = lines.get(model.field_list().cursor).and_then(PanelLine::entry);
            let is_number =
                field.is_some_and(|f| matches!(f.property.widget, Widget::Numbers | Widget::Color));
            if is_number { HintLine::Number } else { HintLine::Typing }
        }
        Some(Overlay::Form(_)) => HintLine::Form,
        None if model.watch.is_some() && model.context() != KeyContext::Probing => {
            HintLine::Watching
        }
        None if model.first_time && model.context() == KeyContext::Picture => HintLine::First,
        None => HintLine::In(model.context()),
    })
}

/// Returns the hints for the state `line`, sorted by position.
fn hints_of(commands: &'static [Command], line: HintLine) -> Vec<&'static Hint> {
    let mut hints: Vec<_> = commands
        .iter()
        .flat_map(|command| command.hints)
        .filter(|hint| hint.lines.contains(&line))
        .collect();
    hints.sort_by_key(|hint| hint.position);
    hints
}

/// Returns the hints for the model's state, sorted by position.
pub fn hints(model: &Model) -> Vec<&'static Hint> {
    let hints = |line| hints_of(model.preferences.commands, line);
    hint_line(model).map_or_else(Vec::new, hints)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::update::commands::COMMANDS;

    #[test]
    fn hint_belongs_to_command_with_key_in_context() {
        for command in COMMANDS {
            for hint in command.hints {
                for line in hint.lines {
                    let context = match line {
                        HintLine::First => KeyContext::Picture,
                        HintLine::In(context) => *context,
                        HintLine::Watching => KeyContext::Outline,
                        HintLine::List
                        | HintLine::Search
                        | HintLine::Form
                        | HintLine::Typing
                        | HintLine::Number => KeyContext::Overlay,
                    };
                    let has_key =
                        command.keys.iter().any(|(c, _)| context.chain().any(|other| other == *c));
                    assert!(has_key, "{} in {line:?}", command.label);
                    let same_line = hints_of(COMMANDS, *line);
                    let same_place = same_line.iter().filter(|h| h.position == hint.position);
                    assert_eq!(same_place.count(), 1, "{} in {line:?}", command.label);
                }
            }
        }
    }

    #[test]
    fn commands_of_a_chapter_are_together() {
        let chapters: Vec<_> = COMMANDS.chunk_by(|a, b| a.chapter == b.chapter).collect();
        let names: std::collections::HashSet<_> = chapters.iter().map(|c| c[0].chapter).collect();
        assert_eq!(names.len(), chapters.len());
    }
}
