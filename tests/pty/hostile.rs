//! Hostile scene, whose names contain control sequences.

use super::*;
use crate::harness::*;

/// Text with sequences that set the clipboard (OSC 52) and colours (C0 and C1), and reverse the
/// text direction.
const EVIL: &str = "\u{1b}]52;c;cm0=\u{7}\u{9b}32m\u{202e}x";

#[test]
fn names_with_control_sequences_are_escaped() {
    let fixture = Fixture::new();
    let escaped: String = EVIL.chars().map(|c| format!("\\U{:08x}", u32::from(c))).collect();
    let scene = MIRROR_ROOM
        .replace("\"ball\"", &format!("\"ball{escaped}\""))
        .replace("name = \"lamp\"", &format!("name = \"{escaped}\""))
        + &format!("\n[cameras.\"{escaped}\"]\neye = [0.0, 1.0, 3.0]\ntarget = [0.0, 0.0, 0.0]\n");
    let name = format!("evil{EVIL}.toml");
    fs::write(fixture.path(&name), scene).unwrap();
    let mut terminal = fixture.open(&[&name], [140, 40]);
    wait_for_picture(&terminal);
    terminal.wait_for_text("u{1b}]52");
    // The keys visit the outline, the inspector, renaming and viewpoints. Then a picture is
    // exported, and copying its path is refused.
    for keys in [
        "\t", "\x1b[B", "\x1b[B", "\x1b[B", "\x1b[B", "\x1b[B", "\t", "\x1b", "e", "\x1b", "1",
        "l", "x", "u",
    ] {
        terminal.send(keys);
        std::thread::sleep(std::time::Duration::from_millis(150));
    }
    terminal.send("p");
    terminal.wait_for_text("-1.png");
    terminal.send("y");
    terminal.wait_for_text("not copied");
    // The file becomes invalid, and the error messages quote its text.
    terminal.send("]");
    terminal.wait_for_text("… ●");
    fs::write(fixture.path(&name), format!("[camera]\n\"{escaped}\" = 1\n")).unwrap();
    terminal.wait_for_text("nknown");
    terminal.send("\x03");
    terminal.wait_for_text("discard them and quit");
    terminal.send("d");
    let (_, bytes) = terminal.end();
    for part in ["\x1b]52", "\u{9b}", "\u{202e}", "\x1b]0;", "\x07"] {
        assert!(!bytes.contains(part), "{part:?}");
    }
}
