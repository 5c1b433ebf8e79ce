//! Input latency of the dashboard, in a terminal of 160x45 cells with keys pressed at a fixed rate.
//! The program itself records the latencies (`--trace`). A latency is the time from reading a key
//! until the program has written the frame that shows the effect of this key.

#[path = "../tests/pty/terminal.rs"]
mod terminal;

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use terminal::{Start, Terminal};

/// Text of `scenes/mirror-room.toml`.
const MIRROR_ROOM: &str = include_str!("../scenes/mirror-room.toml");

const PROGRAM: &str = env!("CARGO_BIN_EXE_zerkalo");
const SIZE: [u16; 2] = [160, 45];

/// Escape sequences of arrow keys whose camera moves cancel each other.
const ARROWS: [&str; 4] = ["\x1b[C", "\x1b[A", "\x1b[D", "\x1b[B"];

/// Latency of one key press, read from a line of the file that `--trace` writes. `picture` is
/// `true` if the response is a new picture, and `false` if only panels change.
struct Event {
    picture: bool,
    milliseconds: f64,
}

fn main() {
    // `cargo test --benches` runs this program without `--bench`. It measures nothing then.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let folder = TempDir::new().unwrap();
    let room = folder.path().join("room.toml");
    fs::write(&room, MIRROR_ROOM).unwrap();
    // Single presses, while the picture converges.
    let single = press_keys(folder.path(), 40, Duration::from_millis(250));
    report("single keys, 640x480, to picture", &single, true);
    // A key held down for ten seconds.
    let held = press_keys(folder.path(), 300, Duration::from_nanos(1_000_000_000 / 30));
    report("held key, 640x480, to picture", &held, true);
    if let Some(last) = held.iter().rfind(|event| event.picture) {
        println!("{:44} {:6.1} ms", "last key of those to its picture", last.milliseconds);
    }
    println!("{:44} {:6.2} %", "one core when converged", idle_percent(folder.path()));
    fs::write(&room, MIRROR_ROOM.replace("size = [640, 480]", "size = [3840, 2160]")).unwrap();
    let large = press_keys(folder.path(), 40, Duration::from_millis(250));
    report("single keys, 3840x2160, to screen", &large, false);
    report("single keys, 3840x2160, to picture", &large, true);
}

/// Starts the program in `folder` and waits for its first picture.
fn open(folder: &Path, more: &[&str]) -> Terminal {
    // Removes the unsaved edits of the previous run, because the dashboard would ask about them.
    let _ = fs::remove_file(folder.join(".room.toml.unsaved"));
    let command = [&[PROGRAM, "room.toml"], more].concat();
    let terminal =
        Terminal::start(&Start { command: &command, folder, size: SIZE, env: &[], replies: true });
    terminal.wait_for_text("spp");
    std::thread::sleep(Duration::from_millis(500));
    terminal
}

/// Presses `count` arrow keys at intervals of `interval`. If the interval is longer than 100 ms,
/// also presses `z` after half of each interval; this key toggles the panels. Returns the recorded
/// events.
fn press_keys(folder: &Path, count: usize, interval: Duration) -> Vec<Event> {
    let trace = folder.join("trace.csv");
    let mut terminal = open(folder, &["--trace", trace.to_str().unwrap()]);
    let start = Instant::now();
    for i in 0..count {
        let due = start + interval * i as u32;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        terminal.send(ARROWS[i % ARROWS.len()]);
        if interval > Duration::from_millis(100) {
            // `z` shows or hides the panels. Its effect is visible in the next frame, without a new
            // picture.
            std::thread::sleep(interval / 2);
            terminal.send("z");
        }
    }
    std::thread::sleep(Duration::from_secs(2));
    end(terminal);
    let text = fs::read_to_string(trace).unwrap();
    let event = |line: &str| {
        let fields: Vec<_> = line.split(',').collect();
        Event { picture: fields[1] == "picture", milliseconds: fields[2].parse().unwrap() }
    };
    text.lines().skip(1).map(event).collect()
}

/// Returns the processor time that the program uses after the picture has converged, in percent of
/// one processor.
fn idle_percent(folder: &Path) -> f64 {
    let mut terminal = open(folder, &[]);
    terminal.send("T");
    terminal.wait_for_text("top at");
    terminal.send("\x15spp 16\r");
    terminal.wait_for_text("resting");
    std::thread::sleep(Duration::from_secs(3));
    let seconds = 10;
    let before = processor_ticks(terminal.process_id());
    std::thread::sleep(Duration::from_secs(seconds));
    let ticks = processor_ticks(terminal.process_id()) - before;
    end(terminal);
    // A clock tick is 1/100 s on Linux. The number of ticks per second is therefore the load of one
    // processor in percent.
    ticks as f64 / seconds as f64
}

/// Returns the sum of user and system time of the process `id` in clock ticks (fields 14 and 15 of
/// proc_pid_stat(5)).
fn processor_ticks(id: u32) -> u64 {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap();
    let after_name = stat.rsplit_once(')').unwrap().1;
    after_name.split_whitespace().skip(11).take(2).map(|n| n.parse::<u64>().unwrap()).sum()
}

/// Ends the program by SIGTERM. After this signal, the program does not ask about unsaved edits.
fn end(terminal: Terminal) {
    let id = terminal.process_id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    terminal.end();
}

fn report(what: &str, events: &[Event], picture: bool) {
    let of_kind = events.iter().filter(|event| event.picture == picture);
    let mut sorted: Vec<_> = of_kind.map(|event| event.milliseconds).collect();
    sorted.sort_by(f64::total_cmp);
    let quantile = |share: f64| {
        let rank = (share * sorted.len() as f64).ceil() as usize;
        sorted.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
    };
    let [median, p99, max] = [0.5, 0.99, 1.0].map(quantile);
    println!(
        "{what:44} {median:6.1} ms median, {p99:6.1} ms p99, {max:6.1} ms max  ({} keys)",
        sorted.len()
    );
}
