//! Capabilities of the terminal, and of a multiplexer if the program runs inside one. They are
//! derived from the environment and from the terminal's replies.

use crate::cells::Colors;
use std::time::Duration;

/// Terminal multiplexer: a program between the dashboard and the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplexer {
    /// The multiplexer tmux.
    Tmux,
    /// The multiplexer GNU Screen.
    Screen,
}

/// Values of the environment variables that describe the terminal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// Value of `TERM`, the name of the terminal's type.
    pub term: String,
    /// Value of the environment variable `COLORTERM`, such as `truecolor`.
    pub color_term: String,
    /// `true` if `NO_COLOR` is set and not empty.
    pub no_color: bool,
    /// Value of `SSH_CONNECTION`: address and port of the client, then of the server. `None`
    /// without SSH.
    pub ssh: Option<String>,
    /// Multiplexer around the program, recognised by `TMUX`, `STY` or `TERM`; `None` if there is
    /// none.
    pub multiplexer: Option<Multiplexer>,
}

/// Capabilities of the terminal. A field is `None` if the terminal has not replied to the request
/// for it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Capabilities {
    /// Environment variables that describe the terminal.
    pub environment: Environment,
    /// Set of colours that the terminal shows. It is derived from the environment variables and the
    /// terminal's replies.
    pub colors: Colors,
    /// `true` if the terminal supports synchronised updates (mode 2026).
    pub synchronised: bool,
    /// Name and version of the terminal, as its reply to XTVERSION states them. `None` without a
    /// reply.
    pub version: Option<String>,
    /// Background colour of the terminal, 8-bit sRGB, as its reply to OSC 11 states it. `None`
    /// without a reply.
    pub background: Option<[u8; 3]>,
    /// `true` if the terminal supports kitty's graphics protocol.
    pub kitty_graphics: bool,
    /// `true` if the terminal supports Unicode placeholders: characters whose cells show an image
    /// of kitty's protocol. Inside of tmux, images need placeholders.
    pub placeholders: bool,
    /// `true` if the terminal supports sixel images.
    pub sixel: bool,
    /// Largest number of colours of a sixel image. `None` if the terminal has not replied.
    pub sixel_colors: Option<u16>,
    /// Largest width and height of a sixel image in pixels. `None` if the terminal has not replied.
    pub sixel_px: Option<[u16; 2]>,
    /// Width and height of a terminal cell in pixels. `None` if the terminal has not replied.
    pub cell_px: Option<[u16; 2]>,
    /// Time from the first request to the first reply. Inside of a multiplexer, the multiplexer
    /// itself replies and not the terminal. `None` if no reply has arrived.
    pub round_trip: Option<Duration>,
    /// Round-trip time to the terminal outside of the multiplexer, measured by a request that the
    /// multiplexer passes on. `None` if the time was not measured or the multiplexer passes no
    /// requests on.
    pub passthrough: Option<Duration>,
}

impl Environment {
    /// Reads the environment variables that describe the terminal. `variable` returns the value of
    /// the variable with a given name.
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

    /// Returns the set of colours that the terminal is expected to show, according to the
    /// environment variables alone.
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
