//! `zerkalo doctor`: what the terminal and the line to it can do, how the dashboard will use them, and
//! what would make it better.

use crate::command::args::DoctorArgs;
use crate::command::{Failure, print_line};
use crate::dashboard::overlay_layout::wrapped;
use crate::dashboard::run::{Colors, TerminalReport, diagnose};
use crate::scene::{kept_in, state_folder};
use crate::terminal::flow::{DEFAULT_RATE, PacingMode};
use crate::terminal::image::Protocol;
use crate::terminal::{Capabilities, Environment, Multiplexer};
use crate::value::sanitized;
use std::env;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Columns of the report, and of the names in it.
const COLUMNS: usize = 80;
const NAME: usize = 17;

pub fn run(args: &DoctorArgs) -> Result<(), Failure> {
    let variable = |name: &str| env::var(name).ok().filter(|value| !value.is_empty());
    let surroundings = Environment::of(variable);
    let why_not = if surroundings.term == "dumb" {
        Some("it understands nothing, and the dashboard does not open in it")
    } else if !io::stdin().is_terminal() || !io::stdout().is_terminal() {
        Some("stdin or stdout is no terminal")
    } else {
        None
    };
    let examined = match why_not {
        Some(why) => Err(why),
        None => Ok(diagnose(surroundings.clone(), args.rate)
            .map_err(|error| Failure::Failed(format!("the terminal cannot be used: {error}")))?),
    };
    let state = state_folder(|name| env::var_os(name));
    let found = DoctorReport {
        surroundings,
        examined,
        asked_for_rate: args.rate,
        locale: ["LC_ALL", "LC_CTYPE", "LANG"]
            .into_iter()
            .find_map(|name| variable(name).map(|value| (name, value))),
        kept: state.as_deref().map(kept_in).unwrap_or_default(),
        state,
    };
    print_line(&found.report());
    Ok(())
}

/// Everything that is reported.
struct DoctorReport {
    surroundings: Environment,
    /// What the terminal answered, or why it was not asked.
    examined: Result<TerminalReport, &'static str>,
    asked_for_rate: bool,
    /// The variable that tells the character encoding, and its value.
    locale: Option<(&'static str, String)>,
    state: Option<PathBuf>,
    /// Files of unsaved edits in `state`.
    kept: Vec<PathBuf>,
}

impl DoctorReport {
    fn report(&self) -> String {
        let mut lines = vec![format!("zerkalo {}", env!("CARGO_PKG_VERSION")), String::new()];
        let row = |name: &str, what: String| indented(&format!("{name:<NAME$}"), &what);
        lines.push(row("terminal", self.terminal()));
        lines.push(row("between", self.between()));
        lines.push(row("colours", self.colors()));
        if let Ok(TerminalReport { terminal, mode, cells, pixels, rate }) = &self.examined {
            lines.push(row("background", background(terminal)));
            lines.push(row("size", size(*cells, *pixels)));
            lines.push(row("whole frames", whole_frames(terminal)));
            lines.push(row("still pictures", stills(terminal)));
            lines.push(row("keyboard", "plain key sequences; nothing special is needed".into()));
            lines.push(row("known arrived by", arrival(*mode)));
            lines.push(row("round trip", round_trip(terminal)));
            lines.push(row("rate", self.rate(*mode, *rate)));
        }
        lines.push(row("line", self.line()));
        lines.push(row("text", self.text()));
        lines.push(row("unsaved edits", self.unsaved()));
        lines.extend(self.kept.iter().map(|path| row("", format!("kept: {}", shown(path)))));
        let hints = self.hints();
        if !hints.is_empty() {
            lines.extend([String::new(), "hints".to_string()]);
            lines.extend(hints.iter().map(|hint| indented("- ", hint)));
        }
        lines.join("\n")
    }

    /// The terminal, if it was asked.
    fn asked(&self) -> Option<&Capabilities> {
        self.examined.as_ref().ok().map(|examined| &examined.terminal)
    }

    /// How many colours the dashboard takes it to have.
    fn level(&self) -> Colors {
        self.asked().map_or(self.surroundings.colors(), |terminal| terminal.colors)
    }

    fn is_utf8(&self) -> bool {
        let encoding = |value: &str| value.to_ascii_lowercase().replace('-', "");
        self.locale.as_ref().is_some_and(|(_, value)| encoding(value).contains("utf8"))
    }

    fn terminal(&self) -> String {
        let term = match self.surroundings.term.as_str() {
            "" => "TERM is not set".to_string(),
            term => format!("TERM={}", sanitized(term)),
        };
        match (&self.examined, self.asked().and_then(|terminal| terminal.version.as_ref())) {
            (Ok(_), Some(version)) => format!("{} ({term})", sanitized(version)),
            (Ok(_), None) => format!("{term}; it does not tell its name"),
            (Err(why), _) => format!("{term}; not asked: {why}"),
        }
    }

    fn between(&self) -> String {
        match self.surroundings.multiplexer {
            None => "nothing".to_string(),
            Some(multiplexer) => {
                let name = match multiplexer {
                    Multiplexer::Tmux => "tmux",
                    Multiplexer::Screen => "GNU Screen",
                };
                let passes = self.asked().map(|terminal| terminal.passthrough.is_some());
                match passes {
                    None => name.to_string(),
                    Some(true) => format!("{name}, which lets questions through"),
                    Some(false) => format!("{name}, which lets no questions through"),
                }
            }
        }
    }

    /// The level, and why: the first that says so of NO_COLOR, COLORTERM, TERM, the terminal.
    fn colors(&self) -> String {
        let Environment { term, color_term, no_color, .. } = &self.surroundings;
        let level = self.level();
        let promised = self.surroundings.colors();
        let why = if *no_color {
            "NO_COLOR is set".to_string()
        } else if level != promised {
            "the terminal took a 24-bit colour and said so".to_string()
        } else if ["truecolor", "24bit"].contains(&color_term.as_str()) {
            format!("COLORTERM={color_term}")
        } else if level == Colors::Indexed {
            "nothing says that it has more".to_string()
        } else {
            format!("TERM={}", sanitized(term))
        };
        format!("{}: {why}; --color overrides, # switches in the dashboard", level.name())
    }

    fn text(&self) -> String {
        match &self.locale {
            None => "LC_ALL, LC_CTYPE and LANG do not tell the encoding".to_string(),
            Some((name, value)) => {
                let what = if self.is_utf8() { "UTF-8" } else { "not UTF-8" };
                format!("{what}: {name}={}", sanitized(value))
            }
        }
    }

    fn line(&self) -> String {
        match &self.surroundings.ssh {
            None => "this machine".to_string(),
            Some(connection) => {
                let client = connection.split_whitespace().next().unwrap_or_default();
                format!("SSH from {}", sanitized(client))
            }
        }
    }

    fn rate(&self, mode: PacingMode, rate: Option<f64>) -> String {
        let kilobytes = |rate: f64| format!("{:.0} KB/s", 1e-3 * rate);
        match (rate, self.asked_for_rate) {
            (Some(rate), _) => format!("{}, measured", kilobytes(rate)),
            (None, true) => "cannot be measured: the terminal itself does not answer".to_string(),
            (None, false) if mode == PacingMode::FixedRate => {
                format!("{}, fixed; doctor --rate measures", kilobytes(DEFAULT_RATE))
            }
            (None, false) => "not measured; doctor --rate does".to_string(),
        }
    }

    fn unsaved(&self) -> String {
        let state = match &self.state {
            Some(state) => format!("without a file, or where that cannot be, in {}", shown(state)),
            None => "without a file nowhere: neither XDG_STATE_HOME nor HOME is set".to_string(),
        };
        format!("beside the scene as .NAME.unsaved; {state}")
    }

    fn hints(&self) -> Vec<String> {
        let Environment { color_term, no_color, ssh, multiplexer, .. } = &self.surroundings;
        let asked = self.asked();
        let few_colors = self.level() != Colors::True && !no_color;
        let tmux = *multiplexer == Some(Multiplexer::Tmux);
        let mut hints = Vec::new();
        if ssh.is_some() {
            hints.push("ssh -C: a quarter of the bytes, on a slow line four times the pictures");
            if multiplexer.is_none() {
                hints.push("tmux on this machine keeps the session when the line drops");
            }
            if color_term.is_empty() && few_colors {
                hints.push(
                    "SendEnv COLORTERM in ~/.ssh/config where you sit, AcceptEnv COLORTERM in \
                     /etc/ssh/sshd_config here: the number of colours comes with you",
                );
            }
        }
        if tmux && asked.is_some_and(|terminal| terminal.passthrough.is_none()) {
            hints.push(
                "set -g allow-passthrough on in ~/.tmux.conf: answers come from the terminal",
            );
        }
        if tmux && few_colors {
            hints.push("set -as terminal-features ',*:RGB' in ~/.tmux.conf: 24-bit colour");
        }
        if *multiplexer == Some(Multiplexer::Screen) && few_colors {
            hints.push("truecolor on in ~/.screenrc (GNU Screen 5): 24-bit colour");
        }
        if !self.is_utf8() {
            hints.push("a UTF-8 locale, such as LANG=C.UTF-8: the picture is made of half blocks");
        }
        hints.into_iter().map(String::from).collect()
    }
}

/// `what` in lines of at most `COLUMNS` after `name` and below.
fn indented(name: &str, what: &str) -> String {
    let lines = wrapped(what, (COLUMNS - name.len()) as u16);
    name.to_string() + &lines.join(&format!("\n{:1$}", "", name.len()))
}

fn background(terminal: &Capabilities) -> String {
    match terminal.background {
        None => "unknown".to_string(),
        Some([r, g, b]) => {
            // Rec. 601 luma, enough to tell night from day.
            let luma = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
            let shade = if luma < 128.0 { "dark" } else { "light" };
            format!("#{r:02x}{g:02x}{b:02x}, {shade}")
        }
    }
}

fn size([columns, rows]: [u16; 2], pixels: Option<[u16; 2]>) -> String {
    let pixels = pixels.map_or(String::new(), |[w, h]| format!(", {w} x {h} pixels"));
    format!("{columns} x {rows} cells{pixels}")
}

fn whole_frames(terminal: &Capabilities) -> String {
    let how = match terminal.synchronised {
        true => "shown at once (mode 2026)",
        false => "shown as they come (no mode 2026)",
    };
    how.to_string()
}

fn stills(terminal: &Capabilities) -> String {
    let missing = match Protocol::of(terminal) {
        Protocol::Sixel(colors) => return format!("crisp, by sixel in {colors} colours"),
        Protocol::Blocks if terminal.kitty_graphics => "its kitty's protocol has no placeholders",
        Protocol::Blocks if terminal.sixel => "sixel needs the size of a cell in pixels",
        Protocol::Blocks => "neither kitty's protocol nor sixel",
        protocol => return format!("crisp, by {}", protocol.name()),
    };
    format!("in half blocks: {missing}")
}

fn arrival(mode: PacingMode) -> String {
    let how = match mode {
        PacingMode::Unlimited => "being written: whoever reads is here",
        PacingMode::AckClocked(None) => "answers of the terminal",
        PacingMode::AckClocked(Some(_)) => "answers of the terminal, through what is between",
        PacingMode::SendQueue => "what the kernel has not sent yet (/proc/net/tcp)",
        PacingMode::FixedRate => "nothing: a fixed rate is sent; --bandwidth sets it",
    };
    how.to_string()
}

fn round_trip(terminal: &Capabilities) -> String {
    let ms = |time: Duration| format!("{:.1} ms", 1e3 * time.as_secs_f64());
    match (terminal.round_trip, terminal.passthrough) {
        (None, _) => "nobody answers".to_string(),
        (Some(near), Some(far)) => format!("{}; to what is between {}", ms(far), ms(near)),
        (Some(near), None) => ms(near),
    }
}

fn shown(path: &Path) -> String {
    sanitized(&path.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(variables: &[(&str, &str)], asked: bool) -> DoctorReport {
        let surroundings = Environment::of(|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| value.to_string())
        });
        let terminal = Capabilities::from_environment(surroundings.clone());
        let examined = TerminalReport {
            terminal,
            mode: PacingMode::Unlimited,
            cells: [120, 36],
            pixels: None,
            rate: None,
        };
        DoctorReport {
            surroundings,
            examined: if asked { Ok(examined) } else { Err("stdin or stdout is no terminal") },
            asked_for_rate: false,
            locale: Some(("LANG", "en_US.UTF-8".into())),
            state: Some("/home/ada/.local/state/zerkalo".into()),
            kept: Vec::new(),
        }
    }

    fn examined(found: &mut DoctorReport) -> &mut TerminalReport {
        found.examined.as_mut().unwrap_or_else(|why| panic!("{why}"))
    }

    fn check(found: &DoctorReport, present: &[&str], absent: &[&str]) {
        let report = found.report();
        for part in present {
            assert!(report.contains(part), "no {part:?} in\n{report}");
        }
        for part in absent {
            assert!(!report.contains(part), "{part:?} in\n{report}");
        }
    }

    #[test]
    fn a_terminal_here_that_has_everything_needs_no_hints() {
        let mut found = found(&[("TERM", "xterm-kitty"), ("COLORTERM", "truecolor")], true);
        let examined = examined(&mut found);
        examined.pixels = Some([960, 720]);
        examined.rate = Some(2.5e6);
        let terminal = &mut examined.terminal;
        terminal.version = Some("kitty(0.40.1)".into());
        terminal.kitty_graphics = true;
        terminal.synchronised = true;
        terminal.background = Some([0x1e, 0x1e, 0x2e]);
        terminal.round_trip = Some(Duration::from_micros(1234));
        let present = [
            "kitty(0.40.1) (TERM=xterm-kitty)",
            "120 x 36 cells, 960 x 720 pixels",
            "24-bit colour: COLORTERM=truecolor",
            "#1e1e2e, dark",
            "shown at once",
            "crisp, by kitty's protocol\n",
            "UTF-8: LANG=",
            "1.2 ms",
            "2500 KB/s, measured",
            "/home/ada/.local/state/zerkalo",
        ];
        check(&found, &present, &["hints", "ssh -C", "unknown"]);
    }

    #[test]
    fn a_far_terminal_in_tmux_gets_advice() {
        let variables = [
            ("TERM", "screen-256color"),
            ("TMUX", "/tmp/tmux,1,0"),
            ("SSH_CONNECTION", "192.0.2.7 5000 192.0.2.1 22"),
        ];
        let mut found = found(&variables, true);
        found.locale = Some(("LC_ALL", "C".into()));
        let examined = examined(&mut found);
        examined.mode = PacingMode::FixedRate;
        examined.terminal.round_trip = Some(Duration::from_micros(900));
        let present = [
            "SSH from 192.0.2.7",
            "tmux, which lets no questions through",
            "30 KB/s, fixed",
            "ssh -C",
            "SendEnv COLORTERM",
            "AcceptEnv COLORTERM",
            "allow-passthrough on",
            "terminal-features",
            "not UTF-8: LC_ALL=C",
        ];
        check(&found, &present, &["keeps the session", "truecolor on"]);
        let examined = self::examined(&mut found);
        examined.terminal.colors = Colors::True;
        examined.terminal.passthrough = Some(Duration::from_millis(110));
        examined.mode = PacingMode::AckClocked(Some(Multiplexer::Tmux));
        let present = ["took a 24-bit colour", "110.0 ms; to what is between 0.9 ms"];
        check(&found, &present, &["allow-passthrough", "terminal-features", "SendEnv"]);
    }

    #[test]
    fn without_a_terminal_the_environment_tells() {
        let found = found(&[("TERM", "linux"), ("NO_COLOR", "1")], false);
        check(&found, &["not asked: stdin", "no colour: NO_COLOR is set"], &["round trip"]);
    }

    #[test]
    fn nothing_in_it_steers_a_terminal() {
        let evil = "x\x1b]52;c;aGk=\x07\u{9b}31m\u{202e}";
        let variables =
            [("TERM", evil), ("COLORTERM", evil), ("SSH_CONNECTION", evil), ("STY", evil)];
        let mut found = found(&variables, true);
        found.locale = Some(("LANG", evil.into()));
        found.state = Some(evil.into());
        found.kept = vec![evil.into()];
        examined(&mut found).terminal.version = Some(evil.into());
        let report = found.report();
        let steers = |line: &str| sanitized(line) != line;
        assert!(!report.lines().any(steers), "{report:?}");
        assert!(report.matches("u{1b}]52").count() >= 5, "{report}");
    }
}
