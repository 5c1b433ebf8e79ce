//! Texts derived from the command table: hint line, help and docs/keys.md.

use crate::dashboard::key_context::KeyContext;
use crate::dashboard::model::Model;
use crate::dashboard::overlay::Overlay;
use crate::dashboard::update::commands::{COMMANDS, Chapter, Command, Hint, HintLine};

/// A line of the help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HelpLine {
    /// The heading of a chapter.
    Heading(&'static str),
    /// Keys of a command with their contexts, and the label of the command.
    Keys(String, &'static str),
}

/// Returns the state of the dashboard that determines the hints. Returns `None` while an exported
/// image covers the screen.
fn hint_line(model: &Model) -> Option<HintLine> {
    Some(match &model.overlay {
        Some(Overlay::Help { .. } | Overlay::Inventory { .. }) => HintLine::Reading,
        Some(
            Overlay::Palette(_)
            | Overlay::Pick(_)
            | Overlay::NoiseTargets { .. }
            | Overlay::Question(_),
        ) => HintLine::List,
        Some(Overlay::ViewerImage(_)) => return None,
        Some(Overlay::Form(form)) if form.editor.is_none() => HintLine::Form,
        Some(Overlay::Form(_) | Overlay::Prompt(_)) => HintLine::Typing,
        None if model.inspector.editor.is_some() => HintLine::Typing,
        None if model.watch.is_some() && model.context() != KeyContext::Probing => {
            HintLine::Watching
        }
        None => match model.context() {
            KeyContext::Moving => HintLine::Moving,
            KeyContext::Turning => HintLine::Turning,
            KeyContext::Flying => HintLine::Flying,
            KeyContext::Probing => HintLine::Probing,
            KeyContext::Outline => HintLine::Outline,
            KeyContext::Inspector => HintLine::Inspector,
            _ if model.first_time => HintLine::First,
            _ => HintLine::Picture,
        },
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

/// Returns the lines of the help: all commands, or those that run while files are watched if
/// `watching` is `true`.
pub fn help(watching: bool) -> Vec<HelpLine> {
    let line = |command: &Command| {
        let keys = match watching {
            true => command.watch_keys(str::to_string),
            false => command.all_keys(str::to_string),
        };
        HelpLine::Keys(if keys.is_empty() { ":".to_string() } else { keys }, command.label)
    };
    let offered = |command: &&Command| command.while_watching || !watching;
    let mut lines = Vec::new();
    for (chapter, title) in Chapter::ALL {
        let commands: Vec<_> = chapter.commands().filter(offered).map(line).collect();
        if !commands.is_empty() {
            lines.push(HelpLine::Heading(title));
            lines.extend(commands);
        }
    }
    lines
}

/// Returns the text of docs/keys.md.
pub fn reference() -> String {
    let mut page = "# Keys\n\n\
        Generated from the command table. Every action is also found by typing a part of its name \
        after `:`; actions without a key only there.\n"
        .to_string();
    // A vertical bar would end a cell of the Markdown table.
    let quoted = |key: &str| format!("`{}`", key.replace('|', "\\|"));
    for (chapter, title) in Chapter::ALL {
        page += &format!("\n## {title}\n\n| keys | action |\n|---|---|\n");
        for command in chapter.commands() {
            page += &format!("| {} | {} |\n", command.all_keys(quoted), command.label);
        }
    }
    page += "\n## While watching\n\n`zerkalo watch` edits and renders nothing. It has these keys:\n\n\
             | keys | action |\n|---|---|\n";
    for command in COMMANDS.iter().filter(|command| command.while_watching) {
        page += &format!("| {} | {} |\n", command.watch_keys(quoted), command.label);
    }
    page += "\n## Mouse\n\n| mouse | effect |\n|---|---|\n";
    for (mouse, effect) in MOUSE {
        page += &format!("| {mouse} | {effect} |\n");
    }
    page
}

/// Mouse gestures and their effects.
const MOUSE: &[(&str, &str)] = &[
    ("click in the picture", "selects the visible object; while probing: shows the pixel"),
    ("drag in the picture", "orbits; while moving: moves the selection in the ground plane"),
    ("drag with the right button, or with Ctrl or Alt", "pans; while moving: moves it up and down"),
    ("click with the right button, or with Ctrl or Alt", "focuses the lens on the visible point"),
    ("wheel over the picture", "dollies"),
    ("click in a panel or list", "selects; a second time: opens"),
    ("wheel over the field under the cursor", "steps its value; elsewhere: scrolls"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hint_belongs_to_command_with_key_in_context() {
        for command in COMMANDS {
            for hint in command.hints {
                for line in hint.lines {
                    let context = match line {
                        HintLine::First | HintLine::Picture => KeyContext::Picture,
                        HintLine::Moving => KeyContext::Moving,
                        HintLine::Turning => KeyContext::Turning,
                        HintLine::Flying => KeyContext::Flying,
                        HintLine::Probing => KeyContext::Probing,
                        HintLine::Outline | HintLine::Watching => KeyContext::Outline,
                        HintLine::Inspector => KeyContext::Inspector,
                        HintLine::List | HintLine::Form | HintLine::Typing | HintLine::Reading => {
                            KeyContext::Overlay
                        }
                    };
                    let has_key = command.keys.iter().any(|(c, _)| context.chain().contains(c));
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
        let lines = help(false);
        let rows = lines.iter().filter(|line| matches!(line, HelpLine::Keys(..))).count();
        assert_eq!(rows, COMMANDS.len());
        assert_eq!(lines.len() - rows, Chapter::ALL.len());
        let in_order = Chapter::ALL.iter().enumerate().all(|(i, (c, _))| *c as usize == i);
        assert!(in_order);
        let watching = help(true);
        assert!(watching.len() < lines.len() / 2, "{watching:?}");
        assert!(watching.contains(&HelpLine::Keys("q Ctrl-c".into(), "quit")), "{watching:?}");
    }
}
