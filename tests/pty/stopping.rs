//! Stopped and continued from a shell; sizes that change in a storm; edits that outlive their program.

use super::life::signal;
use super::*;
use std::os::unix::fs::PermissionsExt;
use std::time::Duration;
use zerkalo::scene::BUILT_IN;
use zerkalo::terminal::{ENTER, LEAVE};

/// A shell with job control whose prompt and messages are plain.
fn shell(desk: &Desk) -> Terminal {
    let env = [("PS1", "shell> "), ("ENV", ""), ("ZERKALO", PROGRAM)];
    let (folder, size) = (desk.0.path(), [100, 30]);
    Terminal::start(&Start { command: &["/bin/sh", "-i"], folder, size, env: &env, answers: true })
}

/// Whether the last of both that was sent is `LEAVE`.
fn is_left(terminal: &Terminal) -> bool {
    let bytes = String::from_utf8_lossy(&terminal.bytes()).into_owned();
    bytes.rfind(LEAVE.as_str()) > bytes.rfind(ENTER.as_str())
}

fn pause_and_go_on(how: impl Fn(&mut Terminal)) {
    let desk = Desk::with_room();
    let mut terminal = shell(&desk);
    terminal.wait_for_text("shell> ");
    terminal.send("\"$ZERKALO\" room.toml\n");
    wait_for_picture(&terminal);
    terminal.send("]");
    terminal.wait_for_text("room.toml ●");
    how(&mut terminal);
    terminal.wait_for("the shell", |screen| {
        (!screen.alternate_screen() && !screen.hide_cursor()).then_some(())
    });
    assert!(is_left(&terminal));
    // It may never be called back.
    let kept = fs::read_to_string(desk.path(".room.toml.unsaved")).unwrap();
    assert!(kept.contains("[camera]"), "{kept}");
    terminal.wait_for_text("topped");
    terminal.send("echo $((6 * 7))\n");
    terminal.wait_for_text("42");
    terminal.resize([120, 36]);
    terminal.send("fg\n");
    wait_for_picture(&terminal);
    terminal.wait_for_text("room.toml ●");
    terminal.send("u");
    terminal.wait_until_gone("room.toml ●");
    terminal.send("q");
    // What is typed before the shell asks for it is passed over, as late answers of the terminal are.
    terminal.wait_for("the prompt again", |screen| {
        screen.contents().trim_end().ends_with("shell>").then_some(())
    });
    terminal.send("echo status $?\n");
    terminal.wait_for_text("status 0");
    terminal.send("exit\n");
    assert_eq!(terminal.end().0, 0);
    assert!(!desk.path(".room.toml.unsaved").exists());
}

#[test]
fn ctrl_z_leads_to_the_shell_and_fg_back() {
    pause_and_go_on(|terminal| terminal.send("\x1a"));
}

#[test]
fn a_stop_from_outside_restores_the_terminal_first() {
    pause_and_go_on(|terminal| {
        let children = format!("/proc/{0}/task/{0}/children", terminal.process_id());
        let id = fs::read_to_string(children).unwrap().trim().to_string();
        let sent = Command::new("kill").args(["-TSTP", &id]).status();
        assert!(sent.unwrap().success());
    });
}

#[test]
fn without_a_shell_to_go_back_to_nothing_stops() {
    let desk = Desk::with_room();
    let mut terminal = desk.open(&["room.toml"], [100, 30]);
    wait_for_picture(&terminal);
    terminal.send("\x1a");
    terminal.wait_for_text("There is no shell to go back to");
    wait_for_picture(&terminal);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn a_storm_of_sizes_ends_with_the_last() {
    let desk = Desk::with_room();
    let mut terminal = desk.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    for i in 0..40 {
        terminal.resize([60 + i, 20 + i / 4]);
        std::thread::sleep(Duration::from_millis(5));
    }
    terminal.resize([80, 24]);
    terminal.wait_for("a picture for 80 columns", |screen| {
        (800..1100).contains(&picture_cells(screen)).then_some(())
    });
    terminal.send("q");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0);
    // Every size that counts begins with an empty screen: forty would be a storm of pictures.
    let cleared = bytes.matches("\x1b[2J").count();
    assert!((2..12).contains(&cleared), "{cleared} times");
}

#[test]
fn edits_outlive_a_kill_and_are_offered_to_the_next() {
    let desk = Desk::with_room();
    let mut terminal = desk.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    terminal.send("]");
    terminal.wait_for_text("room.toml ●");
    signal("TERM", terminal.process_id());
    let (status, bytes) = terminal.end();
    assert_eq!(status, 143);
    let told = "unsaved edits are kept in ";
    assert!(bytes.find(told) > bytes.rfind(LEAVE.as_str()), "{bytes:?}");
    assert_eq!(fs::read_to_string(desk.path("room.toml")).unwrap(), BUILT_IN);

    let mut terminal = desk.open(&["room.toml"], [120, 36]);
    terminal.wait_for_text("ended unexpectedly a moment ago");
    terminal.send("r");
    terminal.wait_for_text("recovered");
    terminal.send("\x13");
    terminal.wait_until_gone("room.toml ●");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
    let saved = fs::read_to_string(desk.path("room.toml")).unwrap();
    assert_ne!(saved, BUILT_IN);
    assert_eq!(saved.lines().count(), BUILT_IN.lines().count());
    assert!(!desk.path(".room.toml.unsaved").exists());
    // A file that is gone can be had back from what was kept.
    fs::rename(desk.path("room.toml"), desk.path(".room.toml.unsaved")).unwrap();
    let (status, bytes) = desk.open(&["room.toml"], [80, 24]).end();
    assert_eq!(status, 1);
    assert!(bytes.contains(".room.toml.unsaved"), "{bytes:?}");
}

#[test]
fn edits_of_a_scene_without_a_file_and_of_one_that_cannot_be_written_beside() {
    let desk = Desk::with_room();
    let state = desk.path("state");
    let env = [("XDG_STATE_HOME", state.to_str().unwrap())];
    let open = |command: &[&str]| {
        let (folder, size) = (desk.0.path(), [120, 36]);
        Terminal::start(&Start { command, folder, size, env: &env, answers: true })
    };
    let mut terminal = open(&[PROGRAM]);
    wait_for_picture(&terminal);
    terminal.send("]");
    terminal.wait_for_text("mirror-room.toml ●");
    signal("HUP", terminal.process_id());
    assert_eq!(terminal.end().0, 129);
    let kept: Vec<_> = fs::read_dir(state.join("zerkalo")).unwrap().collect();
    assert_eq!(kept.len(), 1);
    let mode = fs::metadata(state.join("zerkalo")).unwrap().permissions().mode();
    assert_eq!(mode & 0o777, 0o700);
    let mut terminal = open(&[PROGRAM]);
    terminal.wait_for_text("ended unexpectedly");
    terminal.send("d");
    terminal.wait_until_gone("ended unexpectedly");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
    assert_eq!(fs::read_dir(state.join("zerkalo")).unwrap().count(), 0);
}

#[test]
fn doctor_restores_the_terminal_and_tells_what_it_found() {
    let desk = Desk::new();
    let (folder, size) = (desk.0.path(), [100, 30]);
    let env = [("LANG", "C.UTF-8"), ("LC_ALL", "C.UTF-8")];
    let command = [PROGRAM, "doctor", "--rate"];
    let start = Start { command: &command, folder, size, env: &env, answers: true };
    let (status, bytes) = Terminal::start(&start).end();
    assert_eq!(status, 0, "{bytes}");
    let report = &bytes[bytes.find(LEAVE.as_str()).expect("the terminal is left") + LEAVE.len()..];
    assert!(!report.contains('\x1b'), "{report:?}");
    for part in [
        "TERM=xterm-256color",
        "24-bit colour: COLORTERM=truecolor",
        "100 x 30 cells",
        "mode 2026",
        "this machine",
        "KB/s, measured",
        ".NAME.unsaved",
    ] {
        assert!(report.contains(part), "no {part:?} in {report}");
    }
}
