//! Capabilities of the terminal, and of a multiplexer if the program runs inside one. They are
//! derived from the environment and from the terminal's replies.

use crate::terminal::cells::Colors;
use std::time::Duration;

/// Terminal multiplexer: a program between the dashboard and the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplexer {
    /// tmux.
    Tmux,
    /// GNU Screen.
    Screen,
}

/// Environment variables that describe the terminal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// `TERM`.
    pub term: String,
    /// `COLORTERM`.
    pub color_term: String,
    /// `true` if `NO_COLOR` is set and not empty.
    pub no_color: bool,
    /// `SSH_CONNECTION`: address and port of the client, then of the server. `None` without SSH.
    pub ssh: Option<String>,
    /// Multiplexer, recognised by `TMUX`, `STY` or `TERM`.
    pub multiplexer: Option<Multiplexer>,
}

/// Capabilities of the terminal. A field is `None` if the terminal has not replied to its request.
#[derive(Clone, Debug, PartialEq)]
pub struct Capabilities {
    /// Environment variables.
    pub environment: Environment,
    /// Number of colours, derived from environment and replies.
    pub colors: Colors,
    /// `true` if the terminal supports synchronised updates (mode 2026).
    pub synchronised: bool,
    /// Name and version (XTVERSION).
    pub version: Option<String>,
    /// Background colour, 8-bit sRGB (OSC 11).
    pub background: Option<[u8; 3]>,
    /// `true` if the terminal supports kitty's graphics protocol.
    pub kitty_graphics: bool,
    /// `true` if kitty's images can be placed by Unicode placeholders, as tmux requires.
    pub placeholders: bool,
    /// `true` if the terminal supports sixel.
    pub sixel: bool,
    /// Largest number of colours of a sixel image.
    pub sixel_colors: Option<u16>,
    /// Largest width and height of a sixel image in pixels.
    pub sixel_px: Option<[u16; 2]>,
    /// Width and height of a cell in pixels.
    pub cell_px: Option<[u16; 2]>,
    /// Time from the first request to its reply. Inside a multiplexer, the multiplexer replies.
    pub round_trip: Option<Duration>,
    /// Round trip of a request that the multiplexer passes through to the terminal outside it.
    /// `None` if it was not measured or the multiplexer passes no requests through.
    pub passthrough: Option<Duration>,
}

impl Environment {
    /// Reads the environment. `variable` returns the value of the variable with a given name.
    pub fn of(variable: impl Fn(&str) -> Option<String>) -> Self {
        let variable = |name: &str| variable(name).filter(|value| !value.is_empty());
        let term = variable("TERM").unwrap_or_default();
        let multiplexer = if variable("TMUX").is_some() || term.starts_with("tmux") {
            Some(Multiplexer::Tmux)
        } else if variable("STY").is_some() || term.starts_with("screen") {
            Some(Multiplexer::Screen)
        } else {
            None
        };
        Self {
            term,
            color_term: variable("COLORTERM").unwrap_or_default(),
            no_color: variable("NO_COLOR").is_some(),
            ssh: variable("SSH_CONNECTION"),
            multiplexer,
        }
    }

    /// Returns the number of colours that the environment alone indicates.
    pub fn colors(&self) -> Colors {
        /// Values of `TERM` with 24-bit colour that do not end in `-direct` or `-truecolor`.
        const TRUE: [&str; 8] = [
            "xterm-kitty",
            "alacritty",
            "foot",
            "wezterm",
            "xterm-ghostty",
            "contour",
            "iterm",
            "iterm2",
        ];
        let term = self.term.as_str();
        if self.no_color || term == "dumb" || term.starts_with("vt") {
            Colors::Mono
        } else if ["truecolor", "24bit"].contains(&self.color_term.as_str())
            || ["-direct", "-truecolor"].iter().any(|end| term.ends_with(end))
            || TRUE.contains(&term)
        {
            Colors::True
        } else if ["linux", "ansi", "xterm-color", "screen", "cygwin"].contains(&term) {
            Colors::Sixteen
        } else {
            Colors::Indexed
        }
    }
}

impl Capabilities {
    /// Creates the capabilities of a terminal that has not replied yet.
    pub fn from_environment(environment: Environment) -> Self {
        Self {
            colors: environment.colors(),
            environment,
            synchronised: false,
            version: None,
            background: None,
            kitty_graphics: false,
            placeholders: false,
            sixel: false,
            sixel_colors: None,
            sixel_px: None,
            cell_px: None,
            round_trip: None,
            passthrough: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(variables: &[(&str, &str)]) -> Environment {
        Environment::of(|name| {
            let variable = variables.iter().find(|(known, _)| *known == name);
            variable.map(|(_, value)| value.to_string())
        })
    }

    #[test]
    fn colors_follow_the_environment() {
        for (term, color_term, no_color, expected) in [
            ("xterm-256color", "truecolor", "", Colors::True),
            ("xterm-256color", "24bit", "", Colors::True),
            ("xterm-256color", "", "", Colors::Indexed),
            ("tmux-direct", "", "", Colors::True),
            ("xterm-kitty", "", "", Colors::True),
            ("linux", "", "", Colors::Sixteen),
            ("vt100", "", "", Colors::Mono),
            ("xterm-256color", "truecolor", "1", Colors::Mono),
            ("", "", "", Colors::Indexed),
        ] {
            let actual =
                environment(&[("TERM", term), ("COLORTERM", color_term), ("NO_COLOR", no_color)]);
            assert_eq!(actual.colors(), expected, "{term} {color_term} {no_color}");
        }
    }

    #[test]
    fn multiplexer_is_detected_by_any_variable() {
        for (variables, expected) in [
            (&[("TERM", "tmux-256color")][..], Some(Multiplexer::Tmux)),
            (&[("TERM", "screen-256color"), ("TMUX", "/x,1,0")], Some(Multiplexer::Tmux)),
            (&[("TERM", "screen")], Some(Multiplexer::Screen)),
            (&[("TERM", "xterm"), ("STY", "1.pts-0")], Some(Multiplexer::Screen)),
            (&[("TERM", "xterm"), ("TMUX", "")], None),
        ] {
            assert_eq!(environment(variables).multiplexer, expected, "{variables:?}");
        }
        let ssh = environment(&[("SSH_CONNECTION", "10.0.0.1 5000 10.0.0.2 22")]).ssh;
        assert_eq!(ssh.as_deref(), Some("10.0.0.1 5000 10.0.0.2 22"));
    }
}
