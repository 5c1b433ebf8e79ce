//! Beginning and end: the terminal is taken, and given back as it was.

use super::*;
use std::io::Write;
use std::process::{Command, Stdio};
use zerkalo::terminal::{ENTER, LEAVE, Screen};

pub fn signal(name: &str, id: u32) {
    let sent = Command::new("kill").args([format!("-{name}"), id.to_string()]).status();
    assert!(sent.unwrap().success());
}

#[test]
fn the_built_in_scene_opens_and_quits() {
    let desk = Desk::new();
    let mut terminal = desk.open(&[], [120, 36]);
    wait_for_picture(&terminal);
    terminal.wait_for_text("mirror-room");
    terminal.send("q");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0);
    assert!(bytes.starts_with(ENTER.as_str()), "{:?}", &bytes[..100]);
    assert!(bytes.ends_with(LEAVE.as_str()), "{:?}", &bytes[bytes.len() - 100..]);
    assert_eq!(fs::read_dir(desk.path(".")).unwrap().count(), 0, "nothing was written");
}

#[test]
fn signals_give_the_terminal_back() {
    let desk = Desk::with_room();
    for (name, expected) in [("TERM", 143), ("INT", 130), ("HUP", 129)] {
        let terminal = desk.open(&["room.toml"], [80, 24]);
        wait_for_picture(&terminal);
        signal(name, terminal.process_id());
        let (status, bytes) = terminal.end();
        assert_eq!(status, expected, "{name}");
        assert!(bytes.ends_with(LEAVE.as_str()), "{name}");
    }
}

/// The program of the next test.
#[test]
#[ignore = "runs in the terminal of another test"]
fn a_program_that_panics() {
    let screen = Screen::enter().unwrap();
    std::thread::spawn(|| panic!("as the test wants it")).join().unwrap_err();
    drop(screen);
    std::io::stdout().write_all(b"still alive\r\n").unwrap();
}

#[test]
fn a_panic_is_told_on_a_restored_terminal() {
    let desk = Desk::new();
    let this = std::env::current_exe().unwrap();
    let command = [
        this.to_str().unwrap(),
        "life::a_program_that_panics",
        "--exact",
        "--ignored",
        "--nocapture",
    ];
    let start =
        Start { command: &command, folder: desk.0.path(), size: [80, 24], env: &[], answers: true };
    let (status, bytes) = Terminal::start(&start).end();
    assert_eq!(status, 0, "{bytes}");
    let [entered, left, told, after] =
        [ENTER.as_str(), LEAVE.as_str(), "as the test wants it", "still alive"]
            .map(|part| bytes.find(part).unwrap_or_else(|| panic!("no {part:?} in {bytes:?}")));
    assert!(entered < left && left < told && told < after, "{bytes:?}");
    assert_eq!(bytes.matches(LEAVE.as_str()).count(), 1);
}

#[test]
fn without_a_terminal_one_line_tells_what_to_do() {
    let desk = Desk::with_room();
    let run = Command::new(PROGRAM)
        .arg("room.toml")
        .current_dir(desk.0.path())
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let told = String::from_utf8(run.stderr).unwrap();
    assert_eq!((run.status.code(), told.lines().count()), (Some(2), 1), "{told}");
    assert!(told.contains("zerkalo render room.toml"), "{told}");
    assert!(run.stdout.is_empty());

    let command = [PROGRAM];
    let env = [("TERM", "dumb")];
    let start = Start {
        command: &command,
        folder: desk.0.path(),
        size: [80, 24],
        env: &env,
        answers: true,
    };
    let (status, bytes) = Terminal::start(&start).end();
    assert_eq!(status, 2);
    assert!(bytes.contains("zerkalo render") && !bytes.contains('\x1b'), "{bytes:?}");
}

#[test]
fn a_missing_file_is_told_outside() {
    let desk = Desk::new();
    let (status, bytes) = desk.open(&["nowhere.toml"], [80, 24]).end();
    assert_eq!(status, 1);
    assert!(bytes.contains("nowhere.toml") && !bytes.contains(ENTER.as_str()), "{bytes:?}");
}

#[test]
fn the_picture_follows_the_size_of_the_terminal() {
    let desk = Desk::new();
    let mut terminal = desk.open(&[], [80, 24]);
    let cells = |what: &str, wanted: std::ops::Range<usize>| {
        terminal.wait_for(what, |s| wanted.contains(&picture_cells(s)).then_some(()));
    };
    cells("a small picture", 800..1100);
    terminal.resize([160, 45]);
    cells("a larger picture", 3000..5000);
    terminal.resize([30, 8]);
    terminal.wait_for("no picture, but a line", |screen| {
        let told = screen.contents().contains("at least");
        (picture_cells(screen) == 0 && told).then_some(())
    });
    terminal.resize([80, 24]);
    cells("the picture again", 800..1100);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn pasted_text_presses_no_keys() {
    let desk = Desk::new();
    let mut terminal = desk.open(&[], [120, 36]);
    wait_for_picture(&terminal);
    terminal.send("\x1b[200~qqq]]]x\x1b[201~");
    // The program goes on, and nothing was edited: it ends without a question.
    terminal.send("?");
    terminal.wait_for_text("orbit left");
    terminal.send("\x1b");
    terminal.wait_until_gone("orbit left");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

/// Over SSH, as far as the program knows.
const SSH: &[(&str, &str)] = &[("SSH_CONNECTION", "192.0.2.1 50000 192.0.2.2 22")];

#[test]
fn a_terminal_that_never_answers_is_served_slowly() {
    let desk = Desk::new();
    let (folder, size) = (desk.0.path(), [120, 36]);
    let start = Start { command: &[PROGRAM], folder, size, env: SSH, answers: false };
    let mut terminal = Terminal::start(&start);
    wait_for_picture(&terminal);
    terminal.wait_for_text("KB/s fixed");
    terminal.send("?");
    terminal.wait_for_text("orbit left");
    terminal.send("\x1b");
    terminal.wait_until_gone("orbit left");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
fn replies_press_no_keys() {
    let desk = Desk::new();
    let (folder, size) = (desk.0.path(), [120, 36]);
    let start = Start { command: &[PROGRAM], folder, size, env: SSH, answers: true };
    let mut terminal = Terminal::start(&start);
    wait_for_picture(&terminal);
    terminal.wait_for_text("KB/s");
    // Replies that nobody asked for press no keys.
    terminal.send("\x1b[24;80R\x1b]11;rgb:1e1e/1e1e/2e2e\x1b\\\x1b[?2026;2$y\x1b_Gi=31;OK\x1b\\\x1b[>0;276;0c");
    terminal.send("?");
    terminal.wait_for_text("orbit left");
    terminal.send("\x1b");
    terminal.wait_until_gone("orbit left");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

/// A terminal that answers nothing is waited for, but not when somebody wants the program to end.
#[test]
fn a_signal_is_heeded_while_the_terminal_is_asked() {
    let desk = Desk::with_room();
    let env = [("SSH_CONNECTION", "192.0.2.7 5000 192.0.2.1 22")];
    let command = [PROGRAM, "room.toml"];
    let start = Start {
        command: &command,
        folder: desk.0.path(),
        size: [80, 24],
        env: &env,
        answers: false,
    };
    // It waits for two seconds; where the machine lets the signal be later, the screen has been drawn.
    let heeded = (0..3).any(|_| {
        let terminal = Terminal::start(&start);
        terminal.wait_for("the screen is taken", |screen| screen.alternate_screen().then_some(()));
        signal("TERM", terminal.process_id());
        let (status, bytes) = terminal.end();
        assert_eq!(status, 143);
        assert!(bytes.ends_with(LEAVE.as_str()));
        !bytes.contains("room.toml")
    });
    assert!(heeded, "it goes on asking");
}
