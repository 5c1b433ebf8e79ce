//! Stories of stray keys: in no widget does text that is typed run a command.

use super::*;

/// Keys that a hand may hit anywhere, and that must change nothing.
const STRAY: [&str; 11] = ["b", ".", "4", ",", "<", ">", "(", ")", "+", "-", "#"];

/// Returns the keys of all commands, except those that confirm, move or leave.
fn commands() -> Vec<&'static str> {
    let names =
        COMMANDS.iter().flat_map(|command| command.keys).flat_map(|(_, keys)| keys.split(' '));
    let moves =
        ["Enter", "Esc", "Tab", "Ctrl-s", "Ctrl-c", "Ctrl-z", "Up", "Down", "PageUp", "PageDown"];
    names
        .filter(|name| !moves.iter().any(|key| name.trim_start_matches("Shift-") == *key))
        .collect()
}

fn unchanged(desk: &mut Desk, place: &str, keys: &[&str]) {
    for key in keys {
        desk.keys(key);
        assert_eq!(desk.text(), ROOM, "{key} in {place}");
    }
    desk.keys("Esc Esc Esc");
    assert_eq!(desk.text(), ROOM, "{place}");
}

#[test]
fn stray_keys_change_nothing_on_any_row() {
    let room = Desk::new(ROOM);
    let parts = zerkalo_scene::edit::outline(room.scene());
    for (_, subject) in parts {
        for line in 0..usize::MAX {
            let mut desk = Desk::new(ROOM);
            desk.select(subject.clone());
            desk.keys("Tab");
            unchanged(&mut desk, "the outline", &STRAY);
            desk.select(subject.clone());
            desk.keys("Enter");
            if line >= desk.model.field_lines().len() {
                break;
            }
            desk.model.inspector.cursor = line;
            unchanged(&mut desk, &format!("line {line} of {subject:?}"), &STRAY);
        }
    }
}

#[test]
fn no_command_runs_while_text_is_typed() {
    let ball = Target::Object(1);
    for (place, keys) in [
        ("an editor", "Enter / `rad` Enter Enter"),
        ("the editor of a name", "Enter Home `pearl`"),
        ("the filter", "Enter / `rad`"),
        ("a form", "a Enter Down Down"),
        ("an editor in a form", "a Enter `rad` Enter `2`"),
        ("the kinds of objects", "a"),
        ("a picker", "Enter Enter"),
        ("the palette", ":"),
        ("a prompt", "e"),
        ("the noise targets", "N"),
    ] {
        let mut desk = Desk::new(ROOM);
        desk.select(ball.clone());
        desk.keys(keys);
        unchanged(&mut desk, place, &commands());
    }
}
