//! What the terminal can do, and what lies between it and the program.

use crate::terminal::cells::Colors;
use std::time::Duration;

/// A program between the dashboard and the terminal that keeps a screen of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplexer {
    /// tmux.
    Tmux,
    /// GNU Screen.
    Screen,
}

/// What the environment tells about the terminal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Environment {
    /// `TERM`.
    pub term: String,
    /// `COLORTERM`.
    pub color_term: String,
    /// `NO_COLOR` is set and not empty.
    pub no_color: bool,
    /// `SSH_CONNECTION`: address and port of the client, then of the server; `None`: not over SSH.
    pub ssh: Option<String>,
    /// By `TMUX`, `STY` or `TERM`.
    pub multiplexer: Option<Multiplexer>,
}

/// What is known about the terminal. A `None` means that it did not say.
#[derive(Clone, Debug, PartialEq)]
pub struct Capabilities {
    /// What the environment tells.
    pub surroundings: Environment,
    /// How many colours it has, by environment and answers.
    pub colors: Colors,
    /// A frame can be shown at once (mode 2026).
    pub synchronised: bool,
    /// Name and version.
    pub version: Option<String>,
    /// The background, sRGB.
    pub background: Option<[u8; 3]>,
    /// Pictures by kitty's protocol.
    pub kitty_graphics: bool,
    /// Pictures by kitty's protocol can stand among text, as they must inside tmux.
    pub placeholders: bool,
    /// Pictures by sixel.
    pub sixel: bool,
    /// How many colours those have.
    pub sixel_colors: Option<u16>,
    /// How many pixels, in a row and in a column.
    pub sixel_px: Option<[u16; 2]>,
    /// Width and height of a cell in pixels.
    pub cell_px: Option<[u16; 2]>,
    /// How long the answer to the first question took.
    pub round_trip: Option<Duration>,
    /// How long a question that only the outermost terminal can answer took, inside a multiplexer.
    pub passthrough: Option<Duration>,
}

impl Environment {
    /// As the `variable`s of the environment have it.
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

    /// How many colours the environment promises.
    pub fn colors(&self) -> Colors {
        /// Terminals that have 24-bit colour and do not say so by their name's ending.
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
    /// Of a terminal that has not been asked.
    pub fn from_environment(surroundings: Environment) -> Self {
        Self {
            colors: surroundings.colors(),
            surroundings,
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

    fn surroundings(variables: &[(&str, &str)]) -> Environment {
        Environment::of(|name| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| value.to_string())
        })
    }

    #[test]
    fn colours_follow_the_environment() {
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
            let found =
                surroundings(&[("TERM", term), ("COLORTERM", color_term), ("NO_COLOR", no_color)]);
            assert_eq!(found.colors(), expected, "{term} {color_term} {no_color}");
        }
    }

    #[test]
    fn multiplexers_tell_themselves_by_several_signs() {
        for (variables, expected) in [
            (&[("TERM", "tmux-256color")][..], Some(Multiplexer::Tmux)),
            (&[("TERM", "screen-256color"), ("TMUX", "/x,1,0")], Some(Multiplexer::Tmux)),
            (&[("TERM", "screen")], Some(Multiplexer::Screen)),
            (&[("TERM", "xterm"), ("STY", "1.pts-0")], Some(Multiplexer::Screen)),
            (&[("TERM", "xterm"), ("TMUX", "")], None),
        ] {
            assert_eq!(surroundings(variables).multiplexer, expected, "{variables:?}");
        }
        let ssh = surroundings(&[("SSH_CONNECTION", "10.0.0.1 5000 10.0.0.2 22")]).ssh;
        assert_eq!(ssh.as_deref(), Some("10.0.0.1 5000 10.0.0.2 22"));
    }
}
