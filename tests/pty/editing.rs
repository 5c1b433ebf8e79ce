//! Editing, saving, and quitting with unsaved edits.

use super::*;
use crate::harness::*;

#[test]
fn edits_change_the_picture_and_undo_reverts_them() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    assert!(!terminal.screen(|s| s.contents()).contains("room.toml ●"), "nothing is unsaved yet");
    terminal.send("]]");
    terminal.wait_for_text("room.toml ●");
    terminal.send("uu");
    terminal.wait_until_gone("room.toml ●");
    terminal.send("\x1b[C\x1b[C");
    terminal.wait_for_text("view, not the camera");
    terminal.send("H");
    terminal.wait_for_text("room.toml ●");
    terminal.send("q");
    terminal.wait_for_text("nsaved");
    terminal.send("\x1b");
    terminal.wait_until_gone("nsaved");
    terminal.send("uuq");
    assert_eq!(terminal.end().0, 0);
    assert_eq!(fs::read_to_string(fixture.path("room.toml")).unwrap(), MIRROR_ROOM);
}

#[test]
fn saving_changes_one_line_only() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    terminal.send("]");
    terminal.wait_for_text("room.toml ●");
    terminal.send("\x13");
    terminal.wait_until_gone("room.toml ●");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
    let saved = fs::read_to_string(fixture.path("room.toml")).unwrap();
    let changed: Vec<_> =
        MIRROR_ROOM.lines().zip(saved.lines()).filter(|(before, after)| before != after).collect();
    assert_eq!(MIRROR_ROOM.lines().count(), saved.lines().count());
    assert!(
        matches!(changed[..], [(before, after)] if before.starts_with("roughness = ")
            && after.starts_with("roughness = ")),
        "{changed:?}"
    );
}

#[test]
fn external_changes_are_shown_and_faulty_file_can_be_fixed() {
    let fixture = Fixture::with_room();
    fs::write(fixture.path("room.toml"), "[camera]\neye = [0.0, 1.0\n").unwrap();
    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    terminal.wait_for_text("cannot be read");
    assert_eq!(terminal.screen(picture_cells), 0);
    fs::write(fixture.path("room.toml"), MIRROR_ROOM).unwrap();
    let wait_for_cells = |what: &str, expected: std::ops::Range<usize>| {
        terminal.wait_for(what, |s| expected.contains(&picture_cells(s)).then_some(()));
    };
    wait_for_cells("a picture as wide as its film", 2000..3000);
    // With another aspect ratio of the film, the shown picture is narrower.
    let narrow = MIRROR_ROOM.replace("size = [640, 480]", "size = [120, 480]");
    fs::write(fixture.path("room.toml"), narrow).unwrap();
    wait_for_cells("a narrower picture", 300..1000);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}
