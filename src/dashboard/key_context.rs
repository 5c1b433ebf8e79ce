//! Contexts (panels and modes) in which keys are looked up in the command table.

use std::iter::successors;

/// Panel or mode of the dashboard in which a key runs a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum KeyContext {
    /// Any panel or mode. A key is looked up here if the present panel or mode has no command for
    /// it. Overlays and text editors do not use this context.
    Anywhere,
    /// The picture's panel has the focus, in its default mode.
    Picture,
    /// The arrow keys move the selected object or light.
    Moving,
    /// The arrow keys rotate the selected object or light.
    Rotating,
    /// The arrow keys turn the camera and letter keys fly it.
    Flying,
    /// The arrow keys move the pixel probe, which shows the samples, radiance and error of one
    /// pixel.
    Probing,
    /// The outline, the list of all parts of the scene, has the focus.
    Outline,
    /// The inspector, the list of the selection's properties, has the focus.
    Inspector,
    /// An overlay is open, such as a list, a form, the help or a question.
    Overlay,
}

impl KeyContext {
    /// Returns the key context as a phrase, such as `in the outline`. The phrase is empty for
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
            Self::Overlay => "in lists and forms",
        }
    }

    /// Returns the contexts in which a key is looked up while this one is active. The first context
    /// with a command for the key determines the command.
    pub fn chain(self) -> impl Iterator<Item = Self> {
        successors(Some(self), |context| match context {
            Self::Anywhere | Self::Overlay => None,
            Self::Picture | Self::Outline | Self::Inspector => Some(Self::Anywhere),
            Self::Moving | Self::Rotating | Self::Flying | Self::Probing => Some(Self::Picture),
        })
    }
}
