//! Choice of the protocol that shows a picture in a panel while it changes.

use super::Protocol;
use crate::cells::{Blocks, Colors};
use crate::{Capabilities, Multiplexer};

/// Choice of the user.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum GraphicsMode {
    /// The best protocol that is known to work in the terminal.
    #[default]
    Automatic,
    Kitty,
    Sixel,
    Cells(Blocks),
}

impl GraphicsMode {
    /// All modes with their names, in the order in which a key cycles through them.
    pub const NAMED: [(&'static str, Self); 7] = [
        ("auto", Self::Automatic),
        ("kitty", Self::Kitty),
        ("sixel", Self::Sixel),
        ("cells", Self::Cells(Blocks::Halves)),
        ("quadrants", Self::Cells(Blocks::Quadrants)),
        ("sextants", Self::Cells(Blocks::Sextants)),
        ("octants", Self::Cells(Blocks::Octants)),
    ];
}

/// Terminal that reports a protocol whose images it does not remove, replace or place as a changing
/// picture needs: the beginning of its name, and the reason.
const FLAWED: [(&str, &str); 5] = [
    // github.com/wezterm/wezterm/issues/2422
    ("WezTerm", "as WezTerm leaves images of kitty's protocol behind"),
    // github.com/ratatui/ratatui-image/issues/88
    ("Konsole", "as Konsole keeps images under text"),
    // github.com/xtermjs/xterm.js/pull/6098
    ("xterm.js", "as xterm.js does not replace images of kitty's protocol"),
    // github.com/zellij-org/zellij/issues/3981 and github.com/ratatui/ratatui-image/issues/207
    ("Zellij", "as Zellij leaves remains of images"),
    // github.com/ratatui/ratatui-image/pull/159
    ("iTerm2", "as iTerm2 supports kitty's protocol in part"),
];

impl Protocol {
    /// Returns the protocol for a changing picture, and the reason for it, such as `as chosen`. With
    /// [`Protocol::Blocks`], the picture is shown in cells.
    pub fn of_panel(terminal: &Capabilities, mode: GraphicsMode) -> (Self, &'static str) {
        let version = terminal.version.as_deref().unwrap_or_default();
        let flaw = FLAWED.iter().find(|(name, _)| version.starts_with(name)).map(|(_, why)| *why);
        let is_kitty = terminal.kitty_graphics;
        let best = Self::of(terminal);
        let sixel = Self::of(&Capabilities { kitty_graphics: false, ..terminal.clone() });
        match mode {
            GraphicsMode::Cells(_) => (Self::Blocks, "as chosen"),
            _ if terminal.cell_px.is_none() => {
                (Self::Blocks, "as the terminal does not report the size of its cells")
            }
            GraphicsMode::Sixel if sixel == Self::Blocks => {
                (Self::Blocks, "as the terminal does not report sixel")
            }
            GraphicsMode::Sixel => (sixel, "as chosen"),
            GraphicsMode::Kitty if !matches!(best, Self::Kitty | Self::KittyThroughTmux) => {
                (Self::Blocks, "as the terminal does not report kitty's protocol")
            }
            GraphicsMode::Kitty => (best, "as chosen"),
            GraphicsMode::Automatic if terminal.colors == Colors::Mono => {
                (Self::Blocks, "as no colours are wanted")
            }
            GraphicsMode::Automatic => match (best, flaw) {
                (Self::Blocks, _)
                    if terminal.environment.multiplexer == Some(Multiplexer::Tmux) =>
                {
                    (Self::Blocks, "as no image protocol passes through tmux")
                }
                (Self::Blocks, _) => (Self::Blocks, "as the terminal reports no image protocol"),
                (_, Some(why)) => (Self::Blocks, why),
                (protocol, None) if is_kitty => {
                    (protocol, "as the terminal reports kitty's protocol")
                }
                (protocol, None) => (protocol, "as the terminal reports sixel"),
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flawed_terminals_get_cells_unless_asked() {
        let terminal = |version: &str, kitty_graphics, sixel| Capabilities {
            version: Some(version.to_string()),
            kitty_graphics,
            sixel,
            cell_px: Some([10, 20]),
            ..Capabilities::default()
        };
        let of = |terminal: &Capabilities, mode| Protocol::of_panel(terminal, mode).0;
        let [kitty, xterm] =
            [terminal("kitty(0.26.5)", true, false), terminal("XTerm(379)", false, true)];
        assert_eq!(of(&kitty, GraphicsMode::Automatic), Protocol::Kitty);
        assert_eq!(of(&kitty, GraphicsMode::Sixel), Protocol::Blocks);
        assert_eq!(of(&xterm, GraphicsMode::Automatic), Protocol::Sixel(256));
        assert_eq!(of(&xterm, GraphicsMode::Cells(Blocks::Octants)), Protocol::Blocks);
        let flawed = terminal("WezTerm 20240203", true, true);
        assert_eq!(of(&flawed, GraphicsMode::Automatic), Protocol::Blocks);
        assert_eq!(of(&flawed, GraphicsMode::Kitty), Protocol::Kitty);
        assert_eq!(of(&flawed, GraphicsMode::Sixel), Protocol::Sixel(256));
        let unknown = Capabilities { cell_px: None, ..kitty };
        assert_eq!(of(&unknown, GraphicsMode::Automatic), Protocol::Blocks);
    }
}
