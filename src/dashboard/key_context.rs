//! Contexts in which keys are looked up.

/// Part or mode of the dashboard in which a key has a meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum KeyContext {
    /// Every panel and mode that gives the key no meaning of its own. Text fields, lists, forms and
    /// questions do not fall back to it.
    Anywhere,
    /// The picture has the focus.
    Picture,
    /// The selection is being moved.
    Moving,
    /// The selection is being turned.
    Turning,
    /// The camera flies.
    Flying,
    /// The probe moves over the picture.
    Probing,
    /// The outline has the focus.
    Outline,
    /// The inspector has the focus.
    Inspector,
    /// A list, a form, help or a question covers the panels.
    Overlay,
}

impl KeyContext {
    /// The context as a phrase: `in the outline`. Empty for [`KeyContext::Anywhere`].
    pub fn place(self) -> &'static str {
        match self {
            Self::Anywhere => "",
            Self::Picture => "in the picture",
            Self::Moving => "while moving",
            Self::Turning => "while turning",
            Self::Flying => "while flying",
            Self::Probing => "while probing",
            Self::Outline => "in the outline",
            Self::Inspector => "in the inspector",
            Self::Overlay => "in lists and forms",
        }
    }

    /// Contexts in which a key pressed here is looked up; the first that knows the key wins.
    pub fn chain(self) -> &'static [Self] {
        match self {
            Self::Anywhere => &[Self::Anywhere],
            Self::Picture => &[Self::Picture, Self::Anywhere],
            Self::Moving => &[Self::Moving, Self::Picture, Self::Anywhere],
            Self::Turning => &[Self::Turning, Self::Picture, Self::Anywhere],
            Self::Flying => &[Self::Flying, Self::Picture, Self::Anywhere],
            Self::Probing => &[Self::Probing, Self::Picture, Self::Anywhere],
            Self::Outline => &[Self::Outline, Self::Anywhere],
            Self::Inspector => &[Self::Inspector, Self::Anywhere],
            Self::Overlay => &[Self::Overlay],
        }
    }
}
