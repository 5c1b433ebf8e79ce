//! Protocol that shows the picture in its panel.

use zerkalo_terminal::Capabilities;
use zerkalo_terminal::cells::{Blocks, Colors};
use zerkalo_terminal::image::{GraphicsMode, Protocol};

#[derive(Clone, Debug)]
pub struct Graphics {
    pub mode: GraphicsMode,
    pub terminal: Capabilities,
    pub protocol: Protocol,
    /// Reason for the protocol.
    pub reason: &'static str,
}

impl Default for Graphics {
    fn default() -> Self {
        Self::new(Capabilities::default(), GraphicsMode::Cells(Blocks::Halves))
    }
}

impl Graphics {
    pub fn new(terminal: Capabilities, mode: GraphicsMode) -> Self {
        let (protocol, reason) = Protocol::of_panel(&terminal, mode);
        Self { mode, terminal, protocol, reason }
    }

    /// Returns width and height of a cell in pixels; `None` if the picture is shown in cells.
    pub fn cell_px(&self) -> Option<[usize; 2]> {
        let cell = self.terminal.cell_px.filter(|_| self.protocol != Protocol::Blocks)?;
        Some(cell.map(usize::from))
    }

    /// Returns the block characters that show the picture in cells with `colors`.
    pub fn blocks(&self, colors: Colors) -> Blocks {
        match self.mode {
            GraphicsMode::Cells(blocks) if colors == Colors::True => blocks,
            _ => Blocks::Halves,
        }
    }

    /// Describes protocol and reason, such as `cells, as the terminal reports no image protocol`.
    pub fn description(&self) -> String {
        match self.protocol {
            Protocol::Blocks if self.blocks(self.terminal.colors) != Blocks::Halves => {
                format!("{}, {}", self.blocks(self.terminal.colors).name(), self.reason)
            }
            Protocol::Blocks => format!("cells, {}", self.reason),
            protocol => format!("{}, {}", protocol.name(), self.reason),
        }
    }
}
