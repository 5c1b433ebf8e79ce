//! The table of keys: one row an action. Help, hints, palette and docs/keys.md are made from it.

use super::action::Action::*;
use super::action::Change::{Down as Less, Up as More};
use super::action::Pace::{Coarse, Fine};
use super::action::Way::{self, Down, In, Left, Out, Right, Up};
use super::action::{Action, Change, Pace};
use super::input::Key;

/// Where a key means something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Context {
    /// In every panel and mode, unless the panel or mode has its own meaning for the key. Not where
    /// text is typed.
    Anywhere,
    /// The picture has the focus.
    Picture,
    /// The selection is being moved.
    Moving,
    /// The selection is being turned.
    Turning,
    /// The camera flies.
    Flying,
    /// The outline has the focus.
    Outline,
    /// The inspector has the focus.
    Inspector,
}

/// Chapters of the help.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Chapter {
    /// Moving the eye.
    Camera,
    /// Lights.
    Light,
    /// The mirror.
    Mirror,
    /// Objects.
    Objects,
    /// Panels, fields and the selection.
    Panels,
    /// Undo, files, the end.
    File,
    /// What is shown and written.
    Picture,
    /// The work.
    Render,
    /// Help.
    Help,
}

/// One action with its keys.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Where in the help.
    pub chapter: Chapter,
    /// What it does.
    pub action: Action,
    /// In which contexts which keys do it. Empty: only the palette.
    pub keys: &'static [(Context, &'static [&'static str])],
    /// What it does, in a few words, for help, hints and palette.
    pub label: &'static str,
}

use Chapter as C;
use Context::*;

const fn row(
    chapter: Chapter,
    action: Action,
    keys: &'static [(Context, &'static [&'static str])],
    label: &'static str,
) -> Row {
    Row { chapter, action, keys, label }
}

/// Every action, in the order of the help.
pub const KEYMAP: &[Row] = &[
    row(C::Camera, Orbit(Left), &[(Picture, &["Left"])], "orbit left"),
    row(C::Camera, Orbit(Right), &[(Picture, &["Right"])], "orbit right"),
    row(C::Camera, Orbit(Up), &[(Picture, &["Up"])], "orbit up"),
    row(C::Camera, Orbit(Down), &[(Picture, &["Down"])], "orbit down"),
    row(C::Camera, Dolly(In, Coarse), &[(Picture, &["PageUp"])], "dolly in"),
    row(C::Camera, Dolly(Out, Coarse), &[(Picture, &["PageDown"])], "dolly out"),
    row(C::Camera, Dolly(In, Fine), &[(Picture, &["Shift-PageUp", "+"])], "dolly in, fine"),
    row(C::Camera, Dolly(Out, Fine), &[(Picture, &["Shift-PageDown", "_"])], "dolly out, fine"),
    row(C::Camera, Pan(Left), &[(Picture, &["Shift-Left"])], "pan left"),
    row(C::Camera, Pan(Right), &[(Picture, &["Shift-Right"])], "pan right"),
    row(C::Camera, Pan(Up), &[(Picture, &["Shift-Up"])], "pan up"),
    row(C::Camera, Pan(Down), &[(Picture, &["Shift-Down"])], "pan down"),
    row(C::Camera, Look(Left), &[(Picture, &["Ctrl-Left"])], "look left"),
    row(C::Camera, Look(Right), &[(Picture, &["Ctrl-Right"])], "look right"),
    row(C::Camera, Look(Up), &[(Picture, &["Ctrl-Up"])], "look up"),
    row(C::Camera, Look(Down), &[(Picture, &["Ctrl-Down"])], "look down"),
    row(C::Camera, Roll(Left), &[(Picture, &["Alt-Left"])], "roll left"),
    row(C::Camera, Roll(Right), &[(Picture, &["Alt-Right"])], "roll right"),
    row(C::Camera, ViewAngle(Less), &[(Picture, &["Alt-Up"])], "narrower view angle"),
    row(C::Camera, ViewAngle(More), &[(Picture, &["Alt-Down"])], "wider view angle"),
    row(C::Camera, FlyMode, &[(Picture, &["w"])], "fly with w a s d r f"),
    row(C::Camera, Frame, &[(Anywhere, &["f"])], "frame the selection"),
    row(C::Camera, ResetCamera, &[(Anywhere, &["Home"])], "camera as in the file"),
    row(C::Camera, StoreView, &[(Anywhere, &["n"])], "store this viewpoint"),
    row(C::Camera, RecallView(1), &[(Anywhere, &["1"])], "viewpoint 1"),
    row(C::Camera, RecallView(2), &[(Anywhere, &["2"])], "viewpoint 2"),
    row(C::Camera, RecallView(3), &[(Anywhere, &["3"])], "viewpoint 3"),
    row(C::Camera, RecallView(4), &[(Anywhere, &["4"])], "viewpoint 4"),
    row(C::Camera, RecallView(5), &[(Anywhere, &["5"])], "viewpoint 5"),
    row(C::Camera, RecallView(6), &[(Anywhere, &["6"])], "viewpoint 6"),
    row(C::Camera, RecallView(7), &[(Anywhere, &["7"])], "viewpoint 7"),
    row(C::Camera, RecallView(8), &[(Anywhere, &["8"])], "viewpoint 8"),
    row(C::Camera, RecallView(9), &[(Anywhere, &["9"])], "viewpoint 9"),
    row(C::Camera, Fly(In), &[(Flying, &["w", "Up"])], "fly forward"),
    row(C::Camera, Fly(Out), &[(Flying, &["s", "Down"])], "fly back"),
    row(C::Camera, Fly(Left), &[(Flying, &["a"])], "fly left"),
    row(C::Camera, Fly(Right), &[(Flying, &["d"])], "fly right"),
    row(C::Camera, Fly(Up), &[(Flying, &["r", "PageUp"])], "fly up"),
    row(C::Camera, Fly(Down), &[(Flying, &["f", "PageDown"])], "fly down"),
    // (the arrows left and right look around while flying: see `Look`)
];

impl Row {
    /// The first key of the row in `context`, for hints.
    pub fn key(&self, context: Context) -> Option<&'static str> {
        self.keys.iter().find(|(c, _)| *c == context).and_then(|(_, keys)| keys.first().copied())
    }
}
