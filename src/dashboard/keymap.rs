//! The table of keys: one row an action. Help, hints, palette and docs/keys.md are made from it.

use crate::dashboard::action::Action;
use crate::dashboard::action::Action::*;
use crate::dashboard::action::Delta::{Down as Less, Up as More};
use crate::dashboard::action::Direction::{Down, In, Left, Out, Right, Up};
use crate::dashboard::action::StepSize::{Coarse, Fine};
use crate::terminal::event::Key;
use std::collections::HashMap;
use std::sync::OnceLock;

/// Where a key means something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Context {
    /// In every panel and mode, unless the panel or mode has its own meaning for the key. Not where
    /// text is typed, nor in a list, form or question.
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
    /// A list, a form, help or a question lies over the panels.
    Overlay,
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
#[rustfmt::skip] // A table reads best with one row a line.
pub const KEYMAP: &[Row] = &[
    row(C::Camera, Orbit(Left), &[(Picture, &["Left"])], "orbit left"),
    row(C::Camera, Orbit(Right), &[(Picture, &["Right"])], "orbit right"),
    row(C::Camera, Orbit(Up), &[(Picture, &["Up"])], "orbit up"),
    row(C::Camera, Orbit(Down), &[(Picture, &["Down"])], "orbit down"),
    row(C::Camera, Dolly(In, Coarse), &[(Picture, &["PageUp"])], "dolly in"),
    row(C::Camera, Dolly(Out, Coarse), &[(Picture, &["PageDown"])], "dolly out"),
    row(C::Camera, Dolly(In, Fine), &[(Picture, &["Shift-PageUp"])], "dolly in, fine"),
    row(C::Camera, Dolly(Out, Fine), &[(Picture, &["Shift-PageDown"])], "dolly out, fine"),
    row(C::Camera, Pan(Left), &[(Picture, &["Shift-Left"])], "pan left"),
    row(C::Camera, Pan(Right), &[(Picture, &["Shift-Right"])], "pan right"),
    row(C::Camera, Pan(Up), &[(Picture, &["Shift-Up"])], "pan up"),
    row(C::Camera, Pan(Down), &[(Picture, &["Shift-Down"])], "pan down"),
    row(C::Camera, ViewImage(Left), &[(Picture, &["Ctrl-Left"]), (Flying, &["Left"])], "look left"),
    row(C::Camera, ViewImage(Right), &[(Picture, &["Ctrl-Right"]), (Flying, &["Right"])], "look right"),
    row(C::Camera, ViewImage(Up), &[(Picture, &["Ctrl-Up"]), (Flying, &["Up"])], "look up"),
    row(C::Camera, ViewImage(Down), &[(Picture, &["Ctrl-Down"]), (Flying, &["Down"])], "look down"),
    row(C::Camera, Roll(Left), &[(Picture, &["Alt-Left"])], "roll left"),
    row(C::Camera, Roll(Right), &[(Picture, &["Alt-Right"])], "roll right"),
    row(C::Camera, ViewAngle(Less), &[(Picture, &["Alt-Up"])], "narrower view angle"),
    row(C::Camera, ViewAngle(More), &[(Picture, &["Alt-Down"])], "wider view angle"),
    row(C::Camera, FlyMode, &[(Anywhere, &["w"])], "fly the camera"),
    row(C::Camera, Fly(In), &[(Flying, &["w"])], "fly forward"),
    row(C::Camera, Fly(Out), &[(Flying, &["s"])], "fly back"),
    row(C::Camera, Fly(Left), &[(Flying, &["a"])], "fly left"),
    row(C::Camera, Fly(Right), &[(Flying, &["d"])], "fly right"),
    row(C::Camera, Fly(Up), &[(Flying, &["r", "PageUp"])], "fly up"),
    row(C::Camera, Fly(Down), &[(Flying, &["f", "PageDown"])], "fly down"),
    row(C::Camera, Frame, &[(Anywhere, &["f"])], "frame the selection"),
    row(C::Camera, ResetCamera, &[(Picture, &["Home"])], "camera as in the file"),
    row(C::Camera, StoreView, &[(Anywhere, &["n"])], "store this viewpoint"),
    row(C::Camera, RecallView(1), &[(Anywhere, &["1"])], "go to viewpoint 1"),
    row(C::Camera, RecallView(2), &[(Anywhere, &["2"])], "go to viewpoint 2"),
    row(C::Camera, RecallView(3), &[(Anywhere, &["3"])], "go to viewpoint 3"),
    row(C::Camera, RecallView(4), &[(Anywhere, &["4"])], "go to viewpoint 4"),
    row(C::Camera, RecallView(5), &[(Anywhere, &["5"])], "go to viewpoint 5"),
    row(C::Camera, RecallView(6), &[(Anywhere, &["6"])], "go to viewpoint 6"),
    row(C::Camera, RecallView(7), &[(Anywhere, &["7"])], "go to viewpoint 7"),
    row(C::Camera, RecallView(8), &[(Anywhere, &["8"])], "go to viewpoint 8"),
    row(C::Camera, RecallView(9), &[(Anywhere, &["9"])], "go to viewpoint 9"),

    row(C::Light, NextLight, &[(Anywhere, &["l"])], "select the next light"),
    row(C::Light, Intensity(More, Coarse), &[(Anywhere, &["'"])], "light brighter"),
    row(C::Light, Intensity(Less, Coarse), &[(Anywhere, &[";"])], "light darker"),
    row(C::Light, Intensity(More, Fine), &[(Anywhere, &["Alt-'"])], "light brighter, fine"),
    row(C::Light, Intensity(Less, Fine), &[(Anywhere, &["Alt-;"])], "light darker, fine"),
    row(C::Light, SwitchLight, &[(Anywhere, &["L"])], "light on or off"),
    row(C::Light, AddLight, &[(Anywhere, &["A"])], "add a light"),

    row(C::Mirror, Roughness(More, Coarse), &[(Anywhere, &["]", "."])], "mirror rougher"),
    row(C::Mirror, Roughness(Less, Coarse), &[(Anywhere, &["[", ","])], "mirror smoother"),
    row(C::Mirror, Roughness(More, Fine), &[(Anywhere, &["}", ">"])], "mirror rougher, fine"),
    row(C::Mirror, Roughness(Less, Fine), &[(Anywhere, &["{", "<"])], "mirror smoother, fine"),
    row(C::Mirror, Reflection(More), &[(Anywhere, &[")"])], "mirror reflects more"),
    row(C::Mirror, Reflection(Less), &[(Anywhere, &["("])], "mirror reflects less"),
    row(C::Mirror, NextLobe, &[(Anywhere, &["b", "\\"])], "next lobe of the mirror"),

    row(C::Objects, AddObject, &[(Anywhere, &["a"])], "add an object"),
    row(C::Objects, Duplicate, &[(Anywhere, &["D"])], "duplicate the selection"),
    row(C::Objects, Delete, &[(Anywhere, &["x", "Delete"])], "delete the selection"),
    row(C::Objects, Rename, &[(Anywhere, &["e", "F2"])], "rename the selection"),
    row(C::Objects, MoveMode, &[(Anywhere, &["m"])], "move the selection"),
    row(C::Objects, Move(Left, Coarse), &[(Moving, &["Left"])], "move left"),
    row(C::Objects, Move(Right, Coarse), &[(Moving, &["Right"])], "move right"),
    row(C::Objects, Move(In, Coarse), &[(Moving, &["Up"])], "move away"),
    row(C::Objects, Move(Out, Coarse), &[(Moving, &["Down"])], "move nearer"),
    row(C::Objects, Move(Up, Coarse), &[(Moving, &["PageUp"])], "raise"),
    row(C::Objects, Move(Down, Coarse), &[(Moving, &["PageDown"])], "lower"),
    row(C::Objects, Move(Left, Fine), &[(Moving, &["Shift-Left"])], "move left, fine"),
    row(C::Objects, Move(Right, Fine), &[(Moving, &["Shift-Right"])], "move right, fine"),
    row(C::Objects, Move(In, Fine), &[(Moving, &["Shift-Up"])], "move away, fine"),
    row(C::Objects, Move(Out, Fine), &[(Moving, &["Shift-Down"])], "move nearer, fine"),
    row(C::Objects, Move(Up, Fine), &[(Moving, &["Shift-PageUp"])], "raise, fine"),
    row(C::Objects, Move(Down, Fine), &[(Moving, &["Shift-PageDown"])], "lower, fine"),
    row(C::Objects, TurnMode, &[(Anywhere, &["r"])], "turn the selection"),
    row(C::Objects, Rotate(Left, Coarse), &[(Turning, &["Left"])], "turn left"),
    row(C::Objects, Rotate(Right, Coarse), &[(Turning, &["Right"])], "turn right"),
    row(C::Objects, Rotate(Left, Fine), &[(Turning, &["Shift-Left"])], "turn left, fine"),
    row(C::Objects, Rotate(Right, Fine), &[(Turning, &["Shift-Right"])], "turn right, fine"),
    row(C::Objects, SnapToGround, &[(Anywhere, &["g"])], "put the selection down"),
    row(C::Objects, OwnMaterial, &[(Anywhere, &["M"])], "give it a material of its own"),

    row(C::Panels, NextPanel, &[(Anywhere, &["Tab"]), (Overlay, &["Tab"])], "next panel or field"),
    row(C::Panels, PreviousPanel, &[(Anywhere, &["Shift-Tab"]), (Overlay, &["Shift-Tab"])], "panel or field before"),
    row(C::Panels, Cancel, &[(Anywhere, &["Esc"]), (Moving, &["Enter"]), (Turning, &["Enter"]), (Flying, &["Enter"]), (Probing, &["Enter"]), (Overlay, &["Esc"])], "leave, back to the picture"),
    row(C::Panels, Open, &[(Picture, &["Enter"]), (Outline, &["Enter", "Right"]), (Inspector, &["Enter", "0", "1", "2", "3", "4", "5", "6", "7", "8", "9", "-", "+", ".", "#"]), (Overlay, &["Enter"])], "inspect, type a value, choose"),
    row(C::Panels, Cursor(Up), &[(Outline, &["Up"]), (Inspector, &["Up"]), (Overlay, &["Up"])], "line above"),
    row(C::Panels, Cursor(Down), &[(Outline, &["Down"]), (Inspector, &["Down"]), (Overlay, &["Down"])], "line below"),
    row(C::Panels, Page(Up), &[(Outline, &["PageUp"]), (Inspector, &["PageUp"]), (Overlay, &["PageUp"])], "page up"),
    row(C::Panels, Page(Down), &[(Outline, &["PageDown"]), (Inspector, &["PageDown"]), (Overlay, &["PageDown"])], "page down"),
    row(C::Panels, First, &[(Outline, &["Home"]), (Inspector, &["Home"]), (Overlay, &["Home"])], "first line"),
    row(C::Panels, Last, &[(Outline, &["End"]), (Inspector, &["End"]), (Overlay, &["End"])], "last line"),
    row(C::Panels, Step(More, Coarse), &[(Inspector, &["Right"]), (Overlay, &["Right"])], "field up"),
    row(C::Panels, Step(Less, Coarse), &[(Inspector, &["Left"]), (Overlay, &["Left"])], "field down"),
    row(C::Panels, Step(More, Fine), &[(Inspector, &["Shift-Right"]), (Overlay, &["Shift-Right"])], "field up, fine"),
    row(C::Panels, Step(Less, Fine), &[(Inspector, &["Shift-Left"]), (Overlay, &["Shift-Left"])], "field down, fine"),
    row(C::Panels, ClearField, &[(Inspector, &["Backspace"])], "field back to its default"),
    row(C::Panels, ToggleFullscreen, &[(Anywhere, &["z"])], "only the picture"),

    row(C::File, Undo, &[(Anywhere, &["u"])], "undo"),
    row(C::File, Redo, &[(Anywhere, &["U", "Ctrl-r"])], "redo"),
    row(C::File, Save, &[(Anywhere, &["Ctrl-s"])], "save"),
    row(C::File, SaveAs, &[(Anywhere, &["W"])], "save as"),
    row(C::File, Reload, &[(Anywhere, &["Ctrl-o"])], "read the file again"),
    row(C::File, Recover, &[], "recover edits of a broken session"),
    row(C::File, Suspend, &[(Anywhere, &["Ctrl-z"]), (Overlay, &["Ctrl-z"])], "suspend to the shell"),
    row(C::File, Quit, &[(Anywhere, &["q", "Ctrl-c"]), (Overlay, &["Ctrl-c"])], "quit"),

    row(C::Picture, ExportPng, &[(Anywhere, &["p"])], "write a PNG"),
    row(C::Picture, ExportExr, &[(Anywhere, &["P"])], "write an EXR"),
    row(C::Picture, ShowExport, &[(Anywhere, &["o"])], "look at the last picture"),
    row(C::Picture, CopyPath, &[(Anywhere, &["y"])], "copy the path of the last picture"),
    row(C::Picture, ExportSized, &[(Anywhere, &["Ctrl-e"])], "render at another size"),
    row(C::Picture, CancelExport, &[(Anywhere, &["Ctrl-x"])], "cancel the running export"),
    row(C::Picture, Exposure(More), &[(Anywhere, &["=", "+"])], "exposure up"),
    row(C::Picture, Exposure(Less), &[(Anywhere, &["-"])], "exposure down"),
    row(C::Picture, ResetExposure, &[(Anywhere, &["0"])], "exposure 0"),
    row(C::Picture, NextTone, &[(Anywhere, &["t"])], "next tone curve"),
    row(C::Picture, NextChannel, &[(Anywhere, &["v"])], "next view: noise, samples, objects, …"),
    row(C::Picture, PreviousChannel, &[(Anywhere, &["V"])], "view before"),
    row(C::Picture, Probe, &[(Anywhere, &["i"])], "probe a pixel"),
    row(C::Picture, MoveProbe(Left, Coarse), &[(Probing, &["Left"])], "probe left"),
    row(C::Picture, MoveProbe(Right, Coarse), &[(Probing, &["Right"])], "probe right"),
    row(C::Picture, MoveProbe(Up, Coarse), &[(Probing, &["Up"])], "probe up"),
    row(C::Picture, MoveProbe(Down, Coarse), &[(Probing, &["Down"])], "probe down"),
    row(C::Picture, MoveProbe(Left, Fine), &[(Probing, &["Shift-Left"])], "probe left by one pixel"),
    row(C::Picture, MoveProbe(Right, Fine), &[(Probing, &["Shift-Right"])], "probe right by one pixel"),
    row(C::Picture, MoveProbe(Up, Fine), &[(Probing, &["Shift-Up"])], "probe up by one pixel"),
    row(C::Picture, MoveProbe(Down, Fine), &[(Probing, &["Shift-Down"])], "probe down by one pixel"),
    row(C::Picture, Keep, &[(Anywhere, &["k"])], "keep this picture"),
    row(C::Picture, Flip, &[(Anywhere, &["c"])], "flip between kept and live"),
    row(C::Picture, Difference, &[(Anywhere, &["C"])], "difference of kept and live"),

    row(C::Render, Pause, &[(Anywhere, &["Space"])], "pause or go on"),
    row(C::Render, Restart, &[(Anywhere, &["R"])], "begin the picture anew"),
    row(C::Render, StopAt, &[(Anywhere, &["T"])], "stop at …"),
    row(C::Render, Quality, &[(Anywhere, &["N"])], "quality: what each costs"),
    row(C::Render, Threads(More), &[], "more threads"),
    row(C::Render, Threads(Less), &[], "fewer threads"),
    row(C::Render, Priority, &[], "low or normal priority"),
    row(C::Render, NextColors, &[(Anywhere, &["#"])], "next colour mode of the terminal"),

    row(C::Help, Help, &[(Anywhere, &["?", "F1"])], "all keys"),
    row(C::Help, Palette, &[(Anywhere, &[":", "Ctrl-p"])], "find an action"),
    row(C::Help, Inventory, &[], "what the scene contains"),
];

impl Chapter {
    /// Every chapter, in the order of the help.
    pub const ALL: [Self; 9] = [
        Self::Camera,
        Self::Light,
        Self::Mirror,
        Self::Objects,
        Self::Panels,
        Self::File,
        Self::Picture,
        Self::Render,
        Self::Help,
    ];

    /// Its heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Light => "light",
            Self::Mirror => "mirror",
            Self::Objects => "objects",
            Self::Panels => "panels",
            Self::File => "file",
            Self::Picture => "picture",
            Self::Render => "rendering",
            Self::Help => "help",
        }
    }
}

impl Context {
    /// Where it is, as a phrase: `in the outline`; empty: everywhere.
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

    /// Where a key is looked up that is pressed here: the first of these that knows it.
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

impl Row {
    /// The row of `action`, which is in the table.
    pub fn of(action: Action) -> Option<&'static Self> {
        KEYMAP.iter().find(|row| row.action == action)
    }

    /// The first key of the row that works in `context`, for hints and the palette.
    pub fn key(&self, context: Context) -> Option<&'static str> {
        let in_context = |c: &Context| self.keys.iter().find(|(of, _)| of == c);
        context.chain().iter().find_map(in_context).and_then(|(_, keys)| keys.first().copied())
    }

    /// All keys of the row as help shows them: `Left in the picture`, `u`.
    pub fn all_keys(&self) -> String {
        let of = |(context, keys): &(Context, &[&str])| match context.place() {
            "" => keys.join(" "),
            place => format!("{} {place}", keys.join(" ")),
        };
        self.keys.iter().map(of).collect::<Vec<_>>().join(", ")
    }
}

/// What `key` does in `context`.
pub fn lookup(context: Context, key: Key) -> Option<Action> {
    static TABLE: OnceLock<HashMap<(Context, Key), Action>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        let keys = |row: &'static Row| {
            let of = |(context, names): &'static (Context, &[&str])| {
                // Names that are no keys are found by the test of the table.
                let keys = names.iter().filter_map(|name| name.parse::<Key>().ok());
                keys.map(|key| ((*context, key), row.action))
            };
            row.keys.iter().flat_map(of)
        };
        KEYMAP.iter().flat_map(keys).collect()
    });
    context.chain().iter().find_map(|context| table.get(&(*context, key)).copied())
}
