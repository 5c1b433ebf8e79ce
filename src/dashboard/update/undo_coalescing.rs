//! Undo coalescing: the rule that decides which successive edits form one undo step.
//! [`History`](zerkalo_scene::History) merges such edits.

use std::time::Duration;

/// Longest time between two edits with the same label that form one undo step, such as those of a
/// held key. It is longer than the delay after which a held key starts to repeat.
const REPEAT_WINDOW: Duration = Duration::from_millis(700);

/// Rule that decides if an edit forms one undo step with the previous edit.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Coalesce {
    /// Rule: the edit is an undo step of its own.
    Single,
    /// Rule: the edit is merged with the previous edit if both have the same label and the previous
    /// edit is at most 0.7 seconds old.
    Repeat,
    /// Rule: the edit is merged with edits of the same label until the gesture (a drag or mode)
    /// ends.
    Gesture,
}

impl Coalesce {
    /// Returns `true` if an edit may form one undo step with the previous edit. `age` is the time
    /// since the previous edit, or `None` if the rule for that edit was not [`Self::Repeat`].
    pub(super) fn joins(self, age: Option<Duration>) -> bool {
        match self {
            Self::Single => false,
            Self::Repeat => age.is_some_and(|age| age <= REPEAT_WINDOW),
            Self::Gesture => true,
        }
    }
}
