//! Contexts in which keys are looked up in the command table.

use std::iter::successors;

/// Panel or mode in which a key runs a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum KeyContext {
    /// Any panel or mode that has no command of its own for the key. Overlays do not use this
    /// context.
    Anywhere,
    /// The picture has the focus, in its default mode.
    Picture,
    /// The arrow keys move the selected object or light.
    Moving,
    /// The arrow keys rotate the selected object or light.
    Rotating,
    /// The arrow keys rotate the camera and letter keys fly it.
    Flying,
    /// The arrow keys move the pixel probe.
    Probing,
    Outline,
    Inspector,
    /// An overlay is open, or text is being typed in the inspector.
    Overlay,
}

impl KeyContext {
    /// Returns the context as a phrase, such as `in the outline`; empty for
    /// [`KeyContext::Anywhere`].
    pub fn place(self) -> &'static str {
        match self {
            Self::Anywhere => "",
            Self::Picture => "in the picture",
            Self::Moving => "while moving",
            Self::Rotating => "while rotating",
            Self::Flying => "while flying",
            Self::Probing => "while probing",
            Self::Outline => "in the outline",
            Self::Inspector => "in the inspector",
            Self::Overlay => "in lists, forms and fields",
        }
    }

    /// Returns this context and the contexts in which a key is looked up next. The first one with a
    /// command for the key determines the command.
    pub fn chain(self) -> impl Iterator<Item = Self> {
        successors(Some(self), |context| match context {
            Self::Anywhere | Self::Overlay => None,
            Self::Picture | Self::Outline | Self::Inspector => Some(Self::Anywhere),
            Self::Moving | Self::Rotating | Self::Flying | Self::Probing => Some(Self::Picture),
        })
    }
}
