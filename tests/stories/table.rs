//! Consistency of the command table.

use super::*;

#[test]
fn every_key_runs_one_command_per_context() {
    let mut seen = HashMap::new();
    for command in COMMANDS {
        for (context, names) in command.keys {
            for name in names.split(' ') {
                let key: Key = name.parse().unwrap_or_else(|e| panic!("{}: {e}", command.label));
                assert_eq!(key.to_string(), *name);
                if let Some(other) = seen.insert((*context, key), command.label) {
                    panic!("{name} in {context:?} is both {other:?} and {:?}", command.label);
                }
                let found = lookup(COMMANDS, *context, key).map(|found| found.label);
                assert_eq!(found, Some(command.label), "{name} in {context:?}");
            }
        }
    }
}

#[test]
fn every_command_has_a_label_of_its_own() {
    let mut labels = HashSet::new();
    for command in COMMANDS {
        assert!(labels.insert(command.label), "{:?} twice", command.label);
    }
}

/// Compares docs/keys.md with the command table.
/// `ZERKALO_BLESS=1 cargo test --release --test program stories::` rewrites docs/keys.md.
#[test]
fn keys_page_matches_command_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/keys.md");
    let page = keys_manual();
    if std::env::var_os("ZERKALO_BLESS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == page,
        "docs/keys.md differs from the command table: ZERKALO_BLESS=1 cargo test --release --test \
         program stories::"
    );
}

/// Returns the text of docs/keys.md, which lists the keys of all commands.
fn keys_manual() -> String {
    let mut page = "# Keys\n\n\
        Generated from the command table. Every action is also found by typing a part of its name \
        after `:`; actions without a key only there.\n"
        .to_string();
    // A vertical bar would end a cell of the Markdown table.
    let quoted = |key: &str| format!("`{}`", key.replace('|', "\\|"));
    for commands in COMMANDS.chunk_by(|a, b| a.chapter == b.chapter) {
        let title = commands[0].chapter;
        page += &format!("\n## {title}\n\n| keys | action |\n|---|---|\n");
        for command in commands {
            page += &format!("| {} | {} |\n", command.formatted_keys(false, quoted), command.label);
        }
    }
    let watching = watch::watching(1);
    page += "\n## While watching\n\n`zerkalo watch` edits and renders nothing. It has these keys:\n\n\
             | keys | action |\n|---|---|\n";
    for command in COMMANDS.iter().filter(|command| command.is_listed(&watching.model)) {
        page += &format!("| {} | {} |\n", command.formatted_keys(true, quoted), command.label);
    }
    page += "\n## Mouse\n\n| mouse | effect |\n|---|---|\n";
    for (mouse, effect) in MOUSE {
        page += &format!("| {mouse} | {effect} |\n");
    }
    page
}

/// Mouse gestures and their effects, for docs/keys.md.
const MOUSE: &[(&str, &str)] = &[
    ("click in the picture", "selects the visible object; while probing: shows the pixel"),
    ("click on the mark of a light", "selects the light"),
    ("drag from the selected object or the mark of a light", "moves it in the ground plane"),
    ("other drag in the picture", "orbits; while moving: moves the selection in the ground plane"),
    ("drag with the right button, or with Ctrl or Alt", "pans; while moving: moves it up and down"),
    ("click with the right button, or with Ctrl or Alt", "focuses the lens on the visible point"),
    ("drag in the picture while zoomed", "pans the picture; the camera stays"),
    ("wheel over the picture", "dollies"),
    ("wheel with Ctrl or Alt, or over the loupe", "zooms the picture"),
    ("click in a panel or list", "selects; a second time: opens"),
    ("click with Ctrl or Alt in the outline", "marks or unmarks the part"),
    ("click on the heading of a material", "folds its fields"),
    ("drag a border between panels", "moves it"),
    ("drag a number in the inspector or a form", "changes its value"),
    ("wheel over the field under the cursor", "steps its value; elsewhere: scrolls"),
];
