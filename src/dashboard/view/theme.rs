//! Colours and marks of everything but the picture, at each level of colours.
//!
//! Whether the terminal is dark or light is not known: the tones are readable on both, and text that
//! matters most has the terminal's own colour.

use crate::terminal::cells::{Colors, nearest_indexed};
use ratatui::style::{Color, Modifier, Style};
use ratatui::widgets::BorderType;

/// Styles by meaning.
#[derive(Clone, Copy, Debug)]
pub struct Theme {
    colors: Colors,
}

/// A tone at 24 bits, of 256, of 16.
type Tone = ([u8; 3], u8, Color);

const ACCENT: Tone = ([98, 160, 242], 75, Color::Cyan);
const DIM: Tone = ([125, 130, 142], 245, Color::DarkGray);
const BORDER: Tone = ([84, 90, 104], 240, Color::DarkGray);
const GOOD: Tone = ([110, 178, 98], 71, Color::Green);
const WARN: Tone = ([216, 154, 58], 172, Color::Yellow);
const BAD: Tone = ([232, 98, 98], 167, Color::Red);
const SELECTED_GROUND: Tone = ([40, 62, 98], 24, Color::Reset);
const SELECTED_TEXT: Tone = ([242, 245, 250], 255, Color::Reset);

impl Theme {
    /// For a terminal of `colors`.
    pub fn new(colors: Colors) -> Self {
        Self { colors }
    }

    fn color(&self, (rgb, indexed, ansi): Tone) -> Option<Color> {
        match self.colors {
            Colors::True => Some(Color::Rgb(rgb[0], rgb[1], rgb[2])),
            Colors::Indexed => Some(Color::Indexed(indexed)),
            Colors::Sixteen => Some(ansi),
            Colors::Mono => None,
        }
    }

    /// In a tone; `plain` where there are no colours.
    fn toned(&self, tone: Tone, plain: Modifier) -> Style {
        match self.color(tone) {
            Some(color) => Style::new().fg(color),
            None => Style::new().add_modifier(plain).remove_modifier(Modifier::DIM - plain),
        }
    }

    /// Values and names, also over a border.
    pub fn text(&self) -> Style {
        Style::new().fg(Color::Reset).remove_modifier(Modifier::DIM)
    }

    /// What may be overlooked: labels, units, defaults.
    pub fn dim(&self) -> Style {
        self.toned(DIM, Modifier::DIM)
    }

    /// Headings.
    pub fn heading(&self) -> Style {
        self.dim().remove_modifier(Modifier::DIM).add_modifier(Modifier::BOLD)
    }

    /// What is active, and keys.
    pub fn accent(&self) -> Style {
        self.toned(ACCENT, Modifier::BOLD)
    }

    /// Reached, done.
    pub fn good(&self) -> Style {
        self.toned(GOOD, Modifier::BOLD)
    }

    /// To be noticed.
    pub fn warn(&self) -> Style {
        self.toned(WARN, Modifier::BOLD)
    }

    /// Refused, failed.
    pub fn bad(&self) -> Style {
        self.toned(BAD, Modifier::BOLD)
    }

    /// A whole row under the cursor. `active`: keys go there.
    pub fn selected(&self, active: bool) -> Style {
        match (active, self.colors) {
            (false, _) => self.accent().add_modifier(Modifier::BOLD),
            (true, Colors::True | Colors::Indexed) => {
                let ground = self.color(SELECTED_GROUND).unwrap_or_default();
                self.toned(SELECTED_TEXT, Modifier::empty()).bg(ground)
            }
            (true, _) => Style::new().add_modifier(Modifier::REVERSED),
        }
    }

    /// Lines around panels.
    pub fn border(&self, focused: bool) -> Style {
        if focused { self.accent() } else { self.toned(BORDER, Modifier::DIM) }
    }

    /// How they are drawn: where colours cannot be trusted the lines tell which panel has the focus.
    pub fn border_type(&self, focused: bool) -> BorderType {
        match (focused, self.colors) {
            (true, Colors::Sixteen | Colors::Mono) => BorderType::Thick,
            _ => BorderType::Rounded,
        }
    }

    /// The level of colours.
    pub fn colors(&self) -> Colors {
        self.colors
    }

    /// A patch of a colour, if the terminal can show it.
    pub fn swatch(&self, [r, g, b]: [u8; 3]) -> Option<Style> {
        match self.colors {
            Colors::True => Some(Style::new().fg(Color::Rgb(r, g, b))),
            Colors::Indexed => {
                let index = nearest_indexed([r, g, b]);
                Some(Style::new().fg(Color::Indexed(index)))
            }
            Colors::Sixteen | Colors::Mono => None,
        }
    }
}
