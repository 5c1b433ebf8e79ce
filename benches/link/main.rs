//! Latency from a key to the first change of the picture over a slow connection. The program runs behind
//! an OpenSSH server on loopback, plain and inside tmux; a relay limits the rate to 1 Mbit/s and delays
//! all bytes by 50 ms. `benches/link.sh` installs the requirements. Arguments: the name of a row, and the
//! number of keys.

#[path = "../../tests/pty/terminal.rs"]
mod terminal;

mod relay;
mod server;

use relay::Relay;
use server::Server;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use terminal::{Start, Terminal};
use zerkalo::scene::BUILT_IN;
use zerkalo::terminal::cells::Oklab;

const PROGRAM: &str = env!("CARGO_BIN_EXE_zerkalo");
const SIZE: [u16; 2] = [160, 45];
/// 1 Mbit/s, in bytes per second.
const RATE: f64 = 125e3;
const ONE_WAY: Duration = Duration::from_millis(50);
/// Number of keys without argument.
const KEYS: usize = 40;
/// File of the program's messages.
const MESSAGES: &str = "messages.txt";

/// Arrow keys whose moves cancel each other.
const ARROWS: [&str; 4] = ["\x1b[C", "\x1b[C", "\x1b[D", "\x1b[D"];

fn main() {
    // `cargo test --benches` runs it without measurement.
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let keys = arguments.iter().find_map(|a| a.parse().ok()).unwrap_or(KEYS);
    let row = arguments.iter().find(|a| !a.starts_with('-') && a.parse::<usize>().is_err());
    let is_selected = |name: &str| row.is_none_or(|row| row == name);
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("room.toml"), BUILT_IN).unwrap();
    let server = match Server::start(folder.path()) {
        Ok(server) => server,
        Err(why) => return println!("skipped: {why}"),
    };
    println!(
        "{:38} {:>7} {:>7} {:>7} {:>5}  of the line, while visible differences waited",
        "", "median", "p95", "max", "keys"
    );
    let room = folder.path().join("room.toml");
    let [trace, messages] = ["trace.csv", MESSAGES].map(|name| folder.path().join(name));
    // Messages go to a file, because tmux would swallow them in the terminal.
    let program = |options: &str| {
        let [room, trace, messages] = [&room, &trace, &messages].map(|path| path.display());
        format!("COLORTERM=truecolor {PROGRAM} {room} --trace {trace} {options} 2>{messages}")
    };
    let plain = [
        ("plain", "", true),
        ("plain, answers lost after the start", "", false),
        ("plain, --bandwidth 30", "--bandwidth 30", true),
    ];
    for (name, options, replying) in plain.into_iter().filter(|(name, ..)| is_selected(name)) {
        measure(name, keys, &server, folder.path(), &program(options), replying);
    }
    if Command::new("tmux").arg("-V").output().is_err() {
        return println!("inside tmux: skipped, there is no tmux");
    }
    let inside = [("tmux, passthrough", "on"), ("tmux, no passthrough", "off")];
    for (name, passthrough) in inside.into_iter().filter(|(name, _)| is_selected(name)) {
        let settings = folder.path().join("tmux.conf");
        let text = format!(
            "set -g allow-passthrough {passthrough}\nset -g status off\nset -g escape-time 10\n\
             set -as terminal-features ',*:RGB'\n"
        );
        fs::write(&settings, text).unwrap();
        let socket = format!("zerkalo-bench-{}", std::process::id());
        let command =
            format!("tmux -L {socket} -f {} new-session '{}'", settings.display(), program(""));
        measure(name, keys, &server, folder.path(), &command, true);
        let _ = Command::new("tmux").args(["-L", &socket, "kill-server"]).output();
    }
}

/// Measures one row: opens the dashboard, lets it converge, presses keys.
fn measure(name: &str, keys: usize, server: &Server, folder: &Path, program: &str, replying: bool) {
    let _ = fs::remove_file(folder.join(MESSAGES));
    let relay = Relay::start(server.address, RATE, ONE_WAY).unwrap();
    let command = server.ssh(relay.address, program);
    let words: Vec<&str> = command.iter().map(String::as_str).collect();
    let start = Start { command: &words, folder, size: SIZE, env: &[], replies: true };
    let mut terminal = Terminal::start(&start);
    terminal.wait_for_text("spp");
    terminal.set_replying(replying);
    // A noise target out of reach keeps it converging.
    terminal.send("T");
    terminal.wait_for_text("top at");
    terminal.send("\x15noise 0.01\r");
    std::thread::sleep(Duration::from_secs(if replying { 3 } else { 12 }));
    let mut seconds: Vec<f64> = (0..keys).map(|i| press_key(&mut terminal, i)).collect();
    seconds.sort_by(f64::total_cmp);
    let quantile = |share: f64| seconds[((share * keys as f64).ceil() as usize).max(1) - 1];
    let status = status(&terminal);
    terminal.send("q");
    std::thread::sleep(Duration::from_secs(3));
    // The moved camera is an unsaved edit; the prompt is answered.
    if terminal.screen(|screen| screen.contents().contains("unsaved edits")) {
        terminal.send("d");
        std::thread::sleep(Duration::from_secs(3));
    }
    drop(terminal);
    let line = [busy(folder).unwrap_or("not reported".to_string()), status];
    println!(
        "{name:38} {:5.3} s {:5.3} s {:5.3} s {keys:5}  {}",
        quantile(0.5),
        quantile(0.95),
        quantile(1.0),
        line.join("; "),
    );
}

/// Returns the share of the rate used while visible differences waited, from the program's messages.
fn busy(folder: &Path) -> Option<String> {
    let messages = fs::read_to_string(folder.join(MESSAGES)).ok()?;
    let line = messages.lines().find_map(|line| line.split_once("waited for "))?.1;
    let numbers = line.split_whitespace().filter_map(|word| word.parse::<f64>().ok());
    let &[seconds, bytes] = &numbers.collect::<Vec<_>>()[..] else { return None };
    Some(format!("{:.0} % in {seconds:.1} s", 100.0 * bytes / seconds / RATE))
}

/// Presses a key. Returns the seconds until the picture has clearly changed.
fn press_key(terminal: &mut Terminal, i: usize) -> f64 {
    // Irregular pauses.
    std::thread::sleep(Duration::from_millis(1500 + 37 * (i as u64 % 11)));
    let before = terminal.screen(colors);
    let start = Instant::now();
    terminal.send(ARROWS[i % ARROWS.len()]);
    terminal.wait_for("another picture", |screen| {
        let now = colors(screen);
        let changed = before.iter().filter(|(at, old)| {
            let new = now.get(at).copied().unwrap_or([0; 3]);
            Oklab::of(**old).distance(Oklab::of(new)) > 0.12
        });
        (changed.count() >= 25).then_some(())
    });
    start.elapsed().as_secs_f64()
}

/// Returns the colours of the picture's cells.
fn colors(screen: &vt100::Screen) -> BTreeMap<(u16, u16), [u8; 3]> {
    let (rows, columns) = screen.size();
    let cells = (0..rows.get()).flat_map(|row| (0..columns.get()).map(move |column| (row, column)));
    let color = |(row, column)| {
        let cell = screen.cell(row, column)?;
        let color = if cell.contents() == "▄" || cell.contents() == "█" {
            cell.fgcolor()
        } else {
            cell.bgcolor()
        };
        match color {
            vt100::Color::Rgb(r, g, b) => Some(((row, column), [r, g, b])),
            _ => None,
        }
    };
    cells.filter_map(color).collect()
}

/// Returns the part of the status line about the connection.
fn status(terminal: &Terminal) -> String {
    terminal.screen(|screen| {
        let text = screen.contents();
        let line = text.lines().find(|line| line.contains("B/s")).unwrap_or_default();
        let parts: Vec<_> = line.split("  ").filter(|part| part.contains("B/s")).collect();
        parts.first().map_or("no rate is shown".to_string(), |part| part.trim().to_string())
    })
}
