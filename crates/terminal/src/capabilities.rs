//! Capabilities of the terminal, derived from the environment and from its replies.

use crate::cells::Colors;
use std::time::Duration;

/// Terminal multiplexer: a program between the application and the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplexer {
    Tmux,
    /// GNU Screen.
    Screen,
}

/// Values of the environment variables that describe the terminal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    pub term: String,
    /// Value of `COLORTERM`, such as `truecolor`.
    pub color_term: String,
    /// `true` if `NO_COLOR` is set and not empty.
    pub no_color: bool,
    /// Value of `SSH_CONNECTION`: address and port of the client, then of the server.
    pub ssh: Option<String>,
    /// Multiplexer around the program, recognised by `TMUX`, `STY` or `TERM`.
    pub multiplexer: Option<Multiplexer>,
}

/// Capabilities of the terminal. A field is `None` if the terminal has not reported its value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Capabilities {
    pub environment: Environment,
    /// Set of colours that the terminal shows.
    pub colors: Colors,
    /// `true` if the terminal supports synchronised updates (mode 2026).
    pub synchronised: bool,
    /// Name and version of the terminal (XTVERSION).
    pub version: Option<String>,
    /// Background colour, 8-bit sRGB (OSC 11).
    pub background: Option<[u8; 3]>,
    /// `true` if the terminal supports kitty's graphics protocol.
    pub kitty_graphics: bool,
    /// `true` if the terminal supports Unicode placeholders, characters whose cells show an image
    /// of kitty's protocol. Inside tmux, images need them.
    pub placeholders: bool,
    /// `true` if the terminal supports sixel images.
    pub sixel: bool,
    /// Largest number of colours of a sixel image.
    pub sixel_colors: Option<u16>,
    /// Largest width and height of a sixel image in pixels.
    pub sixel_px: Option<[u16; 2]>,
    /// Width and height of a cell in pixels.
    pub cell_px: Option<[u16; 2]>,
    /// Time from the first request to the first reply. Inside a multiplexer, the multiplexer
    /// replies.
    pub round_trip: Option<Duration>,
    /// Round-trip time to the terminal outside the multiplexer; `None` if the multiplexer passes no
    /// requests on.
    pub passthrough: Option<Duration>,
}

impl Environment {
    /// Reads the environment through `variable`, which returns the value of a variable.
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

    /// Returns the set of colours that the environment alone suggests.
    pub fn colors(&self) -> Colors {
        /// Values of `TERM` of terminals with 24-bit colour, besides `*-direct` and `*-truecolor`.
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
        Self { colors: environment.colors(), environment, ..Self::default() }
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
