//! Limits of the dashboard's memory and number of threads.

use super::*;
use crate::harness::*;

/// Checks the refusal of a film of 4.4 GB under a limit of 1.5 GB of address space.
#[test]
#[cfg(target_os = "linux")]
fn film_that_does_not_fit_is_refused_in_the_dashboard() {
    let fixture = Fixture::new();
    let scene = MIRROR_ROOM.replace("size = [640, 480]", "size = [16384, 4096]");
    fs::write(fixture.path("large.toml"), scene).unwrap();
    let script = "ulimit -v 1500000; exec \"$0\" large.toml --threads 2";
    let mut terminal = Terminal::start(&Start {
        command: &["sh", "-c", script, PROGRAM],
        folder: fixture.0.path(),
        size: [150, 36],
        env: &[],
        replies: true,
    });
    terminal.wait_for_text("This scene cannot be rendered");
    let text = terminal.screen(vt100::Screen::contents);
    for part in ["16384 x 4096 pixels", "ulimit -v", "Expected a smaller picture, such as size = ["]
    {
        assert!(text.contains(part), "no {part:?} in\n{text}");
    }
    assert_eq!(terminal.screen(picture_cells), 0);
    // The scene can still be edited. The outline has the focus.
    terminal.send("]");
    terminal.wait_for_text("large.toml ●");
    terminal.send("u");
    terminal.wait_until_gone("large.toml ●");
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

#[test]
#[cfg(target_os = "linux")]
fn thousands_of_threads_are_reduced_and_can_be_quit() {
    let fixture = Fixture::with_room();
    let mut terminal = fixture.open(&["room.toml", "--threads", "4096"], [100, 30]);
    wait_for_picture(&terminal);
    let tasks = fs::read_dir(format!("/proc/{}/task", terminal.process_id())).unwrap().count();
    let processors = std::thread::available_parallelism().unwrap().get();
    // The dashboard has less than twenty threads besides the tracing threads.
    assert!(tasks < (4 * processors).clamp(16, 4096) + 20, "{tasks} threads");
    terminal.send("q");
    let start = std::time::Instant::now();
    assert_eq!(terminal.end().0, 0);
    println!("{tasks} threads; quit in {:.3} s", start.elapsed().as_secs_f64());
}
