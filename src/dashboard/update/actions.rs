//! Which method carries out which action.

use crate::dashboard::action::{Action, Delta, Direction, StepSize};
use crate::dashboard::layout::Focus;
use crate::dashboard::message::{Effect, Format};
use crate::dashboard::model::{CompareView, Inspector, Mode};
use crate::dashboard::overlay::Overlay;
use crate::dashboard::update::UpdateContext;

/// Coarse steps are 1 (or -1), fine ones a tenth: as `scene::edit::step` counts.
pub(super) fn steps(change: Delta, pace: StepSize) -> f64 {
    let size = match pace {
        StepSize::Coarse => 1.0,
        StepSize::Fine => 0.1,
    };
    match change {
        Delta::Up => size,
        Delta::Down => -size,
    }
}

/// Whether an action needs no scene.
fn needs_no_scene(action: Action) -> bool {
    use Action::*;
    matches!(
        action,
        Help | Palette
            | Quit
            | Suspend
            | Recover
            | Reload
            | Cancel
            | Cursor(_)
            | First
            | Last
            | Page(_)
            | NextColors
    )
}

impl UpdateContext<'_> {
    /// Carries out an action; `typed` is the character that asked for it, if it was one.
    pub(super) fn act(&mut self, action: Action, typed: Option<char>) {
        let in_list =
            matches!(self.model.overlay, Some(Overlay::Palette(_) | Overlay::Question(_)));
        if self.model.file.unreadable
            && !needs_no_scene(action)
            && !(in_list && action == Action::Open)
        {
            self.refuse("There is no scene to work on until its file can be read: mend it");
            return;
        }
        match action {
            Action::Orbit(way) => self.orbit(way),
            Action::Pan(way) => self.pan(way),
            Action::Dolly(way, pace) => self.dolly(way, pace),
            Action::ViewImage(way) => self.look(way),
            Action::Fly(way) => self.fly(way),
            Action::Roll(way) => self.roll(way),
            Action::ViewAngle(change) => self.view_angle(change),
            Action::Frame => self.frame(),
            Action::ResetCamera => self.reset_camera(),
            Action::StoreView => self.ask_view_name(),
            Action::RecallView(number) => self.recall_view(number),
            Action::MoveMode => self.enter_mode(Mode::Move),
            Action::TurnMode => self.enter_mode(Mode::Rotate),
            Action::FlyMode => self.enter_mode(Mode::Fly),
            Action::Move(way, pace) => self.move_selection(way, pace),
            Action::Rotate(way, pace) => self.turn_selection(way, pace),
            Action::Cancel => self.leave(),
            Action::NextLight => self.next_light(),
            Action::Intensity(change, pace) => self.intensity(steps(change, pace)),
            Action::SwitchLight => self.switch_light(),
            Action::AddLight => self.pick_light(),
            Action::Roughness(change, pace) => self.roughness(steps(change, pace)),
            Action::Reflection(change) => self.reflection(steps(change, StepSize::Coarse)),
            Action::NextLobe => self.next_lobe(),
            Action::AddObject => self.pick_object(),
            Action::Duplicate => self.duplicate(),
            Action::Delete => self.delete(),
            Action::Rename => self.ask_name(),
            Action::SnapToGround => self.drop_down(),
            Action::OwnMaterial => self.own_material(),
            Action::NextPanel => self.next_panel(1),
            Action::PreviousPanel => self.next_panel(-1),
            Action::ToggleFullscreen => self.only_picture(),
            Action::Cursor(way) => self.walk(if way == Direction::Up { -1 } else { 1 }),
            Action::First => self.walk(isize::MIN / 2),
            Action::Last => self.walk(isize::MAX / 2),
            Action::Page(way) => self.page(way),
            Action::Open => self.open(typed),
            Action::Step(change, pace) => self.step_field(steps(change, pace)),
            Action::ClearField => self.clear_field(),
            Action::Undo => self.undo(),
            Action::Redo => self.redo(),
            Action::Save => self.save(),
            Action::SaveAs => self.ask_path(),
            Action::Reload => self.reload(),
            Action::Recover => self.ask_recovery(),
            Action::Suspend => self.emit(Effect::Suspend),
            Action::Quit => self.quit(),
            Action::Pause => self.pause(),
            Action::Restart => self.restart(),
            Action::StopAt => self.ask_stop(),
            Action::Quality => self.open_qualities(),
            Action::ExportPng => self.export(Format::Png),
            Action::ExportExr => self.export(Format::Exr),
            Action::CopyPath => self.copy_path(),
            Action::ShowExport => self.look_at_export(),
            Action::ExportSized => self.ask_export_size(),
            Action::CancelExport => self.cancel_export(),
            Action::Exposure(change) => self.exposure(steps(change, StepSize::Coarse)),
            Action::ResetExposure => self.reset_exposure(),
            Action::NextTone => self.next_tone(),
            Action::NextChannel => self.next_channel(1),
            Action::PreviousChannel => self.next_channel(-1),
            Action::Probe => self.toggle_probe(),
            Action::MoveProbe(way, pace) => self.move_probe(way, pace),
            Action::Keep => self.keep(),
            Action::Flip => self.compare(CompareView::Pinned),
            Action::Difference => self.compare(CompareView::Difference),
            Action::Threads(change) => self.threads(change),
            Action::Priority => self.priority(),
            Action::NextColors => self.next_colors(),
            Action::Help => self.model.overlay = Some(Overlay::Help { scroll: 0 }),
            Action::Palette => self.open_palette(),
            Action::Inventory => self.model.overlay = Some(Overlay::Inventory { scroll: 0 }),
        }
    }

    /// Whether an action itself deals with a value being typed.
    pub(super) fn ends_typing(&self, action: Action) -> bool {
        matches!(action, Action::Open | Action::Cancel)
    }

    /// Gives the focus to the picture and lets its keys act on something else.
    pub(super) fn enter_mode(&mut self, mode: Mode) {
        let movable = match mode {
            Mode::Move => self.check_movable(),
            Mode::Rotate => self.check_turnable(),
            _ => true,
        };
        if movable {
            self.end_mode();
            self.model.focus = Focus::Picture;
            self.model.mode = mode;
        }
    }

    /// Leads back: out of typing, an overlay, a mode, a panel.
    fn leave(&mut self) {
        if self.model.overlay.is_some() {
            self.close_overlay();
        } else if self.model.inspector.editor.is_some() {
            self.model.inspector.editor = None;
        } else if self.model.mode != Mode::Orbit {
            self.end_mode();
        } else if self.model.focus != Focus::Picture {
            self.model.focus = Focus::Picture;
        } else if self.model.only_picture {
            self.only_picture();
        } else if self.model.comparison.shown != CompareView::Live {
            self.model.comparison.shown = CompareView::Live;
            self.repaint();
        }
    }

    /// The picture's keys act on the camera again.
    pub(super) fn end_mode(&mut self) {
        self.end_gesture();
        if self.model.mode == Mode::Probe {
            self.set_probe(None);
        }
        self.model.mode = Mode::Orbit;
    }

    fn next_panel(&mut self, by: isize) {
        if self.model.overlay.is_some() {
            self.walk(by);
            return;
        }
        let panels = [Focus::Picture, Focus::Outline, Focus::Inspector];
        let at = panels.iter().position(|focus| *focus == self.model.focus).unwrap_or(0);
        let next = (at as isize + by).rem_euclid(panels.len() as isize) as usize;
        self.set_focus(panels[next]);
    }

    pub(super) fn set_focus(&mut self, focus: Focus) {
        if focus != Focus::Picture {
            self.end_mode();
            self.model.only_picture = false;
        }
        if focus != Focus::Inspector {
            self.model.inspector.editor = None;
        }
        self.model.focus = focus;
    }

    fn only_picture(&mut self) {
        self.model.only_picture = !self.model.only_picture;
        self.model.focus = Focus::Picture;
        self.model.inspector =
            Inspector { editor: None, ..std::mem::take(&mut self.model.inspector) };
    }
}
