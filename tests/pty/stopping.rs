//! Job control, rapid resizing, and recovery of unsaved edits.

use super::*;
use crate::command_line::signals::signal;
use crate::harness::*;
use std::os::unix::fs::PermissionsExt;
use zerkalo_terminal::{ENTER, LEAVE};

/// Starts a shell with job control and a plain prompt in the test terminal.
fn shell(fixture: &Fixture) -> Terminal {
    let env = [("PS1", "shell> "), ("ENV", ""), ("ZERKALO", PROGRAM)];
    let (folder, size) = (fixture.0.path(), [100, 30]);
    Terminal::start(&Start { command: &["/bin/sh", "-i"], folder, size, env: &env, replies: true })
}

/// Returns `true` if the program has restored the terminal: it has sent `LEAVE` after the last
/// `ENTER`.
fn is_left(terminal: &Terminal) -> bool {
    let bytes = String::from_utf8_lossy(&terminal.bytes()).into_owned();
    bytes.rfind(LEAVE) > bytes.rfind(ENTER)
}

fn suspend_and_resume(stop: impl Fn(&mut Terminal)) {
    let fixture = Fixture::with_room();
    let mut terminal = shell(&fixture);
    terminal.wait_for_text("shell> ");
    terminal.send("\"$ZERKALO\" room.toml\n");
    wait_for_picture(&terminal);
    terminal.send("]");
    terminal.wait_for_text("room.toml ●");
    stop(&mut terminal);
    terminal.wait_for("the shell", |screen| {
        (!screen.alternate_screen() && !screen.hide_cursor()).then_some(())
    });
    assert!(is_left(&terminal));
    // The program saves unsaved edits to the recovery file before it stops.
    let kept = fs::read_to_string(fixture.path(".room.toml.unsaved")).unwrap();
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
    // The program reads input that arrives before the shell's prompt, such as late replies of the
    // terminal. The test waits for the prompt.
    terminal.wait_for("the prompt again", |screen| {
        screen.contents().trim_end().ends_with("shell>").then_some(())
    });
    terminal.send("echo status $?\n");
    terminal.wait_for_text("status 0");
    terminal.send("exit\n");
    assert_eq!(terminal.end().0, 0);
    assert!(!fixture.path(".room.toml.unsaved").exists());
}

#[test]
fn ctrl_z_suspends_and_fg_resumes() {
    suspend_and_resume(|terminal| terminal.send("\x1a"));
}

#[test]
fn sigtstp_restores_the_terminal_first() {
    suspend_and_resume(|terminal| {
        let children = format!("/proc/{0}/task/{0}/children", terminal.process_id());
        let id = fs::read_to_string(children).unwrap().trim().to_string();
        let sent = Command::new("kill").args(["-TSTP", &id]).status();
        assert!(sent.unwrap().success());
    });
}

/// Checks that the leader of a session, as in `ssh -t host zerkalo`, ends only after the terminal is
/// restored. sshd transmits nothing after its end.
#[test]
fn killed_dashboard_of_a_session_restores_the_terminal() {
    for (name, status) in [("KILL", 137), ("ABRT", 134)] {
        let fixture = Fixture::with_room();
        let mut terminal = fixture.open(&["room.toml"], [100, 30]);
        wait_for_picture(&terminal);
        signal(name, terminal.process_id());
        assert_eq!(terminal.status(), status);
        terminal.wait_for("the restored terminal", |screen| {
            (!screen.alternate_screen() && !screen.hide_cursor()).then_some(())
        });
        terminal.end();
    }
}

/// Checks that a reply that arrives after the key `q` is not typed into the shell.
#[test]
fn late_reply_is_not_typed_into_the_shell() {
    let fixture = Fixture::with_room();
    let mut terminal = shell(&fixture);
    terminal.wait_for_text("shell> ");
    terminal.send("\"$ZERKALO\" room.toml\n");
    wait_for_picture(&terminal);
    terminal.set_replying(false);
    terminal.send("q");
    terminal.wait_for("the shell", |screen| (!screen.alternate_screen()).then_some(()));
    terminal.send("\x1b[0n\x1b[?62;22c");
    terminal.wait_for("the prompt again", |screen| {
        screen.contents().trim_end().ends_with("shell>").then_some(())
    });
    terminal.send("echo $((6 * 7))\n");
    terminal.wait_for_text("42");
    assert!(!terminal.screen(vt100::Screen::contents).contains("62;22"));
    terminal.send("exit\n");
    terminal.end();
}

#[test]
fn ctrl_z_without_shell_does_not_stop() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], [100, 30]);
    wait_for_picture(&terminal);
    terminal.send("\x1a");
    terminal.wait_for_text("There is no shell to go back to");
    wait_for_picture(&terminal);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn rapid_resizing_is_debounced() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    let start = Instant::now();
    for i in 0..40 {
        terminal.resize([60 + i, 20 + i / 4]);
        std::thread::sleep(Duration::from_millis(5));
    }
    terminal.resize([80, 24]);
    let elapsed = start.elapsed();
    terminal.wait_for("a picture for 80 columns", |screen| {
        (800..1100).contains(&picture_cells(screen)).then_some(())
    });
    terminal.send("q");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0);
    // Each applied size clears the screen; forty sizes are merged into few. A size takes effect
    // after 90 ms without a change. On a busy machine the test may pause for that long between two
    // changes; each such pause allows one more size.
    let pauses = elapsed.as_millis() as usize / 90;
    let clear_count = bytes.matches("\x1b[2J").count();
    assert!((2..12 + pauses).contains(&clear_count), "{clear_count} times in {elapsed:?}");
}

#[test]
fn unsaved_edits_are_recovered_by_the_next_start() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    terminal.send("]");
    terminal.wait_for_text("room.toml ●");
    signal("TERM", terminal.process_id());
    let (status, bytes) = terminal.end();
    assert_eq!(status, 143);
    let message = "unsaved edits are kept in ";
    assert!(bytes.find(message) > bytes.rfind(LEAVE), "{bytes:?}");
    assert_eq!(fs::read_to_string(fixture.path("room.toml")).unwrap(), MIRROR_ROOM);

    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    terminal.wait_for_text(" ago with");
    terminal.send("r");
    terminal.wait_for_text("recovered");
    terminal.send("\x13");
    terminal.wait_until_gone("room.toml ●");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
    let saved = fs::read_to_string(fixture.path("room.toml")).unwrap();
    assert_ne!(saved, MIRROR_ROOM);
    assert_eq!(saved.lines().count(), MIRROR_ROOM.lines().count());
    assert!(!fixture.path(".room.toml.unsaved").exists());
    // A missing scene file can be restored from the recovery file.
    fs::rename(fixture.path("room.toml"), fixture.path(".room.toml.unsaved")).unwrap();
    let (status, bytes) = fixture.open(&["room.toml"], [80, 24]).end();
    assert_eq!(status, 1);
    assert!(bytes.contains(".room.toml.unsaved"), "{bytes:?}");
}

#[test]
fn unsaved_edits_without_file_are_kept_in_state_folder() {
    let fixture = Fixture::with_room();
    let state = fixture.path("state");
    let env = [("XDG_STATE_HOME", state.to_str().unwrap())];
    let open = |command: &[&str]| {
        let (folder, size) = (fixture.0.path(), [120, 36]);
        Terminal::start(&Start { command, folder, size, env: &env, replies: true })
    };
    let mut terminal = open(&[PROGRAM]);
    wait_for_picture(&terminal);
    terminal.send("]");
    terminal.wait_for_text("lamp-and-mirror (no file) ●");
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
fn doctor_reports_after_restoring_the_terminal() {
    let fixture = Fixture::new();
    let (folder, size) = (fixture.0.path(), [100, 30]);
    let env = [("LANG", "C.UTF-8"), ("LC_ALL", "C.UTF-8")];
    let command = [PROGRAM, "doctor"];
    let start = Start { command: &command, folder, size, env: &env, replies: true };
    let (status, bytes) = Terminal::start(&start).end();
    assert_eq!(status, 0, "{bytes}");
    let report = &bytes[bytes.find(LEAVE).expect("the terminal is left") + LEAVE.len()..];
    assert!(!report.contains('\x1b'), "{report:?}");
    for part in "TERM=xterm-256color|24-bit colour: COLORTERM=truecolor|100 x 30 cells|mode 2026|\
         this machine"
        .split('|')
    {
        assert!(report.contains(part), "no {part:?} in {report}");
    }
}

#[test]
fn pipe_in_place_of_the_scene_blocks_neither_edits_nor_the_end() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    fs::remove_file(fixture.path("room.toml")).unwrap();
    let made = std::process::Command::new("mkfifo").arg(fixture.path("room.toml")).status();
    assert!(made.unwrap().success());
    // Within this time the program checks the scene file for changes and finds the pipe.
    std::thread::sleep(Duration::from_millis(1500));
    terminal.send("]");
    terminal.wait_for_text("room.toml ●");
    terminal.send("\x13");
    terminal.wait_for_text("not a regular file");
    signal("TERM", terminal.process_id());
    let (status, bytes) = terminal.end();
    assert_eq!(status, 143);
    assert!(bytes.contains("unsaved edits are kept in"), "{bytes:?}");
    assert!(fs::metadata(fixture.path(".room.toml.unsaved")).unwrap().len() > 100);
}

#[test]
fn abort_and_kill_leave_a_restored_terminal() {
    for name in ["ABRT", "KILL"] {
        let fixture = Fixture::with_room();
        let mut terminal = shell(&fixture);
        terminal.wait_for_text("shell> ");
        terminal.send("sh -c 'echo $$ >id; exec \"$ZERKALO\" room.toml'\n");
        wait_for_picture(&terminal);
        let id = fs::read_to_string(fixture.path("id")).unwrap();
        signal(name, id.trim().parse().unwrap());
        terminal.wait_for("the shell", |screen| {
            (!screen.alternate_screen() && !screen.hide_cursor()).then_some(())
        });
        assert!(is_left(&terminal), "{name}");
        terminal.send("echo $((6 * 7))\n");
        terminal.wait_for_text("42");
        terminal.send("exit\n");
        // `end` compares the modes of the terminal with those before the start.
        terminal.end();
    }
}
