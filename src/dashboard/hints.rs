//! What the hint line, the help and docs/keys.md say: all from the key table.

use crate::dashboard::keymap::{Chapter, Context, KEYMAP};
use crate::dashboard::model::Model;
use crate::dashboard::overlay::Overlay;

/// A hint: keys as they are shown, one key that stands for them, what they do.
pub type Hint = (&'static str, &'static str, &'static str);

/// A line of the help.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HelpLine {
    /// The heading of a chapter.
    Heading(&'static str),
    /// Keys, with where they hold, and what they do.
    Keys(String, &'static str),
}

/// For one who has not pressed anything yet.
const FIRST: &[Hint] = &[
    ("arrows", "Left", "turn"),
    ("[ ]", "[", "roughness"),
    ("a", "a", "add"),
    ("m", "m", "move"),
    (":", ":", "all actions"),
    ("?", "?", "keys"),
    ("q", "q", "quit"),
];

const PICTURE: &[Hint] = &[
    ("arrows", "Left", "orbit"),
    ("PgUp PgDn", "PageUp", "dolly"),
    ("Shift", "Shift-Left", "pan"),
    ("[ ]", "[", "roughness"),
    ("l ; '", "l", "light"),
    ("a", "a", "add"),
    ("m", "m", "move"),
    ("Tab", "Tab", "panels"),
    ("u", "u", "undo"),
    ("p", "p", "PNG"),
    (":", ":", "all"),
    ("?", "?", "keys"),
];

const MOVING: &[Hint] = &[
    ("arrows", "Left", "in the plane"),
    ("PgUp PgDn", "PageUp", "height"),
    ("Shift", "Shift-Left", "fine"),
    ("g", "g", "put down"),
    ("Esc", "Esc", "done"),
];

const TURNING: &[Hint] =
    &[("Left Right", "Left", "turn 15°"), ("Shift", "Shift-Left", "1°"), ("Esc", "Esc", "done")];

const FLYING: &[Hint] = &[
    ("w s", "w", "forward, back"),
    ("a d", "a", "left, right"),
    ("r f", "r", "up, down"),
    ("arrows", "Left", "look"),
    ("Esc", "Esc", "done"),
];

const PROBING: &[Hint] = &[
    ("arrows", "Left", "move"),
    ("Shift", "Shift-Left", "one pixel"),
    ("v", "v", "views"),
    ("Esc", "Esc", "done"),
];

const OUTLINE: &[Hint] = &[
    ("Up Down", "Up", "select"),
    ("Enter", "Enter", "inspect"),
    ("e", "e", "rename"),
    ("D", "D", "duplicate"),
    ("x", "x", "delete"),
    ("f", "f", "frame"),
    ("m", "m", "move"),
    ("Esc", "Esc", "picture"),
];

const INSPECTOR: &[Hint] = &[
    ("Up Down", "Up", "field"),
    ("Left Right", "Left", "step"),
    ("Shift", "Shift-Left", "fine"),
    ("Enter 0-9", "Enter", "type"),
    ("Backspace", "Backspace", "default"),
    ("Esc", "Esc", "picture"),
];

const LIST: &[Hint] =
    &[("Up Down", "Up", "choose"), ("Enter", "Enter", "take"), ("Esc", "Esc", "cancel")];

const FORM: &[Hint] = &[
    ("Up Down", "Up", "field"),
    ("Left Right", "Left", "step"),
    ("type", "0", "a value"),
    ("Enter", "Enter", "add"),
    ("Esc", "Esc", "cancel"),
];

const TYPING: &[Hint] = &[("Enter", "Enter", "apply"), ("Esc", "Esc", "leave as it was")];
const READING: &[Hint] = &[("Up Down", "Up", "scroll"), ("Esc", "Esc", "close")];

/// The hints for what the keys do now.
pub fn hints(model: &Model) -> &'static [Hint] {
    match &model.overlay {
        Some(Overlay::Help { .. } | Overlay::Inventory { .. }) => return READING,
        Some(
            Overlay::Palette(_) | Overlay::Pick(_) | Overlay::Quality { .. } | Overlay::Question(_),
        ) => return LIST,
        // It tells by itself.
        Some(Overlay::ViewerImage(_)) => return &[],
        Some(Overlay::Form(form)) if form.editor.is_none() => return FORM,
        Some(Overlay::Form(_) | Overlay::Prompt(_)) => return TYPING,
        None if model.inspector.editor.is_some() => return TYPING,
        None => {}
    }
    match model.context() {
        Context::Moving => MOVING,
        Context::Turning => TURNING,
        Context::Flying => FLYING,
        Context::Probing => PROBING,
        Context::Outline => OUTLINE,
        Context::Inspector => INSPECTOR,
        _ if model.first_time => FIRST,
        _ => PICTURE,
    }
}

/// The lines of the help: every row of the key table.
pub fn help() -> Vec<HelpLine> {
    let mut lines = Vec::new();
    for chapter in Chapter::ALL {
        lines.push(HelpLine::Heading(chapter.title()));
        for row in KEYMAP.iter().filter(|row| row.chapter == chapter) {
            let keys = if row.keys.is_empty() { ":".to_string() } else { row.all_keys() };
            lines.push(HelpLine::Keys(keys, row.label));
        }
    }
    lines
}

/// The page about the keys, as Markdown.
pub fn reference() -> String {
    let mut page = "# Keys\n\n\
        Made from the key table of the program. Every action is also found by typing a part of its \
        name after `:`; actions without a key only there.\n"
        .to_string();
    for chapter in Chapter::ALL {
        page += &format!("\n## {}\n\n| keys | what they do |\n|---|---|\n", chapter.title());
        for row in KEYMAP.iter().filter(|row| row.chapter == chapter) {
            let of = |(context, keys): &(Context, &[&str])| {
                // A vertical bar would end the table's cell.
                let keys: Vec<_> =
                    keys.iter().map(|key| format!("`{}`", key.replace('|', "\\|"))).collect();
                format!("{} {}", keys.join(" "), context.place()).trim_end().to_string()
            };
            let keys: Vec<_> = row.keys.iter().map(of).collect();
            page += &format!("| {} | {} |\n", keys.join(", "), row.label);
        }
    }
    page += "\n## Mouse\n\n| mouse | what it does |\n|---|---|\n";
    for (mouse, does) in MOUSE {
        page += &format!("| {mouse} | {does} |\n");
    }
    page
}

/// What the mouse does, for help and page.
pub const MOUSE: &[(&str, &str)] = &[
    ("click in the picture", "selects what is seen there; while probing: shows that pixel"),
    ("drag in the picture", "orbits; while moving: moves the selection in the ground plane"),
    ("drag with the right button, or with Ctrl or Alt", "pans; while moving: moves it up and down"),
    ("wheel over the picture", "dollies"),
    ("click in a panel or list", "selects; a second time: opens"),
    ("wheel over the field under the cursor", "steps its value; elsewhere: scrolls"),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dashboard::keymap::lookup;

    /// Hints never name a key that does nothing there.
    #[test]
    fn hints_tell_the_truth() {
        for (context, hints) in [
            (Context::Picture, FIRST),
            (Context::Picture, PICTURE),
            (Context::Moving, MOVING),
            (Context::Turning, TURNING),
            (Context::Flying, FLYING),
            (Context::Probing, PROBING),
            (Context::Outline, OUTLINE),
            (Context::Inspector, INSPECTOR),
            (Context::Overlay, LIST),
            (Context::Overlay, TYPING),
            (Context::Overlay, READING),
        ] {
            for (shown, key, does) in hints {
                assert!(lookup(context, key.parse().unwrap()).is_some(), "{shown} {does}");
            }
        }
    }

    #[test]
    fn the_help_has_every_row() {
        let lines = help();
        let rows = lines.iter().filter(|line| matches!(line, HelpLine::Keys(..))).count();
        assert_eq!(rows, KEYMAP.len());
        assert_eq!(lines.len() - rows, Chapter::ALL.len());
    }
}
