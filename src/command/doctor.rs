//! `zerkalo doctor`: reports the capabilities of the terminal and of the connection, and how to
//! improve them.

use crate::command::args::JsonArgs;
use crate::command::edit::obstacle;
use crate::command::{Failure, print_json, print_line};
use crate::dashboard::graphics::Graphics;
use crate::dashboard::run::{Colors, TerminalReport, diagnose};
use crate::dashboard::text::wrapped;
use serde_json::{Map, Value};
use std::env;
use std::time::Duration;
use zerkalo_scene::value::sanitized;
use zerkalo_terminal::cells::Blocks;
use zerkalo_terminal::flow::PacingMode;
use zerkalo_terminal::image::{GraphicsMode, Protocol};
use zerkalo_terminal::{Capabilities, Environment, Multiplexer};

/// Width of the report in columns.
const COLUMNS: usize = 80;
/// Width of the names at the start of lines, in columns.
const NAME: usize = 17;

pub fn run(args: JsonArgs) -> Result<(), Failure> {
    let variable = |name: &str| env::var(name).ok().filter(|value| !value.is_empty());
    let environment = Environment::of(variable);
    let diagnosis = match obstacle(&environment) {
        Some(reason) => Err(reason),
        None => Ok(diagnose(environment.clone())
            .map_err(|error| format!("the terminal cannot be used: {error}"))?),
    };
    let report = DoctorReport {
        environment,
        diagnosis,
        locale: ["LC_ALL", "LC_CTYPE", "LANG"]
            .into_iter()
            .find_map(|name| variable(name).map(|value| (name, value))),
    };
    match args.json {
        true => print_json(&report.results()),
        false => print_line(&report.report()),
    }
}

/// Results of all tests, from which the report is formatted.
struct DoctorReport {
    environment: Environment,
    /// Reply of the terminal, or the reason why it was not queried.
    diagnosis: Result<TerminalReport, &'static str>,
    /// Environment variable that sets the character encoding, and its value. `None` if none is set.
    locale: Option<(&'static str, String)>,
}

impl DoctorReport {
    fn report(&self) -> String {
        let mut lines = vec![format!("zerkalo {}", env!("CARGO_PKG_VERSION")), String::new()];
        let row = |(name, value): (&str, String)| indented(&format!("{name:<NAME$}"), &value);
        lines.extend(self.rows().into_iter().map(row));
        if self.is_utf8() && self.level() == Colors::True {
            lines.extend([String::new(), FONT.to_string()]);
            lines.extend(test_card());
        }
        let hints = self.hints();
        if !hints.is_empty() {
            lines.extend([String::new(), "hints".to_string()]);
            lines.extend(hints.iter().map(|hint| indented("- ", hint)));
        }
        lines.join("\n")
    }

    /// Returns the results of `--json`: the rows of the report by their names, and the hints.
    fn results(&self) -> Value {
        let mut results: Map<_, _> = self
            .rows()
            .into_iter()
            .map(|(name, value)| (name.replace(' ', "_"), value.into()))
            .collect();
        results.insert("version".to_string(), env!("CARGO_PKG_VERSION").into());
        results.insert("hints".to_string(), self.hints().into());
        results.into()
    }

    /// Returns names and values of the rows of the report.
    fn rows(&self) -> Vec<(&'static str, String)> {
        let mut rows = vec![
            ("terminal", self.terminal()),
            ("multiplexer", self.multiplexer()),
            ("colours", self.colors()),
        ];
        if let Ok(TerminalReport { terminal, mode, cells }) = &self.diagnosis {
            let live = Graphics::new(terminal.clone(), GraphicsMode::Automatic);
            rows.extend([
                ("background", background(terminal)),
                ("size", size(*cells, terminal.cell_px)),
                ("whole frames", whole_frames(terminal).to_string()),
                ("still pictures", stills(terminal)),
                ("live picture", live.description()),
                ("acknowledgement", acknowledgement(*mode).to_string()),
                ("round trip", round_trip(terminal)),
            ]);
        }
        rows.extend([("connection", self.connection()), ("text", self.text())]);
        rows
    }

    fn capabilities(&self) -> Option<&Capabilities> {
        self.diagnosis.as_ref().ok().map(|diagnosis| &diagnosis.terminal)
    }

    fn level(&self) -> Colors {
        self.capabilities().map_or(self.environment.colors(), |terminal| terminal.colors)
    }

    fn is_utf8(&self) -> bool {
        let encoding = |value: &str| value.to_ascii_lowercase().replace('-', "");
        self.locale.as_ref().is_some_and(|(_, value)| encoding(value).contains("utf8"))
    }

    fn terminal(&self) -> String {
        let term = match self.environment.term.as_str() {
            "" => "TERM is not set".to_string(),
            term => format!("TERM={}", sanitized(term)),
        };
        match (&self.diagnosis, self.capabilities().and_then(|terminal| terminal.version.as_ref()))
        {
            (Ok(_), Some(version)) => format!("{} ({term})", sanitized(version)),
            (Ok(_), None) => format!("{term}; it does not report its name"),
            (Err(reason), _) => format!("{term}; not queried: {reason}"),
        }
    }

    fn multiplexer(&self) -> String {
        let name = match self.environment.multiplexer {
            None => return "none".to_string(),
            Some(Multiplexer::Tmux) => "tmux",
            Some(Multiplexer::Screen) => "GNU Screen",
        };
        match self.capabilities().map(|terminal| terminal.passthrough) {
            None => name.to_string(),
            Some(Some(_)) => format!("{name}, which passes queries through"),
            Some(None) => format!("{name}, which passes no queries through"),
        }
    }

    /// Describes the set of colours that the dashboard uses, and the reason for it.
    fn colors(&self) -> String {
        let Environment { term, color_term, no_color, .. } = &self.environment;
        let level = self.level();
        let environment_colors = self.environment.colors();
        let source = if *no_color {
            "NO_COLOR is set".to_string()
        } else if level != environment_colors {
            "the terminal confirmed a 24-bit colour".to_string()
        } else if ["truecolor", "24bit"].contains(&color_term.as_str()) {
            format!("COLORTERM={color_term}")
        } else if level == Colors::Indexed {
            "no sign of more".to_string()
        } else {
            format!("TERM={}", sanitized(term))
        };
        format!("{}: {source}; --color overrides, # switches in the dashboard", level.name())
    }

    fn text(&self) -> String {
        match &self.locale {
            None => "LC_ALL, LC_CTYPE and LANG do not name the encoding".to_string(),
            Some((name, value)) => {
                let encoding = if self.is_utf8() { "UTF-8" } else { "not UTF-8" };
                format!("{encoding}: {name}={}", sanitized(value))
            }
        }
    }

    fn connection(&self) -> String {
        match &self.environment.ssh {
            None => "this machine".to_string(),
            Some(variable) => {
                let client = variable.split_whitespace().next().unwrap_or_default();
                format!("SSH from {}", sanitized(client))
            }
        }
    }

    fn hints(&self) -> Vec<&'static str> {
        let Environment { color_term, no_color, ssh, multiplexer, .. } = &self.environment;
        let is_remote = ssh.is_some();
        let few_colors = self.level() != Colors::True && !no_color;
        let tmux = *multiplexer == Some(Multiplexer::Tmux);
        let screen = *multiplexer == Some(Multiplexer::Screen);
        let is_opaque = self.capabilities().is_some_and(|terminal| terminal.passthrough.is_none());
        let hints = [
            (
                is_remote,
                "ssh -C: a quarter of the bytes, on a slow connection four times the frames",
            ),
            (
                is_remote && multiplexer.is_none(),
                "tmux on this machine keeps the session when the connection drops",
            ),
            (
                is_remote && color_term.is_empty() && few_colors,
                "SendEnv COLORTERM in ~/.ssh/config on your machine, AcceptEnv COLORTERM in \
                 /etc/ssh/sshd_config here: transmits the number of colours",
            ),
            (
                tmux && is_opaque,
                "set -g allow-passthrough on in ~/.tmux.conf: replies come from the terminal",
            ),
            (
                tmux && few_colors,
                "set -as terminal-features ',*:RGB' in ~/.tmux.conf: 24-bit colour",
            ),
            (screen && few_colors, "truecolor on in ~/.screenrc (GNU Screen 5): 24-bit colour"),
            (
                !self.is_utf8(),
                "a UTF-8 locale, such as LANG=C.UTF-8: the picture is made of half blocks",
            ),
        ];
        hints.into_iter().filter(|(applies, _)| *applies).map(|(_, hint)| hint).collect()
    }
}

/// Explanation of the test card.
const FONT: &str = "font: --graphics quadrants, sextants or octants where the zigzag has no gaps";

/// Returns the lines of frames with a zigzag in each set of block characters.
fn test_card() -> Vec<String> {
    const CELLS: [usize; 2] = [16, 2];
    let mut lines = vec![String::new(); CELLS[1] + 2];
    for blocks in [Blocks::Quadrants, Blocks::Sextants, Blocks::Octants] {
        let grid = blocks.grid();
        let height = CELLS[1] * grid[1];
        let is_below = |x: usize, y: usize| (x % (2 * height)).abs_diff(height) > height - 1 - y;
        let glyph = |column: usize, row: usize| {
            let pixel = |i: usize| [column * grid[0] + i % grid[0], row * grid[1] + i / grid[0]];
            let mask = (0..grid[0] * grid[1]).map(|i| {
                let [x, y] = pixel(i);
                usize::from(is_below(x, y)) << i
            });
            blocks.glyph(mask.sum())
        };
        lines[0] += &format!("┌{:─<1$}┐ ", format!(" {} ", blocks.name()), CELLS[0]);
        for row in 0..CELLS[1] {
            let zigzag: String = (0..CELLS[0]).map(|column| glyph(column, row)).collect();
            lines[1 + row] += &format!("│{zigzag}│ ");
        }
        lines[CELLS[1] + 1] += &format!("└{}┘ ", "─".repeat(CELLS[0]));
    }
    lines
}

/// Returns `name` followed by `value`, wrapped with a hanging indent.
fn indented(name: &str, value: &str) -> String {
    let lines = wrapped(value, (COLUMNS - name.len()) as u16);
    name.to_string() + &lines.join(&format!("\n{:1$}", "", name.len()))
}

fn background(terminal: &Capabilities) -> String {
    match terminal.background {
        None => "unknown".to_string(),
        Some([r, g, b]) => {
            // Rec. 601 luma suffices to distinguish dark from light.
            let luma = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
            let shade = if luma < 128.0 { "dark" } else { "light" };
            format!("#{r:02x}{g:02x}{b:02x}, {shade}")
        }
    }
}

fn size([columns, rows]: [u16; 2], cell_px: Option<[u16; 2]>) -> String {
    let pixels = cell_px.map_or(String::new(), |[width, height]| {
        let [width, height] = [width.saturating_mul(columns), height.saturating_mul(rows)];
        format!(", {width} x {height} pixels")
    });
    format!("{columns} x {rows} cells{pixels}")
}

fn whole_frames(terminal: &Capabilities) -> &'static str {
    match terminal.synchronised {
        true => "shown at once (mode 2026)",
        false => "shown while they arrive (no mode 2026)",
    }
}

fn stills(terminal: &Capabilities) -> String {
    let missing = match Protocol::of(terminal) {
        Protocol::Sixel(colors) => return format!("crisp on o, by sixel in {colors} colours"),
        Protocol::Blocks if terminal.kitty_graphics => "its version of kitty has no placeholders",
        Protocol::Blocks if terminal.sixel => "sixel needs the size of a cell in pixels",
        Protocol::Blocks => "neither kitty's protocol nor sixel",
        protocol => return format!("crisp on o, by {}", protocol.name()),
    };
    format!("on o in half blocks: {missing}")
}

fn acknowledgement(mode: PacingMode) -> &'static str {
    match mode {
        PacingMode::Unlimited => "none needed (local terminal)",
        PacingMode::AckClocked(None) => "replies of the terminal",
        PacingMode::AckClocked(Some(_)) => "replies of the terminal, through the multiplexer",
        PacingMode::SendQueue => "length of the TCP send queue (/proc/net/tcp)",
        PacingMode::FixedRate => "none: frames are sent at a fixed rate; --bandwidth sets it",
    }
}

fn round_trip(terminal: &Capabilities) -> String {
    let ms = |time: Duration| format!("{:.1} ms", 1e3 * time.as_secs_f64());
    match (terminal.round_trip, terminal.passthrough) {
        (None, _) => "no reply".to_string(),
        (Some(near), Some(far)) => format!("{}; to the multiplexer {}", ms(far), ms(near)),
        (Some(near), None) => ms(near),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(variables: &[(&str, &str)], queried: bool) -> DoctorReport {
        let environment = Environment::of(|name| {
            let variable = variables.iter().find(|(known, _)| *known == name);
            variable.map(|(_, value)| value.to_string())
        });
        let terminal = Capabilities::from_environment(environment.clone());
        let diagnosis = TerminalReport { terminal, mode: PacingMode::Unlimited, cells: [120, 36] };
        DoctorReport {
            environment,
            diagnosis: if queried { Ok(diagnosis) } else { Err("no terminal") },
            locale: Some(("LANG", "en_US.UTF-8".into())),
        }
    }

    fn diagnosis(report: &mut DoctorReport) -> &mut TerminalReport {
        report.diagnosis.as_mut().unwrap_or_else(|reason| panic!("{reason}"))
    }

    fn check(report: &DoctorReport, present: &[&str], absent: &[&str]) {
        let text = report.report();
        for part in present {
            assert!(text.contains(part), "no {part:?} in\n{text}");
        }
        for part in absent {
            assert!(!text.contains(part), "{part:?} in\n{text}");
        }
    }

    #[test]
    fn full_featured_local_terminal_gets_no_hints() {
        let mut report = report(&[("TERM", "xterm-kitty"), ("COLORTERM", "truecolor")], true);
        let diagnosis = diagnosis(&mut report);
        let terminal = &mut diagnosis.terminal;
        terminal.version = Some("kitty(0.40.1)".into());
        terminal.kitty_graphics = true;
        terminal.cell_px = Some([8, 20]);
        terminal.synchronised = true;
        terminal.background = Some([0x1e, 0x1e, 0x2e]);
        terminal.round_trip = Some(Duration::from_micros(1234));
        let present = [
            "kitty(0.40.1) (TERM=xterm-kitty)",
            "120 x 36 cells, 960 x 720 pixels",
            "24-bit colour: COLORTERM=truecolor",
            "#1e1e2e, dark",
            "shown at once",
            "crisp on o, by kitty's protocol\n",
            "UTF-8: LANG=",
            "1.2 ms",
        ];
        check(&report, &present, &["hints", "ssh -C", "unknown"]);
    }

    #[test]
    fn remote_terminal_in_tmux_gets_hints() {
        let variables = [
            ("TERM", "screen-256color"),
            ("TMUX", "/tmp/tmux,1,0"),
            ("SSH_CONNECTION", "192.0.2.7 5000 192.0.2.1 22"),
        ];
        let mut report = report(&variables, true);
        report.locale = Some(("LC_ALL", "C".into()));
        let diagnosis = diagnosis(&mut report);
        diagnosis.mode = PacingMode::FixedRate;
        diagnosis.terminal.round_trip = Some(Duration::from_micros(900));
        let present = [
            "SSH from 192.0.2.7",
            "tmux, which passes no queries through",
            "at a fixed rate",
            "ssh -C",
            "SendEnv COLORTERM",
            "AcceptEnv COLORTERM",
            "allow-passthrough on",
            "terminal-features",
            "not UTF-8: LC_ALL=C",
        ];
        check(&report, &present, &["keeps the session", "truecolor on"]);
        let diagnosis = self::diagnosis(&mut report);
        diagnosis.terminal.colors = Colors::True;
        diagnosis.terminal.passthrough = Some(Duration::from_millis(110));
        diagnosis.mode = PacingMode::AckClocked(Some(Multiplexer::Tmux));
        let present = ["confirmed a 24-bit colour", "110.0 ms; to the multiplexer 0.9 ms"];
        check(&report, &present, &["allow-passthrough", "terminal-features", "SendEnv"]);
    }

    #[test]
    fn report_without_a_terminal_uses_the_environment() {
        let report = report(&[("TERM", "linux"), ("NO_COLOR", "1")], false);
        check(
            &report,
            &["not queried: no terminal", "no colour: NO_COLOR is set"],
            &["round trip"],
        );
    }

    #[test]
    fn report_contains_no_control_characters() {
        let evil = "x\x1b]52;c;aGk=\x07\u{9b}31m\u{202e}";
        let variables =
            [("TERM", evil), ("COLORTERM", evil), ("SSH_CONNECTION", evil), ("STY", evil)];
        let mut report = report(&variables, true);
        report.locale = Some(("LANG", evil.into()));
        diagnosis(&mut report).terminal.version = Some(evil.into());
        let text = report.report();
        let has_control_characters = |line: &str| sanitized(line) != line;
        assert!(!text.lines().any(has_control_characters), "{text:?}");
        assert!(text.matches("u{1b}]52").count() >= 4, "{text}");
    }
}
