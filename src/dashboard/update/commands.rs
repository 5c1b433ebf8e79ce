//! Command table, from which key dispatch, hint line, command palette and docs/keys.md are derived.

use crate::dashboard::key_context::KeyContext::{self, *};
use crate::dashboard::update::{BACK, DOWN, FORWARD, LEFT, RIGHT, UP};
use crate::dashboard::{
    DisplayChannel, Effect, Format, Mode, Model, Overlay, SceneSource, UpdateContext,
};
use HintLine as H;
use zerkalo_scene::edit;
use zerkalo_terminal::event::Key;

/// State that selects the hints in the hint line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HintLine {
    /// There was no user input yet.
    First,
    /// No overlay is open, and keys are looked up in this context.
    In(KeyContext),
    /// A question or a list that typing does not search is open.
    List,
    /// A list that typing searches is open.
    Search,
    Form,
    Typing,
    /// A number or colour is being typed.
    Number,
    Watching,
}

/// Description of a command, or of several related ones, for the hint line.
#[derive(Clone, Copy, Debug)]
pub struct Hint {
    pub lines: &'static [HintLine],
    /// Position in the hint line; smaller numbers come first.
    pub position: u8,
    /// Keys as shown, such as `PgUp PgDn`.
    pub keys: &'static str,
    pub text: &'static str,
}

/// Row of the command table.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// Chapter of docs/keys.md. The commands of a chapter follow each other in the table.
    pub chapter: &'static str,
    /// Unique description for command palette and docs/keys.md.
    pub label: &'static str,
    /// Contexts with the names of the keys there, separated by spaces. A command without keys runs
    /// only from the command palette.
    pub keys: &'static [(KeyContext, &'static str)],
    /// Other words by which the palette finds the command.
    pub also: &'static str,
    /// Hints, which may also describe related commands.
    pub hints: &'static [Hint],
    /// Function that returns `true` if the command can run.
    pub(super) available: fn(&Model) -> bool,
    pub(super) run: fn(&mut UpdateContext<'_>),
}

const fn command(
    chapter: &'static str,
    label: &'static str,
    keys: &'static [(KeyContext, &'static str)],
    run: fn(&mut UpdateContext<'_>),
) -> Command {
    Command { chapter, label, keys, also: "", hints: &[], available: editing, run }
}

const fn hint(
    lines: &'static [HintLine],
    position: u8,
    keys: &'static str,
    text: &'static str,
) -> Hint {
    Hint { lines, position, keys, text }
}

/// Returns `true` if there is a picture: of watched files, or of a scene that was readable.
fn viewing(model: &Model) -> bool {
    !model.file.unreadable
}

/// Returns `true` if there is a scene to edit and render.
fn editing(model: &Model) -> bool {
    viewing(model) && not_watching(model)
}

/// Returns `true` unless this is `zerkalo watch`, which neither edits nor renders.
fn not_watching(model: &Model) -> bool {
    model.watch.is_none()
}

/// Returns `true` if there is a picture, or if a list or question is open, which need no picture.
fn viewing_or_choosing(model: &Model) -> bool {
    viewing(model) || matches!(model.overlay, Some(Overlay::Pick(_) | Overlay::Question(_)))
}

fn always(_: &Model) -> bool {
    true
}

/// All commands, in the order of the command palette.
#[rustfmt::skip] // One line per row keeps the table readable.
pub static COMMANDS: &[Command] = &[
    command("camera", "orbit left", &[(Picture, "Left")], |c| c.orbit_or_pan(LEFT)).also("turn rotate").hints(&[hint(&[H::First, H::In(Picture)], 1, "arrows", "orbit")]),
    command("camera", "orbit right", &[(Picture, "Right")], |c| c.orbit_or_pan(RIGHT)),
    command("camera", "orbit up", &[(Picture, "Up")], |c| c.orbit_or_pan(UP)),
    command("camera", "orbit down", &[(Picture, "Down")], |c| c.orbit_or_pan(DOWN)),
    command("camera", "dolly in", &[(Picture, "PageUp")], |c| c.dolly(1.0)).also("zoom closer").hints(&[hint(&[H::In(Picture)], 2, "PgUp PgDn", "dolly")]),
    command("camera", "dolly out", &[(Picture, "PageDown")], |c| c.dolly(-1.0)).also("zoom farther"),
    command("camera", "dolly in, fine", &[(Picture, "Shift-PageUp")], |c| c.dolly(0.1)),
    command("camera", "dolly out, fine", &[(Picture, "Shift-PageDown")], |c| c.dolly(-0.1)),
    command("camera", "pan left", &[(Picture, "Shift-Left")], |c| c.pan(LEFT)).hints(&[hint(&[H::In(Picture)], 3, "Shift", "pan")]),
    command("camera", "pan right", &[(Picture, "Shift-Right")], |c| c.pan(RIGHT)),
    command("camera", "pan up", &[(Picture, "Shift-Up")], |c| c.pan(UP)),
    command("camera", "pan down", &[(Picture, "Shift-Down")], |c| c.pan(DOWN)),
    command("camera", "look left", &[(Picture, "Ctrl-Left"), (Flying, "Left")], |c| c.look(LEFT)).hints(&[hint(&[H::In(Flying)], 4, "arrows", "look")]),
    command("camera", "look right", &[(Picture, "Ctrl-Right"), (Flying, "Right")], |c| c.look(RIGHT)),
    command("camera", "look up", &[(Picture, "Ctrl-Up"), (Flying, "Up")], |c| c.look(UP)),
    command("camera", "look down", &[(Picture, "Ctrl-Down"), (Flying, "Down")], |c| c.look(DOWN)),
    command("camera", "roll left", &[(Picture, "Alt-Left")], |c| c.roll(LEFT)),
    command("camera", "roll right", &[(Picture, "Alt-Right")], |c| c.roll(RIGHT)),
    command("camera", "narrower view angle", &[(Picture, "Alt-Up")], |c| c.view_angle(-1)).also("zoom fov lens"),
    command("camera", "wider view angle", &[(Picture, "Alt-Down")], |c| c.view_angle(1)).also("zoom fov lens"),
    command("camera", "fly the camera", &[(Anywhere, "w")], |c| c.enter_mode(Mode::Fly)),
    command("camera", "fly forward", &[(Flying, "w")], |c| c.fly(FORWARD)).hints(&[hint(&[H::In(Flying)], 1, "w s", "forward, back")]),
    command("camera", "fly back", &[(Flying, "s")], |c| c.fly(BACK)),
    command("camera", "fly left", &[(Flying, "a")], |c| c.fly(LEFT)).hints(&[hint(&[H::In(Flying)], 2, "a d", "left, right")]),
    command("camera", "fly right", &[(Flying, "d")], |c| c.fly(RIGHT)),
    command("camera", "fly up", &[(Flying, "r PageUp")], |c| c.fly(UP)).hints(&[hint(&[H::In(Flying)], 3, "r f", "up, down")]),
    command("camera", "fly down", &[(Flying, "f PageDown")], |c| c.fly(DOWN)),
    command("camera", "frame the selection", &[(Anywhere, "f")], |c| c.frame()).hints(&[hint(&[H::In(Outline)], 6, "f", "frame")]),
    command("camera", "back to the camera of the scene", &[(Anywhere, "h"), (Picture, "Home")], |c| c.leave_view()),
    command("camera", "make this view the camera", &[(Anywhere, "H")], |c| c.keep_view()),
    command("camera", "marks of lights and selection on or off", &[(Anywhere, "Alt-m")], |c| c.toggle_marks()),
    command("camera", "open the aperture", &[(Anywhere, "Alt-o")], |c| c.aperture(1.0)).also("blur depth lens"),
    command("camera", "close the aperture", &[(Anywhere, "Alt-c")], |c| c.aperture(-1.0)),
    command("camera", "focus on the probe or the selection", &[(Anywhere, "F")], |c| c.focus()),
    command("camera", "store this viewpoint", &[(Anywhere, "n")], |c| c.ask_view_name()),
    command("camera", "go to viewpoint 1 to 9", &[(Picture, "1 2 3 4 5 6 7 8 9")], |c| c.recall_view()),

    command("light", "select the next light", &[(Anywhere, "l")], |c| c.next_light()).hints(&[hint(&[H::In(Picture)], 5, "l ; '", "light")]),
    command("light", "light brighter", &[(Anywhere, "'")], |c| c.intensity(1.0)).also("intensity"),
    command("light", "light darker", &[(Anywhere, ";")], |c| c.intensity(-1.0)),
    command("light", "light brighter, fine", &[(Anywhere, "Alt-'")], |c| c.intensity(0.1)),
    command("light", "light darker, fine", &[(Anywhere, "Alt-;")], |c| c.intensity(-0.1)),
    command("light", "light on or off", &[(Anywhere, "L")], |c| c.switch_light()),
    command("light", "light group alone, or all light", &[(Anywhere, "Alt-l")], |c| c.solo()).also("solo mute"),
    command("light", "add a light", &[(Anywhere, "A")], |c| c.pick_light()),

    command("mirror", "mirror rougher", &[(Anywhere, "]"), (Picture, ".")], |c| c.step_mirror("roughness", 1.0)).also("blur glossy").hints(&[hint(&[H::First, H::In(Picture)], 4, "[ ]", "roughness")]),
    command("mirror", "mirror smoother", &[(Anywhere, "["), (Picture, ",")], |c| c.step_mirror("roughness", -1.0)).also("crisp sharp"),
    command("mirror", "mirror rougher, fine", &[(Anywhere, "}"), (Picture, ">")], |c| c.step_mirror("roughness", 0.1)),
    command("mirror", "mirror smoother, fine", &[(Anywhere, "{"), (Picture, "<")], |c| c.step_mirror("roughness", -0.1)),
    command("mirror", "mirror reflects more", &[(Picture, ")")], |c| c.step_mirror("reflection", 1.0)),
    command("mirror", "mirror reflects less", &[(Picture, "(")], |c| c.step_mirror("reflection", -1.0)),
    command("mirror", "next lobe of the mirror", &[(Picture, "b \\")], |c| c.step_mirror("lobe", 1.0)).also("ggx beckmann cone"),

    command("objects", "add an object", &[(Anywhere, "a")], |c| c.pick_object()).hints(&[hint(&[H::First, H::In(Picture)], 6, "a", "add")]),
    command("objects", "mark or unmark the selection", &[(Anywhere, "V")], |c| c.toggle_mark()).also("multi select several group").hints(&[hint(&[H::In(Outline)], 12, "V", "mark")]),
    command("objects", "union of the marked objects", &[(Anywhere, "|")], |c| c.join("union")).also("compound boolean join csg"),
    command("objects", "intersection of the marked objects", &[(Anywhere, "&")], |c| c.join("intersection")).also("compound boolean join csg"),
    command("objects", "difference: the first marked without the others", &[(Anywhere, "_")], |c| c.join("difference")).also("compound boolean subtract cut csg"),
    command("objects", "add a part to the compound", &[(Anywhere, "Alt-a")], |c| c.pick_part()).also("union"),
    command("objects", "dissolve the compound into its parts", &[(Anywhere, "B")], |c| c.dissolve()).also("break explode"),
    command("objects", "duplicate the selection", &[(Anywhere, "D")], |c| c.duplicate()).hints(&[hint(&[H::In(Outline)], 4, "D", "duplicate")]),
    command("objects", "delete the selection", &[(Anywhere, "x Delete")], |c| c.delete()).hints(&[hint(&[H::In(Outline)], 11, "x", "delete")]),
    command("objects", "rename the selection", &[(Anywhere, "e F2")], |c| c.ask_name()).hints(&[hint(&[H::In(Outline)], 3, "e", "rename")]),
    command("objects", "move the selection", &[(Anywhere, "m")], |c| c.enter_mode(Mode::Move)).hints(&[hint(&[H::First, H::In(Picture), H::In(Outline)], 7, "m", "move")]),
    command("objects", "move left", &[(Moving, "Left")], |c| c.move_selection(LEFT, 1.0)).hints(&[hint(&[H::In(Moving)], 1, "arrows", "in plane")]),
    command("objects", "move right", &[(Moving, "Right")], |c| c.move_selection(RIGHT, 1.0)),
    command("objects", "move away", &[(Moving, "Up")], |c| c.move_selection(FORWARD, 1.0)),
    command("objects", "move nearer", &[(Moving, "Down")], |c| c.move_selection(BACK, 1.0)),
    command("objects", "raise", &[(Moving, "PageUp")], |c| c.move_selection(UP, 1.0)).hints(&[hint(&[H::In(Moving)], 2, "PgUp PgDn", "height")]),
    command("objects", "lower", &[(Moving, "PageDown")], |c| c.move_selection(DOWN, 1.0)),
    command("objects", "move left, fine", &[(Moving, "Shift-Left")], |c| c.move_selection(LEFT, 0.1)).hints(&[hint(&[H::In(Moving)], 3, "Shift", "fine")]),
    command("objects", "move right, fine", &[(Moving, "Shift-Right")], |c| c.move_selection(RIGHT, 0.1)),
    command("objects", "move away, fine", &[(Moving, "Shift-Up")], |c| c.move_selection(FORWARD, 0.1)),
    command("objects", "move nearer, fine", &[(Moving, "Shift-Down")], |c| c.move_selection(BACK, 0.1)),
    command("objects", "raise, fine", &[(Moving, "Shift-PageUp")], |c| c.move_selection(UP, 0.1)),
    command("objects", "lower, fine", &[(Moving, "Shift-PageDown")], |c| c.move_selection(DOWN, 0.1)),
    command("objects", "move by a typed distance", &[(Moving, "x y z 0 1 2 3 4 5 6 7 8 9 - .")], |c| c.ask_move()).hints(&[hint(&[H::In(Moving)], 5, "x y z", "type a distance")]),
    command("objects", "rotate the selection", &[(Anywhere, "r")], |c| c.enter_mode(Mode::Rotate)),
    command("objects", "rotate left", &[(Rotating, "Left")], |c| c.rotate_selection(-15.0)).hints(&[hint(&[H::In(Rotating)], 1, "Left Right", "rotate 15°")]),
    command("objects", "rotate right", &[(Rotating, "Right")], |c| c.rotate_selection(15.0)),
    command("objects", "rotate left, fine", &[(Rotating, "Shift-Left")], |c| c.rotate_selection(-1.0)).hints(&[hint(&[H::In(Rotating)], 2, "Shift", "1°")]),
    command("objects", "rotate right, fine", &[(Rotating, "Shift-Right")], |c| c.rotate_selection(1.0)),
    command("objects", "rotate by a typed angle", &[(Rotating, "0 1 2 3 4 5 6 7 8 9 - .")], |c| c.ask_angle()).hints(&[hint(&[H::In(Rotating)], 3, "0-9", "type degrees")]),
    command("objects", "scale the selection", &[(Anywhere, "Alt-s")], |c| c.ask_scale()).also("size larger smaller resize"),
    command("objects", "array of the selection", &[(Anywhere, "Alt-d")], |c| c.ask_array()).also("copies duplicate repeat row"),
    command("objects", "snap the selection to ground", &[(Anywhere, "g")], |c| c.apply(edit::snap_to_ground)).hints(&[hint(&[H::In(Moving)], 4, "g", "snap to ground")]),
    command("objects", "give the object its own material", &[(Anywhere, "M")], |c| c.apply(edit::own_material)),
    command("objects", "make the selection gold, glass, …", &[(Anywhere, "S")], |c| c.pick_preset()),
    command("objects", "remove unused materials", &[], |c| c.purge_materials()),

    command("panels", "next panel, or complete, or next group of fields", &[(Anywhere, "Tab"), (Overlay, "Tab")], |c| c.next_panel(1)).available(viewing).hints(&[hint(&[H::In(Picture)], 8, "Tab", "panels"), hint(&[H::Watching], 1, "Tab", "files")]),
    command("panels", "previous panel or group of fields", &[(Anywhere, "Shift-Tab"), (Overlay, "Shift-Tab")], |c| c.next_panel(-1)).available(viewing),
    command("panels", "leave, back to the picture", &[(Anywhere, "Esc"), (Moving, "Enter"), (Rotating, "Enter"), (Flying, "Enter"), (Probing, "Enter"), (Overlay, "Esc")], |c| c.leave()).available(always).hints(&[
        hint(&[H::In(Moving), H::In(Rotating), H::In(Flying), H::In(Probing)], 9, "Esc", "done"),
        hint(&[H::In(Outline), H::In(Inspector)], 9, "Esc", "picture"),
        hint(&[H::List, H::Search, H::Form], 9, "Esc", "cancel"),
        hint(&[H::Typing, H::Number], 9, "Esc", "leave as it was"),
    ]),
    command("panels", "inspect, edit, confirm, choose", &[(Picture, "Enter"), (Outline, "Enter"), (Inspector, "Enter"), (Overlay, "Enter")], |c| c.open()).available(viewing_or_choosing).hints(&[
        hint(&[H::In(Outline)], 2, "Enter", "inspect"),
        hint(&[H::In(Inspector)], 4, "Enter 0-9", "type"),
        hint(&[H::List], 2, "Enter", "take"),
        hint(&[H::Search], 3, "Enter", "take"),
        hint(&[H::Form], 3, "Enter", "edit"),
        hint(&[H::Typing, H::Number], 1, "Enter", "confirm"),
        hint(&[H::Number], 2, "*2 /2 +.1 -=.1", "change it"),
    ]),
    command("panels", "list the parts of a compound", &[(Outline, "Right")], |c| c.unfold()).hints(&[hint(&[H::In(Outline)], 10, "Right Left", "parts")]),
    command("panels", "hide the parts, select the whole", &[(Outline, "Left")], |c| c.fold()),
    command("panels", "line above", &[(Outline, "Up"), (Inspector, "Up"), (Overlay, "Up")], |c| c.move_cursor(-1)).available(always).hints(&[
        hint(&[H::In(Outline)], 1, "Up Down", "select"),
        hint(&[H::In(Inspector), H::Form], 1, "Up Down", "field"),
        hint(&[H::Form], 5, "letters /", "find"),
        hint(&[H::List, H::Search], 1, "Up Down", "choose"),
        hint(&[H::Search], 2, "letters", "find"),
        hint(&[H::Watching], 2, "Up Down", "select"),
    ]),
    command("panels", "line below", &[(Outline, "Down"), (Inspector, "Down"), (Overlay, "Down")], |c| c.move_cursor(1)).available(always),
    command("panels", "page up", &[(Outline, "PageUp"), (Inspector, "PageUp"), (Overlay, "PageUp")], |c| c.page(-1)).available(always),
    command("panels", "page down", &[(Outline, "PageDown"), (Inspector, "PageDown"), (Overlay, "PageDown")], |c| c.page(1)).available(always),
    command("panels", "first line", &[(Outline, "Home"), (Inspector, "Home"), (Overlay, "Home")], |c| c.move_cursor(isize::MIN / 2)).available(always).hints(&[hint(&[H::Form], 8, "Home Enter", "add")]),
    command("panels", "last line", &[(Outline, "End"), (Inspector, "End"), (Overlay, "End")], |c| c.move_cursor(isize::MAX / 2)).available(always),
    command("panels", "field up", &[(Inspector, "Right"), (Overlay, "Right")], |c| c.step_field(1.0)).hints(&[hint(&[H::In(Inspector), H::Form], 2, "Left Right", "step")]),
    command("panels", "field down", &[(Inspector, "Left"), (Overlay, "Left")], |c| c.step_field(-1.0)),
    command("panels", "field up, fine", &[(Inspector, "Shift-Right"), (Overlay, "Shift-Right")], |c| c.step_field(0.1)).hints(&[hint(&[H::In(Inspector)], 3, "Shift", "fine")]),
    command("panels", "field down, fine", &[(Inspector, "Shift-Left"), (Overlay, "Shift-Left")], |c| c.step_field(-0.1)),
    command("panels", "reset the field to its default", &[(Inspector, "Backspace Delete")], |c| c.fill_field("")).hints(&[hint(&[H::In(Inspector)], 6, "Backspace", "default")]),
    command("panels", "find a field or a part of the scene", &[(Anywhere, "/")], |c| c.find()).also("search").hints(&[hint(&[H::In(Outline), H::In(Inspector)], 5, "/", "find")]),
    command("panels", "fold or unfold a group of fields", &[(Inspector, "Alt-f"), (Overlay, "Alt-f")], |c| c.fold_group()).also("hide material shape"),
    command("panels", "only the picture", &[(Anywhere, "z")], |c| c.toggle_fullscreen()).available(viewing),

    command("file", "undo", &[(Anywhere, "u")], |c| c.undo()).hints(&[hint(&[H::In(Picture)], 9, "u", "undo")]),
    command("file", "redo", &[(Anywhere, "U Ctrl-r")], |c| c.redo()),
    command("file", "list the undo steps", &[(Anywhere, "Alt-u")], |c| c.list_steps()).also("history"),
    command("file", "save", &[(Anywhere, "Ctrl-s"), (Overlay, "Ctrl-s")], |c| c.save()),
    command("file", "save as", &[(Anywhere, "W")], |c| c.ask_path()),
    command("file", "new scene", &[(Anywhere, "Ctrl-n")], |c| c.open_scene(SceneSource::New)).available(not_watching),
    command("file", "open another scene", &[(Anywhere, "O")], |c| c.emit(Effect::ListScenes)).available(not_watching),
    command("file", "read the file again", &[(Anywhere, "Ctrl-o")], |c| c.reload()).also("reload revert").available(not_watching),
    command("file", "recover edits of a crashed session", &[], |c| c.ask_recovery()).available(not_watching),
    command("file", "write a checkpoint to continue later", &[(Anywhere, "K")], |c| c.checkpoint()),
    command("file", "suspend to the shell", &[(Anywhere, "Ctrl-z"), (Overlay, "Ctrl-z")], |c| c.emit(Effect::Suspend)).available(always),
    command("file", "quit", &[(Anywhere, "q Ctrl-c"), (Overlay, "Ctrl-c")], |c| c.quit()).available(always).hints(&[hint(&[H::First, H::Watching], 13, "q", "quit")]),

    command("picture", "write a PNG", &[(Anywhere, "p")], |c| c.export(Format::Png)).also("export image render").available(viewing).hints(&[hint(&[H::In(Picture), H::Watching], 10, "p", "PNG")]),
    command("picture", "write a PNG when converged", &[(Anywhere, "Alt-p")], |c| c.export_when_done()),
    command("picture", "write an EXR", &[(Anywhere, "P")], |c| c.export(Format::Exr)).also("export image render").available(viewing).hints(&[hint(&[H::Watching], 11, "P", "EXR")]),
    command("picture", "view the last picture", &[(Anywhere, "o")], |c| c.view_last_export()).also("image show").available(viewing),
    command("picture", "download the last picture", &[(Anywhere, "Y")], |c| c.download_last_export()).also("scp copy laptop file").available(viewing),
    command("picture", "copy the path of the last picture", &[(Anywhere, "y")], |c| c.copy_path()).available(viewing),
    command("picture", "render at another size", &[(Anywhere, "Ctrl-e")], |c| c.ask_export_size()).also("export image resolution"),
    command("picture", "cancel the running export", &[(Anywhere, "Ctrl-x")], |c| c.cancel_export()),
    command("picture", "exposure up", &[(Anywhere, "= +")], |c| c.exposure(1.0)).available(viewing),
    command("picture", "exposure down", &[(Anywhere, "-")], |c| c.exposure(-1.0)).available(viewing),
    command("picture", "exposure 0", &[(Anywhere, "0")], |c| c.set_exposure(0.0)).available(viewing),
    command("picture", "exposure from the picture", &[(Anywhere, "E")], |c| c.expose()).available(viewing),
    command("picture", "next tone curve", &[(Anywhere, "t")], |c| c.next_tone()).available(viewing),
    command("picture", "next view: noise, samples, objects, …", &[(Anywhere, "v")], |c| c.next_channel(1)).available(viewing).hints(&[hint(&[H::In(Probing), H::Watching], 3, "v", "views")]),
    command("picture", "view before", &[(Anywhere, "Alt-v")], |c| c.next_channel(-1)).available(viewing),
    command("picture", "zoom in", &[(Anywhere, "Z Alt-=")], |c| c.zoom(1, None)).available(viewing),
    command("picture", "zoom out", &[(Anywhere, "X Alt--")], |c| c.zoom(-1, None)).available(viewing),
    command("picture", "zoom fits: the whole picture", &[(Anywhere, "Alt-0")], |c| c.zoom_fits()).available(viewing),
    command("picture", "loupe: automatic, always, never", &[(Anywhere, "G")], |c| c.next_loupe()).available(viewing),
    command("picture", "next protocol or blocks of the picture", &[(Anywhere, "Alt-#")], |c| c.next_graphics()).also("graphics kitty sixel cells quadrants sextants octants").available(viewing),
    command("picture", "probe a pixel", &[(Anywhere, "i")], |c| c.toggle_probe()).available(viewing).hints(&[hint(&[H::Watching], 4, "i", "probe")]),
    command("picture", "probe left", &[(Probing, "Left")], |c| c.move_probe(LEFT)).available(viewing).hints(&[hint(&[H::In(Probing)], 1, "arrows", "move")]),
    command("picture", "probe right", &[(Probing, "Right")], |c| c.move_probe(RIGHT)).available(viewing),
    command("picture", "probe up", &[(Probing, "Up")], |c| c.move_probe(UP)).available(viewing),
    command("picture", "probe down", &[(Probing, "Down")], |c| c.move_probe(DOWN)).available(viewing),
    command("picture", "probe left by one pixel", &[(Probing, "Shift-Left")], |c| c.move_probe_by_pixel(LEFT)).available(viewing).hints(&[hint(&[H::In(Probing)], 2, "Shift", "one pixel")]),
    command("picture", "probe right by one pixel", &[(Probing, "Shift-Right")], |c| c.move_probe_by_pixel(RIGHT)).available(viewing),
    command("picture", "probe up by one pixel", &[(Probing, "Shift-Up")], |c| c.move_probe_by_pixel(UP)).available(viewing),
    command("picture", "probe down by one pixel", &[(Probing, "Shift-Down")], |c| c.move_probe_by_pixel(DOWN)).available(viewing),
    command("picture", "pin this picture", &[(Anywhere, "k")], |c| c.pin()).also("compare keep").available(viewing).hints(&[hint(&[H::Watching], 5, "k c C", "compare")]),
    command("picture", "flip between pinned and live", &[(Anywhere, "c")], |c| c.compare(DisplayChannel::Pinned)).also("compare").available(viewing),
    command("picture", "compare: difference, side by side, wipe", &[(Anywhere, "C")], |c| c.next_comparison()).also("pinned live split").available(viewing),
    command("picture", "compare with an earlier picture", &[(Anywhere, "j")], |c| c.list_pictures()).also("history pinned").available(viewing),
    command("picture", "histogram or convergence", &[(Anywhere, "Alt-h")], |c| c.toggle_histogram()).also("luminance clipped levels").available(viewing),

    command("rendering", "pause or resume", &[(Anywhere, "Space")], |c| c.pause()),
    command("rendering", "restart the picture", &[(Anywhere, "R")], |c| c.restart()),
    command("rendering", "render only a region, or everything", &[(Anywhere, "Alt-r")], |c| c.toggle_region()).also("crop border window"),
    command("rendering", "stop at …", &[(Anywhere, "T")], |c| c.ask_stop()).also("samples rays spp time"),
    command("rendering", "noise targets and their times", &[(Anywhere, "N")], |c| c.open_noise_targets()).also("quality crisp samples rays"),
    command("rendering", "measure the noise by bounce", &[(Anywhere, "Alt-n")], |c| c.measure_bounces()).also("why noisy cause share"),
    command("rendering", "next colour mode of the terminal", &[(Anywhere, "#")], |c| c.next_colors()).also("settings").available(always),

    command("help", "find an action, field or part", &[(Anywhere, ": Ctrl-p")], |c| c.open_palette()).available(always).hints(&[
        hint(&[H::First], 11, ":", "all actions"),
        hint(&[H::In(Picture)], 11, ":", "all"),
    ]),
    command("help", "keys that work here", &[(Anywhere, "? F1")], |c| c.open_help()).available(always).also("help manual").hints(&[hint(&[H::First, H::In(Picture), H::Watching], 12, "?", "keys")]),
];

/// Returns all commands with other keys for some: each by its index in [`COMMANDS`], in the first context
/// of its keys, or anywhere. Other commands lose these keys there.
pub fn rebound(changes: &[(usize, String)]) -> &'static [Command] {
    let mut commands = COMMANDS.to_vec();
    for (index, names) in changes {
        let context = COMMANDS[*index].keys.first().map_or(Anywhere, |(context, _)| *context);
        let names: &'static str = names.clone().leak();
        for (other, command) in commands.iter_mut().enumerate() {
            let mut keys = command.keys.to_vec();
            if other == *index {
                keys.retain(|(place, _)| *place != context);
                keys.insert(0, (context, names));
                let hints = command.hints.iter().map(|hint| Hint { keys: names, ..*hint });
                command.hints = hints.collect::<Vec<_>>().leak();
            } else {
                let is_free = |name: &&str| !names.split(' ').any(|taken| taken == *name);
                for (_, own) in keys.iter_mut().filter(|(place, _)| *place == context) {
                    *own = own.split(' ').filter(is_free).collect::<Vec<_>>().join(" ").leak();
                }
            }
            keys.retain(|(_, names)| !names.is_empty());
            command.keys = keys.leak();
        }
    }
    commands.leak()
}

impl Command {
    const fn available(self, available: fn(&Model) -> bool) -> Self {
        Self { available, ..self }
    }

    const fn also(self, also: &'static str) -> Self {
        Self { also, ..self }
    }

    const fn hints(self, hints: &'static [Hint]) -> Self {
        Self { hints, ..self }
    }

    /// Returns `true` if the command palette lists the command. In `zerkalo watch`, it lists only
    /// commands that can run.
    pub fn is_listed(&self, model: &Model) -> bool {
        model.watch.is_none() || (self.available)(model)
    }

    /// Returns the keys with their contexts, such as `Left in the picture`. `key` formats the name
    /// of one key. If `watching` is `true`, omits keys without effect in `zerkalo watch` and keys
    /// of overlays.
    pub fn formatted_keys(&self, watching: bool, key: impl Fn(&str) -> String) -> String {
        let listed = |context| !watching || matches!(context, Anywhere | Outline | Probing);
        let in_context = |(context, names): &(KeyContext, &str)| {
            let keys: Vec<_> = names.split(' ').map(&key).collect();
            // The table of files uses the keys of the outline.
            let place = if watching && *context == Outline { "" } else { context.place() };
            format!("{} {place}", keys.join(" ")).trim_end().to_string()
        };
        let keys = self.keys.iter().filter(|(context, _)| listed(*context)).map(in_context);
        keys.collect::<Vec<_>>().join(", ")
    }
}

/// Returns which of `commands` `key` runs in `context`.
pub fn lookup(commands: &[Command], context: KeyContext, key: Key) -> Option<&Command> {
    let name = key.to_string();
    let has_key = |(context, names): &(KeyContext, &str), wanted| {
        *context == wanted && names.split(' ').any(|known| known == name)
    };
    let command_in = |context| {
        commands.iter().find(|command| command.keys.iter().any(|keys| has_key(keys, context)))
    };
    context.chain().find_map(command_in)
}
