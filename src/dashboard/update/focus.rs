//! Focus and modes.

use crate::dashboard::update::cycled;
use crate::dashboard::{DisplayChannel, Focus, Mode, UpdateContext};
use zerkalo_scene::edit::{self, Target};

impl UpdateContext<'_> {
    /// Enters `mode` and gives the focus to the picture, or reports why the selection cannot be
    /// moved or rotated.
    pub(super) fn enter_mode(&mut self, mode: Mode) {
        let scene = self.scene();
        let tried = |part: &Target| match mode {
            Mode::Move => edit::move_by(scene, part, [0.0; 3]).err(),
            Mode::Rotate => edit::rotate(scene, part, 0.0).err(),
            _ => None,
        };
        if let Some(error) = self.model.targets().iter().find_map(tried) {
            self.refuse(&error.to_string());
            return;
        }
        self.end_mode();
        self.model.focus = Focus::Picture;
        self.model.mode = mode;
    }

    /// Leaves the first of these states that is active: filter, overlay, text editor, mode,
    /// marks, selection of a part instead of its compound, focus on another panel, zoom, full screen,
    /// comparison.
    pub(super) fn leave(&mut self) {
        if self.end_filter() {
            return;
        }
        if self.model.overlay.is_some() {
            self.close_overlay();
        } else if self.model.inspector.editor.is_some() {
            self.model.inspector.editor = None;
        } else if self.model.mode != Mode::Orbit {
            self.end_mode();
        } else if !self.model.marked.is_empty() {
            self.model.marked.clear();
        } else if let Some(compound) = self.model.selection.compound() {
            self.select(compound);
        } else if self.model.focus != Focus::Picture {
            self.model.focus = Focus::Picture;
        } else if self.model.zoom.is_some() {
            self.zoom_fits();
        } else if self.model.fullscreen {
            self.toggle_fullscreen();
        } else if !DisplayChannel::LIVE.contains(&self.model.channel) {
            self.model.channel = DisplayChannel::Beauty;
            self.repaint();
        }
    }

    /// Returns to the default mode.
    pub(super) fn end_mode(&mut self) {
        self.end_gesture();
        if self.model.mode == Mode::Probe {
            self.set_probe(None);
        }
        if let Some(channel) = self.model.channel_before_probe.take() {
            self.model.channel = channel;
            self.repaint();
        }
        self.model.mode = Mode::Orbit;
    }

    pub(super) fn next_panel(&mut self, by: isize) {
        if self.model.overlay.is_some() || self.model.inspector.is_typing() {
            self.complete(by);
            return;
        }
        let panels = match self.model.watch {
            Some(_) => &[Focus::Picture, Focus::Outline][..],
            None => &[Focus::Picture, Focus::Outline, Focus::Inspector],
        };
        self.set_focus(*cycled(panels, |focus| *focus == self.model.focus, by));
    }

    pub(super) fn set_focus(&mut self, focus: Focus) {
        if focus != Focus::Picture {
            self.end_mode();
            self.model.fullscreen = false;
        }
        self.model.focus = focus;
        if focus != Focus::Inspector {
            self.model.inspector.stop_typing();
        } else {
            self.skip_text();
        }
    }

    pub(super) fn toggle_fullscreen(&mut self) {
        self.model.fullscreen = !self.model.fullscreen;
        self.model.focus = Focus::Picture;
        self.model.inspector.stop_typing();
    }
}
