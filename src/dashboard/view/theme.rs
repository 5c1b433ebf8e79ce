//! Colours and text attributes at each colour depth.
//!
//! The tones are readable on both dark and light backgrounds. The most important text has the
//! terminal's default colour.

use ratatui::style::{Color, Modifier, Style};
use ratatui::widgets::BorderType;
use zerkalo_terminal::cells::{Colors, nearest_xterm};

/// Styles for a set of terminal colours.
#[derive(Clone, Copy, Debug)]
pub struct Theme {
    pub colors: Colors,
    pub on_light: bool,
    pub tones: Tones,
}

/// Colour at three depths: 24 bits, index of xterm's 256 colours, one of 16 colours.
pub type Tone = ([u8; 3], u8, Color);
/// Colours in the order of [`SHIPPED_TONES`].
pub type Tones = [Tone; TONES];

const TONES: usize = 9;

/// Names of the tones in configuration files, and the tones as shipped. The constants are their indices.
pub const SHIPPED_TONES: [(&str, Tone); TONES] = [
    ("accent", ([98, 160, 242], 75, Color::Cyan)),
    ("dim", ([125, 130, 142], 245, Color::DarkGray)),
    ("border", ([84, 90, 104], 240, Color::DarkGray)),
    ("good", ([110, 178, 98], 71, Color::Green)),
    ("warn", ([216, 154, 58], 172, Color::Yellow)),
    ("bad", ([232, 98, 98], 167, Color::Red)),
    ("selected-ground", ([40, 62, 98], 24, Color::Reset)),
    ("selected-text", ([242, 245, 250], 255, Color::Reset)),
    ("badge-ground", ([24, 24, 28], 234, Color::Black)),
];

const ACCENT: usize = 0;
const DIM: usize = 1;
const BORDER: usize = 2;
const GOOD: usize = 3;
const WARN: usize = 4;
const BAD: usize = 5;
const SELECTED_GROUND: usize = 6;
const SELECTED_TEXT: usize = 7;
const BADGE_GROUND: usize = 8;

impl Theme {
    fn color(&self, (rgb, indexed, ansi): Tone) -> Option<Color> {
        match self.colors {
            Colors::True => Some(Color::Rgb(rgb[0], rgb[1], rgb[2])),
            Colors::Indexed => Some(Color::Indexed(indexed)),
            Colors::Sixteen => Some(match ansi {
                Color::Cyan if self.on_light => Color::Blue,
                Color::Yellow if self.on_light => Color::Magenta,
                _ => ansi,
            }),
            Colors::Mono => None,
        }
    }

    /// Returns the style with the colour of the tone with this index, or with `plain` on terminals without colours.
    fn toned(&self, tone: usize, plain: Modifier) -> Style {
        match self.color(self.tones[tone]) {
            Some(color) => Style::new().fg(color),
            None => Style::new().add_modifier(plain).remove_modifier(Modifier::DIM - plain),
        }
    }

    pub fn text(&self) -> Style {
        Style::new().fg(Color::Reset).remove_modifier(Modifier::DIM)
    }

    /// Returns the style of labels, units and default values.
    pub fn dim(&self) -> Style {
        self.toned(DIM, Modifier::DIM)
    }

    pub fn heading(&self) -> Style {
        self.dim().remove_modifier(Modifier::DIM).add_modifier(Modifier::BOLD)
    }

    /// Returns the style of active elements and of keys.
    pub fn accent(&self) -> Style {
        self.toned(ACCENT, Modifier::BOLD)
    }

    pub fn good(&self) -> Style {
        self.toned(GOOD, Modifier::BOLD)
    }

    pub fn warn(&self) -> Style {
        self.toned(WARN, Modifier::BOLD)
    }

    pub fn bad(&self) -> Style {
        self.toned(BAD, Modifier::BOLD)
    }

    /// Returns the style of the row under the cursor. `active` is `true` if its list has the focus.
    pub fn selected(&self, active: bool) -> Style {
        match (active, self.colors) {
            (false, _) => self.accent().add_modifier(Modifier::BOLD),
            (true, Colors::True | Colors::Indexed) => {
                let ground = self.color(self.tones[SELECTED_GROUND]).unwrap_or_default();
                self.toned(SELECTED_TEXT, Modifier::empty()).bg(ground)
            }
            (true, _) => Style::new().add_modifier(Modifier::REVERSED),
        }
    }

    pub fn border(&self, focused: bool) -> Style {
        if focused { self.accent() } else { self.toned(BORDER, Modifier::DIM) }
    }

    /// Returns the ground of marks on the picture.
    pub fn badge(&self) -> Style {
        self.color(self.tones[BADGE_GROUND]).map_or(Style::new(), |ground| Style::new().bg(ground))
    }

    /// Returns the border type. With few or no colours, a thick border marks the focus.
    pub fn border_type(&self, focused: bool) -> BorderType {
        match (focused, self.colors) {
            (true, Colors::Sixteen | Colors::Mono) => BorderType::Thick,
            _ => BorderType::Rounded,
        }
    }

    /// Returns the style of a colour sample; `None` if the terminal cannot show it.
    pub fn swatch(&self, rgb: [u8; 3]) -> Option<Style> {
        let shows = matches!(self.colors, Colors::True | Colors::Indexed);
        let color = shows.then(|| self.color((rgb, nearest_xterm(rgb), Color::Reset)))?;
        color.map(|color| Style::new().fg(color))
    }
}
