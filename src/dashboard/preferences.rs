//! Keys and colours in force.

use crate::dashboard::update::commands::{COMMANDS, Command};
use crate::dashboard::view::theme::{SHIPPED_TONES, Tones};

/// Keys and colours by the user's configuration. The default are those as shipped.
#[derive(Clone, Copy, Debug)]
pub struct Preferences {
    pub commands: &'static [Command],
    pub tones: Tones,
}

impl Default for Preferences {
    fn default() -> Self {
        Self { commands: COMMANDS, tones: SHIPPED_TONES.map(|(_, tone)| tone) }
    }
}
