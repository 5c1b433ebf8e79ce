//! Start and end of the program: the state of the terminal is changed and restored.

use super::*;
use crate::command_line::signals::signal;
use std::io::Write;
use std::process::{Command, Stdio};
use zerkalo_terminal::{ENTER, LEAVE, Screen};

#[test]
fn built_in_scene_opens_and_quits() {
    let fixture = Fixture::new();
    let mut terminal = fixture.open(&[], [120, 36]);
    wait_for_picture(&terminal);
    terminal.wait_for_text("lamp-and-mirror");
    terminal.send("q");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0);
    assert!(bytes.starts_with(ENTER), "{:?}", &bytes[..100]);
    assert!(bytes.ends_with(LEAVE), "{:?}", &bytes[bytes.len() - 100..]);
    assert_eq!(fs::read_dir(fixture.path(".")).unwrap().count(), 0, "nothing was written");
}

#[test]
fn signals_restore_the_terminal() {
    let fixture = Fixture::with_room();
    for (name, expected) in [("TERM", 143), ("INT", 130), ("HUP", 129), ("QUIT", 131)] {
        let terminal = fixture.open(&["room.toml"], [80, 24]);
        wait_for_picture(&terminal);
        signal(name, terminal.process_id());
        let (status, bytes) = terminal.end();
        assert_eq!(status, expected, "{name}");
        assert!(bytes.ends_with(LEAVE), "{name}");
    }
}

#[test]
#[ignore = "runs in the terminal of another test"]
fn program_that_panics() {
    let screen = Screen::enter().unwrap();
    std::thread::spawn(|| panic!("as the test wants it")).join().unwrap_err();
    drop(screen);
    std::io::stdout().write_all(b"still alive\r\n").unwrap();
}

#[test]
fn panic_message_follows_restored_terminal() {
    let fixture = Fixture::new();
    let this = std::env::current_exe().unwrap();
    let command = [
        this.to_str().unwrap(),
        "pty::life::program_that_panics",
        "--exact",
        "--ignored",
        "--nocapture",
    ];
    let start = Start {
        command: &command,
        folder: fixture.0.path(),
        size: [80, 24],
        env: &[],
        replies: true,
    };
    let (status, bytes) = Terminal::start(&start).end();
    assert_eq!(status, 0, "{bytes}");
    let [entered, left, message, after] = [ENTER, LEAVE, "as the test wants it", "still alive"]
        .map(|part| bytes.find(part).unwrap_or_else(|| panic!("no {part:?} in {bytes:?}")));
    assert!(entered < left && left < message && message < after, "{bytes:?}");
    assert_eq!(bytes.matches(LEAVE).count(), 1);
}

/// Session and process group of the caller have the ID 0 in a PID namespace of its own.
#[test]
fn program_runs_in_a_pid_namespace_of_its_own() {
    let unshare = ["unshare", "--map-root-user", "--pid", "--fork"];
    let probe = Command::new(unshare[0]).args(&unshare[1..]).arg("true").output();
    if !probe.is_ok_and(|run| run.status.success()) {
        eprintln!("not checked: no PID namespaces here");
        return;
    }
    let fixture = Fixture::with_room();
    let command = [&unshare[..], &[PROGRAM, "room.toml"]].concat();
    let mut terminal = Terminal::start(&Start {
        command: &command,
        folder: fixture.0.path(),
        size: [80, 24],
        env: &[],
        replies: true,
    });
    wait_for_picture(&terminal);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn without_terminal_one_line_names_the_alternative() {
    let fixture = Fixture::with_room();
    let run = Command::new(PROGRAM)
        .arg("room.toml")
        .current_dir(fixture.0.path())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let message = String::from_utf8(run.stderr).unwrap();
    assert_eq!((run.status.code(), message.lines().count()), (Some(2), 1), "{message}");
    assert!(message.contains("zerkalo render room.toml"), "{message}");
    assert!(run.stdout.is_empty());

    let command = [PROGRAM];
    let env = [("TERM", "dumb")];
    let start = Start {
        command: &command,
        folder: fixture.0.path(),
        size: [80, 24],
        env: &env,
        replies: true,
    };
    let (status, bytes) = Terminal::start(&start).end();
    assert_eq!(status, 2);
    assert!(bytes.contains("zerkalo render") && !bytes.contains('\x1b'), "{bytes:?}");
}

#[test]
fn missing_file_is_reported_without_dashboard() {
    let fixture = Fixture::new();
    let (status, bytes) = fixture.open(&["nowhere/scene.toml"], [80, 24]).end();
    assert_eq!(status, 1);
    assert!(bytes.contains("nowhere/scene.toml") && !bytes.contains(ENTER), "{bytes:?}");
}

#[test]
fn picture_follows_terminal_size() {
    let fixture = Fixture::new();
    let mut terminal = fixture.open(&[], [80, 24]);
    let wait_for_cells = |what: &str, expected: std::ops::Range<usize>| {
        terminal.wait_for(what, |s| expected.contains(&picture_cells(s)).then_some(()));
    };
    wait_for_cells("a small picture", 800..1100);
    terminal.resize([160, 45]);
    wait_for_cells("a larger picture", 3000..5000);
    terminal.resize([30, 8]);
    terminal.wait_for("no picture, but a line", |screen| {
        let has_message = screen.contents().contains("at least");
        (picture_cells(screen) == 0 && has_message).then_some(())
    });
    terminal.resize([80, 24]);
    wait_for_cells("the picture again", 800..1100);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

/// Opens and closes the help, then quits. No prompt asks about unsaved edits, because no scene was
/// edited.
fn open_help_and_quit(mut terminal: Terminal) {
    terminal.send("?");
    terminal.wait_for_text("orbit left");
    terminal.send("\x1b");
    terminal.wait_until_gone("orbit left");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn pasted_text_is_not_keys() {
    let fixture = Fixture::new();
    let mut terminal = fixture.open(&[], [120, 36]);
    wait_for_picture(&terminal);
    terminal.send("\x1b[200~qqq]]]x\x1b[201~");
    open_help_and_quit(terminal);
}

const SSH: &[(&str, &str)] = &[("SSH_CONNECTION", "192.0.2.1 50000 192.0.2.2 22")];

fn open_over_ssh(fixture: &Fixture, replies: bool) -> Terminal {
    let (folder, size) = (fixture.0.path(), [120, 36]);
    let command = &[PROGRAM, "--threads", "1"];
    let terminal = Terminal::start(&Start { command, folder, size, env: SSH, replies });
    wait_for_picture(&terminal);
    terminal
}

#[test]
fn terminal_without_replies_gets_a_fixed_rate() {
    let fixture = Fixture::new();
    let terminal = open_over_ssh(&fixture, false);
    terminal.wait_for_text("30 KB/s");
    open_help_and_quit(terminal);
}

#[test]
fn unrequested_replies_are_not_keys() {
    let fixture = Fixture::new();
    let mut terminal = open_over_ssh(&fixture, true);
    terminal.wait_for_text("B/s");
    terminal.send("\x1b[24;80R\x1b]11;rgb:1e1e/1e1e/2e2e\x1b\\\x1b[?2026;2$y\x1b_Gi=31;OK\x1b\\\x1b[>0;276;0c");
    open_help_and_quit(terminal);
}

/// Checks that the query of the terminal's capabilities, which waits for replies, ends when a
/// signal arrives.
#[test]
fn signal_ends_the_capability_query() {
    let fixture = Fixture::with_room();
    let env = [("SSH_CONNECTION", "192.0.2.7 5000 192.0.2.1 22")];
    let command = [PROGRAM, "room.toml"];
    let start = Start {
        command: &command,
        folder: fixture.0.path(),
        size: [80, 24],
        env: &env,
        replies: false,
    };
    // Without replies the query takes two seconds. If the signal arrives after it, the screen has
    // been drawn, and the test tries again.
    let is_prompt = (0..3).any(|_| {
        let terminal = Terminal::start(&start);
        terminal.wait_for("the screen is taken", |screen| screen.alternate_screen().then_some(()));
        signal("TERM", terminal.process_id());
        let (status, bytes) = terminal.end();
        assert_eq!(status, 143);
        assert!(bytes.ends_with(LEAVE));
        !bytes.contains("room.toml")
    });
    assert!(is_prompt, "the query goes on after the signal");
}

#[test]
fn pictures_are_not_written_to_a_terminal() {
    let fixture = Fixture::with_room();
    let (status, bytes) = fixture.open(&["render", "room.toml", "-o", "-"], [80, 24]).end();
    assert_eq!(status, 2);
    assert!(bytes.contains("a picture is not written to a terminal"), "{bytes:?}");
}
