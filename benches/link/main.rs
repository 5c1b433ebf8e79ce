//! Latency from a key to the first change of the picture over a slow connection. The program runs
//! behind an OpenSSH server: directly, in tmux, and in screen.
//!
//! A relay on loopback limits the rate and delays all bytes. With `--tunnel`, a pair of TUN devices
//! does this instead. The server's own TCP connection then has the simulated round-trip time. With
//! `--buffer`, the relay buffers 48 KiB, as a jump host does.
//! `benches/link.sh` installs the required programs.
//!
//! The arguments are a text and the number of keys. The bench measures only the table rows whose
//! names contain the text. `ZERKALO_PROGRAM` is the path of another build of the program, for
//! comparison.

#[path = "../../tests/pty/terminal.rs"]
mod terminal;

mod relay;
mod server;
mod tunnel;

use relay::Relay;
use server::Server;
use std::collections::BTreeMap;
use std::fs;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use terminal::{Start, Terminal};
use tunnel::Tunnel;
use zerkalo_terminal::cells::Oklab;

/// Text of `scenes/mirror-room.toml`.
const MIRROR_ROOM: &str = include_str!("../../scenes/mirror-room.toml");

const PROGRAM: &str = env!("CARGO_BIN_EXE_zerkalo");
const SIZE: [u16; 2] = [160, 45];
/// Simulated connections, each as name, bytes per second, and one-way delay.
const LINKS: [(&str, f64, Duration); 2] = [
    ("1 Mbit/s, 100 ms", 125e3, Duration::from_millis(50)),
    ("256 kbit/s, 300 ms", 32e3, Duration::from_millis(150)),
];
/// Number of keys that are pressed unless an argument gives another one.
const KEYS: usize = 40;
/// Escape sequences of arrow keys whose camera moves cancel each other.
const ARROWS: [&str; 4] = ["\x1b[C", "\x1b[C", "\x1b[D", "\x1b[D"];

fn main() {
    // `cargo test --benches` runs this program without `--bench`. It measures nothing then.
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let keys = arguments.iter().find_map(|a| a.parse().ok()).unwrap_or(KEYS);
    let part = arguments.iter().find(|a| !a.starts_with('-') && a.parse::<usize>().is_err());
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("room.toml"), MIRROR_ROOM).unwrap();
    let has_buffer = arguments.iter().any(|argument| argument == "--buffer");
    let buffer = relay::RECEIVE_BUFFERS[usize::from(has_buffer)];
    let has_tunnel = arguments.iter().any(|argument| argument == "--tunnel");
    println!(
        "{:50} {:>7} {:>7} {:>7} {:>5}  rate reported while and after the picture converges",
        "", "median", "p95", "max", "keys"
    );
    for link in LINKS {
        let rows = ROWS.iter().map(|row| (format!("{}: {}", link.0, row.name), row));
        let rows: Vec<_> = rows.filter(|(name, _)| part.is_none_or(|p| name.contains(p))).collect();
        if rows.is_empty() {
            continue;
        }
        let tunnel = match has_tunnel.then(|| Tunnel::start(link.1, link.2)).transpose() {
            Ok(tunnel) => tunnel,
            Err(why) => return println!("skipped: {why}"),
        };
        let server = match Server::start(folder.path(), tunnel.as_ref()) {
            Ok(server) => server,
            Err(why) => return println!("skipped: {why}"),
        };
        let address = match &tunnel {
            Some(_) => server.address,
            None => Relay::start(server.address, link.1, link.2, buffer).unwrap().address,
        };
        for (name, row) in rows {
            if row.host.is_missing() {
                println!("{name:50} skipped, there is no such program");
                continue;
            }
            measure(&name, row, keys, &server, address, folder.path());
        }
    }
}

/// Terminal multiplexer in which the dashboard runs, if any.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Host {
    None,
    /// tmux, with this value of its option `allow-passthrough`: `on` or `off`.
    Tmux(&'static str),
    Screen,
}

impl Host {
    fn is_missing(self) -> bool {
        let program = match self {
            Self::None => return false,
            Self::Tmux(_) => "tmux",
            Self::Screen => "screen",
        };
        Command::new(program).arg("-V").output().is_err()
    }

    /// Returns the command that runs `program` in this multiplexer.
    fn command(self, folder: &Path, program: &str) -> String {
        let settings = folder.join("settings");
        let name = format!("zerkalo-bench-{}", std::process::id());
        let (text, command) = match self {
            Self::None => return program.to_string(),
            Self::Tmux(passthrough) => (
                format!(
                    "set -g allow-passthrough {passthrough}\nset -g status off\nset -g escape-time 10\n\
                     set -as terminal-features ',*:RGB'\n"
                ),
                format!("tmux -L {name} -f {} new-session '{program}'", settings.display()),
            ),
            Self::Screen => (
                "startup_message off\nterm screen-256color\n".to_string(),
                format!("screen -c {} -S {name} sh -c '{program}'", settings.display()),
            ),
        };
        fs::write(settings, text).unwrap();
        command
    }

    /// Ends the multiplexer.
    fn end(self) {
        let name = format!("zerkalo-bench-{}", std::process::id());
        let (program, arguments): (_, &[&str]) = match self {
            Self::None => return,
            Self::Tmux(_) => ("tmux", &["-L", &name, "kill-server"]),
            Self::Screen => ("screen", &["-S", &name, "-X", "quit"]),
        };
        let _ = Command::new(program).args(arguments).output();
    }
}

/// Periods in which the simulated terminal replies to requests of the dashboard.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Replies {
    Always,
    /// The terminal replies until the dashboard is open; later replies are lost.
    Lost,
    Never,
}

/// Settings of one measurement, which is printed as one row of the table.
#[derive(Clone, Copy)]
struct Row {
    name: &'static str,
    host: Host,
    options: &'static str,
    replies: Replies,
}

const ROWS: [Row; 7] = [
    Row { name: "plain", host: Host::None, options: "", replies: Replies::Always },
    Row { name: "replies lost", host: Host::None, options: "", replies: Replies::Lost },
    Row { name: "no replies", host: Host::None, options: "", replies: Replies::Never },
    Row {
        name: "--bandwidth 30",
        host: Host::None,
        options: "--bandwidth 30",
        replies: Replies::Always,
    },
    Row {
        name: "tmux, passthrough",
        host: Host::Tmux("on"),
        options: "",
        replies: Replies::Always,
    },
    Row {
        name: "tmux, no passthrough",
        host: Host::Tmux("off"),
        options: "",
        replies: Replies::Always,
    },
    // GNU screen 4 knows no 24-bit colours.
    Row { name: "screen", host: Host::Screen, options: "--color 256", replies: Replies::Always },
];

/// Measures the latency from a key press to the new picture under the conditions of `row`, a row of
/// the printed table. Opens the dashboard and presses keys while the picture converges. Also reads
/// the reported rate of the connection, both then and after the picture has converged.
fn measure(
    name: &str,
    row: &Row,
    keys: usize,
    server: &Server,
    address: SocketAddr,
    folder: &Path,
) {
    let program = std::env::var("ZERKALO_PROGRAM").unwrap_or(PROGRAM.to_string());
    let room = folder.join("room.toml");
    let program = format!("COLORTERM=truecolor {program} {} {}", room.display(), row.options);
    let command = server.ssh(address, &row.host.command(folder, &program));
    let words: Vec<&str> = command.iter().map(String::as_str).collect();
    let replies = row.replies != Replies::Never;
    let start = Start { command: &words, folder, size: SIZE, env: &[], replies };
    let mut terminal = Terminal::start(&start);
    terminal.wait_for_text("spp");
    terminal.set_replying(row.replies == Replies::Always);
    // This noise target is too low to be reached during the measurement. The picture therefore
    // keeps converging while the keys are pressed.
    terminal.send("T");
    terminal.wait_for_text("top at");
    terminal.send("\x15noise 0.01\r");
    std::thread::sleep(Duration::from_secs(if row.replies == Replies::Lost { 12 } else { 3 }));
    let mut seconds: Vec<f64> = (0..keys).map(|i| press_key(&mut terminal, i)).collect();
    seconds.sort_by(f64::total_cmp);
    let quantile = |share: f64| seconds[((share * keys as f64).ceil() as usize).max(1) - 1];
    let mut rates = vec![status(&terminal)];
    // Measures the rate a second time, after the picture has converged. The program then sends few
    // bytes.
    terminal.send("T");
    terminal.wait_for_text("top at");
    terminal.send("\x15noise 2\r");
    std::thread::sleep(Duration::from_secs(20));
    rates.push(status(&terminal));
    terminal.send("q");
    std::thread::sleep(Duration::from_secs(3));
    // The arrow keys have moved the camera, which is an unsaved edit. The program asks whether to
    // save it; the key `d` discards it.
    if terminal.screen(|screen| screen.contents().contains("unsaved edits")) {
        terminal.send("d");
        std::thread::sleep(Duration::from_secs(3));
    }
    row.host.end();
    drop(terminal);
    println!(
        "{name:50} {:5.3} s {:5.3} s {:5.3} s {keys:5}  {}",
        quantile(0.5),
        quantile(0.95),
        quantile(1.0),
        rates.join("; "),
    );
}

/// Presses key number `i`. Returns the seconds until 25 cells of the picture have clearly changed
/// in colour.
fn press_key(terminal: &mut Terminal, i: usize) -> f64 {
    // The pauses differ in length, so that the keys do not stay in phase with a periodic update.
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

/// Returns the colours of the picture's cells on the screen, by row and column.
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
            vt100::Color::Idx(index) => Some(((row, column), indexed(index))),
            vt100::Color::Default => None,
        }
    };
    cells.filter_map(color).collect()
}

/// Returns the colour with this index in xterm's palette of 256 colours. The first 16 colours
/// depend on the terminal; this function returns black for them.
fn indexed(index: u8) -> [u8; 3] {
    const LEVELS: [u8; 6] = [0, 95, 135, 175, 215, 255];
    match index {
        0..16 => [0; 3],
        16..232 => [36, 6, 1].map(|step| LEVELS[usize::from((index - 16) / step % 6)]),
        232.. => [8 + 10 * (index - 232); 3],
    }
}

/// Returns the part of the dashboard's status line that describes the connection.
fn status(terminal: &Terminal) -> String {
    terminal.screen(|screen| {
        let text = screen.contents();
        let line = text.lines().find(|line| line.contains("B/s")).unwrap_or_default();
        let parts: Vec<_> = line.split("  ").filter(|part| part.contains("B/s")).collect();
        parts.first().map_or("no rate is shown".to_string(), |part| part.trim().to_string())
    })
}
