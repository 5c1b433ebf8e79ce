//! Undo coalescing: which successive edits form one undo step of
//! [`History`](zerkalo_scene::History).

use std::time::Duration;

/// Longest time between edits that form one undo step, longer than the delay after which a held key
/// repeats.
const REPEAT_WINDOW: Duration = Duration::from_millis(700);

/// Rule that decides if an edit with the same label joins the previous undo step.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Coalesce {
    /// The edit is an undo step of its own.
    Single,
    /// The edit joins the previous step if it comes soon enough.
    Repeat,
    /// The edits of a gesture (a drag or mode) are one undo step.
    Gesture,
}

impl Coalesce {
    /// Returns `true` if the edit joins. `age` is the time since the previous edit; `None` unless
    /// its rule was [`Self::Repeat`].
    pub(super) fn joins(self, age: Option<Duration>) -> bool {
        match self {
            Self::Single => false,
            Self::Repeat => age.is_some_and(|age| age <= REPEAT_WINDOW),
            Self::Gesture => true,
        }
    }
}
