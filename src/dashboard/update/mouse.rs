//! Mouse: clicks select or focus, drags orbit or move, the wheel dollies or scrolls.

use crate::dashboard::marks::LightMark;
use crate::dashboard::panel_lines::MATERIAL;
use crate::dashboard::{Drag, FieldList, Focus, Layout, Mode, OutlineLine, Overlay, UpdateContext};
use glam::DVec3;
use ratatui::layout::Rect;
use zerkalo_kernel::primitive::BoundingSphere;
use zerkalo_scene::Scene;
use zerkalo_scene::edit::{SceneSettings, Target, Widget, bounds, solid_at};
use zerkalo_terminal::event::{Button, Mouse, MouseKind};

/// Number of lines that a list scrolls per tick of the wheel.
const WHEEL_LINES: i32 = 3;

/// Returns `true` if the mouse is in `area`, and `false` for `None`, the area of a hidden panel.
fn is_in(mouse: Mouse, area: impl Into<Option<Rect>>) -> bool {
    area.into().is_some_and(|area| area.contains((mouse.column, mouse.row).into()))
}

/// Returns the index of the line under the mouse in the list at `rows`, whose first visible line
/// has the index `scroll`. Returns `None` outside `rows`.
fn line_at(rows: Rect, scroll: usize, mouse: Mouse) -> Option<usize> {
    is_in(mouse, rows).then(|| usize::from(mouse.row - rows.y) + scroll)
}

impl UpdateContext<'_> {
    pub(super) fn mouse(&mut self, mouse: Mouse) {
        self.follow = true;
        self.model.first_time = false;
        match mouse.kind {
            MouseKind::Press(button) => self.press(button, mouse),
            MouseKind::Drag(_) => self.dragged(mouse),
            MouseKind::Release(_) => self.released(mouse),
            MouseKind::Scroll(ticks) => self.scrolled(ticks, mouse),
        }
    }

    /// Gives the focus to the panel under the mouse. Begins a drag in the picture, or selects or
    /// opens the line under the mouse in a list.
    fn press(&mut self, button: Button, mouse: Mouse) {
        self.model.drag = None;
        if self.model.file.unreadable {
            return;
        }
        if self.model.overlay.is_some() {
            if button == Button::Left {
                self.press_in_overlay(mouse);
            }
            return;
        }
        if self.model.inspector.editor.is_some() && !self.apply_field() {
            return;
        }
        let Some(layout) = self.model.layout() else { return };
        let border = layout.border_at(mouse.column, mouse.row);
        if border.is_some() {
            self.model.drag = Some(Drag { border, ..Drag::new(button, mouse) });
        } else if is_in(mouse, layout.picture) {
            self.model.focus = Focus::Picture;
            if !self.moves_or_rotates() {
                self.end_gesture();
            }
            // Watched films have no camera to orbit and no objects to select.
            let is_inert = self.model.watch.is_some() && self.model.mode != Mode::Probe;
            let in_picture = is_in(mouse, layout.image) && !is_inert;
            let grabs = button == Button::Left && !mouse.modified && self.model.mode == Mode::Orbit;
            let moves = grabs && in_picture && self.grab(&layout, mouse);
            self.model.drag = Some(Drag { in_picture, moves, ..Drag::new(button, mouse) });
        } else if let Some((rows, _)) = self.model.inspector_rows()
            && is_in(mouse, layout.inspector)
        {
            let focused = self.model.focus == Focus::Inspector;
            self.set_focus(Focus::Inspector);
            self.press_in_fields(rows, focused, mouse);
        } else if is_in(mouse, layout.outline) && self.model.watch.is_some() {
            self.model.focus = Focus::Outline;
            self.press_in_list(mouse);
        } else if let Some(rows) = self.model.outline_rows()
            && is_in(mouse, layout.outline)
        {
            self.press_in_outline(rows, mouse);
        }
    }

    /// Selects the light whose mark is under the mouse. Returns `true` if a drag from here moves the
    /// selection: from its mark, or from the selected object unless that fills the view.
    fn grab(&mut self, layout: &Layout, mouse: Mouse) -> bool {
        let at = [mouse.column, mouse.row];
        let under = |mark: &LightMark| mark.cell == at || mark.arrow.is_some_and(|(_, c)| c == at);
        if let Some(mark) = self.model.light_marks(layout).into_iter().find(under) {
            self.select(Target::Light(mark.light));
            return true;
        }
        let eye = DVec3::from_array(self.seen().camera.eye);
        let fills = |ball: BoundingSphere| ball.center.distance(eye) <= 2.0 * ball.radius;
        let hit = self.pixel_at(mouse).and_then(|pixel| first_hit(self.seen(), pixel));
        hit.is_some_and(|hit| self.is_on_selection(hit))
            && !bounds(self.scene(), &self.model.selection).is_none_or(fills)
    }

    /// Returns `true` if the first hit of a ray is on the selected object or part.
    fn is_on_selection(&self, ObjectHit { object, point }: ObjectHit) -> bool {
        let eye = DVec3::from_array(self.seen().camera.eye);
        let selection = &self.model.selection;
        match selection {
            Target::Object(selected) => *selected == object,
            Target::Part(selected, _) if *selected == object => {
                let solid = solid_at(self.seen(), object, eye, point);
                solid.is_some_and(|solid| selection.solids(self.seen()).contains(&solid))
            }
            _ => false,
        }
    }

    /// Returns what a click on an object selects: the object or, if it is selected already, the part
    /// at `point`.
    fn clicked(&self, ObjectHit { object, point }: ObjectHit) -> Target {
        let eye = DVec3::from_array(self.seen().camera.eye);
        let solid = match self.model.selection {
            Target::Object(i) | Target::Part(i, _) if i == object => {
                solid_at(self.seen(), object, eye, point)
            }
            _ => None,
        };
        let new = solid.filter(|solid| *solid != self.model.selection);
        new.unwrap_or(Target::Object(object))
    }

    /// Selects the part of the scene on the clicked line. If the outline has the focus and the part
    /// is selected already, opens the inspector.
    fn press_in_outline(&mut self, rows: Rect, mouse: Mouse) {
        // The line is looked up first, because a change of focus may change the layout.
        let lines = self.model.outline_lines();
        let line = line_at(rows, self.model.outline_scroll, mouse).and_then(|i| lines.get(i));
        let target = line.and_then(OutlineLine::entry).map(|entry| entry.target.clone());
        let again =
            self.model.focus == Focus::Outline && target.as_ref() == Some(&self.model.selection);
        self.set_focus(Focus::Outline);
        match target {
            Some(target) if mouse.modified => {
                // The selection joins the marked parts.
                if self.model.marked.is_empty() && target != self.model.selection {
                    self.toggle_mark();
                }
                self.select(target);
                self.toggle_mark();
            }
            Some(target) => {
                self.select(target);
                match line.and_then(OutlineLine::entry).and_then(|entry| entry.unfolded) {
                    Some(true) if again => self.fold(),
                    Some(false) => self.unfold(),
                    _ if again => self.set_focus(Focus::Inspector),
                    _ => {}
                }
            }
            None => {}
        }
    }

    /// Opens the clicked property if the cursor is on it already and the list had the focus
    /// (`focused`), otherwise moves the cursor there.
    fn press_in_fields(&mut self, rows: Rect, focused: bool, mouse: Mouse) {
        let FieldList { cursor, scroll, editor, .. } = self.model.field_list();
        let (cursor, line) = (*cursor, line_at(rows, *scroll, mouse));
        let opens = focused && editor.is_none();
        let lines = self.model.field_lines();
        let pressed = line.and_then(|line| lines.get(line)?.entry());
        let on_number = pressed
            .is_some_and(|field| matches!(field.property.widget, Widget::Numbers | Widget::Color));
        self.model.drag = on_number.then(|| Drag { on_number, ..Drag::new(Button::Left, mouse) });
        if line.and_then(|line| lines.get(line)).is_some_and(|line| line.entry().is_none()) {
            if self.apply_field() {
                self.model.folded.insert(MATERIAL.to_string());
            }
            return;
        }
        match line.filter(|line| *line < lines.len()) {
            Some(line) if opens && line == cursor => self.open_row(),
            Some(line) if self.apply_field() => {
                self.model.field_list_mut().cursor = line;
                self.end_filter();
            }
            _ => {}
        }
    }

    fn press_in_overlay(&mut self, mouse: Mouse) {
        match (&self.model.overlay, self.model.list_rows()) {
            (Some(Overlay::Form(_)), Some(rows)) => self.press_in_fields(rows, true, mouse),
            (Some(Overlay::ViewerImage(_)), _) => self.close_viewer(),
            _ => self.press_in_list(mouse),
        }
    }

    /// Opens the clicked line of the list in the open overlay, or of the table of watched files, if
    /// the cursor is on it already. Otherwise moves the cursor there.
    fn press_in_list(&mut self, mouse: Mouse) {
        let rows = self.model.list_rows().unwrap_or_default();
        let Some((&mut at, len)) = self.model.list() else { return };
        if let Some(line) = line_at(rows, at.scroll, mouse).filter(|line| *line < len) {
            match line == at.index {
                true => self.open(),
                false => self.move_cursor(line as isize - at.index as isize),
            }
        }
    }

    /// Moves the camera, the selection or the probe, depending on the mode, as the mouse has moved.
    fn dragged(&mut self, mouse: Mouse) {
        let Some(drag) = &mut self.model.drag else { return };
        let [column, row] = drag.last;
        let right = f64::from(mouse.column) - f64::from(column);
        let down = 2.0 * (f64::from(mouse.row) - f64::from(row));
        // A click on a number that slips by a column changes nothing.
        let slips = drag.on_number && !drag.moved && right.abs() < 2.0;
        if slips || (right, down) == (0.0, 0.0) {
            return;
        }
        drag.last = [mouse.column, mouse.row];
        drag.moved = true;
        let drag = *drag;
        if let Some(border) = drag.border {
            return self.model.move_border(border, [mouse.column, mouse.row]);
        }
        if drag.on_number {
            // Each column is a fine step. Ten of them would be a coarse one.
            self.model.field_list_mut().editor = None;
            return self.step_field(0.1 * right.clamp(-9.0, 9.0));
        }
        if !drag.in_picture || self.model.overlay.is_some() {
            return;
        }
        let other = drag.button != Button::Left || drag.modified;
        match (self.model.mode, other) {
            _ if drag.moves => self.move_by_hand(right, down, false),
            (Mode::Probe, _) => self.probe_at(mouse),
            (Mode::Move, upright) => self.move_by_hand(right, down, upright),
            (Mode::Rotate, false) => self.rotate_selection(right * 2.0),
            (Mode::Fly, false) => self.look_by_hand(right, down),
            (Mode::Orbit, false) if self.wipe_to(mouse.column) => {}
            (Mode::Orbit, _) if self.drag_zoomed(right, down) => {}
            (Mode::Orbit, false) => self.orbit_by_hand(right, down),
            (_, true) => self.pan_by_hand(right, down),
        }
    }

    fn released(&mut self, mouse: Mouse) {
        let Some(drag) = self.model.drag.take() else { return };
        if drag.moved {
            if !self.moves_or_rotates() {
                self.end_gesture();
            }
        } else if self.model.overlay.is_none() && drag.in_picture {
            self.click(drag, mouse);
        }
    }

    /// Returns `true` if the mode moves or rotates the selection. All edits with the same label in
    /// such a mode form one undo step.
    pub(super) fn moves_or_rotates(&self) -> bool {
        matches!(self.model.mode, Mode::Move | Mode::Rotate)
    }

    /// Probes, focuses the lens on, or selects what is visible under the mouse.
    fn click(&mut self, drag: Drag, mouse: Mouse) {
        if drag.moves && matches!(self.model.selection, Target::Light(_)) {
            let label = self.model.selection.label(self.scene());
            return self.say(format!("{label} · drag moves it · L on, off"));
        }
        if self.model.mode == Mode::Probe && drag.button == Button::Left && !drag.modified {
            self.probe_at(mouse);
            return;
        }
        if let Some(pixel) = self.pixel_at(mouse) {
            if drag.button != Button::Left || drag.modified {
                return self.focus_on_pixel(pixel);
            }
            let hit = first_hit(self.seen(), pixel);
            let background = Target::Settings(SceneSettings::Background);
            let seen = hit.map_or(background, |hit| self.clicked(hit));
            if seen != self.model.selection {
                self.end_mode();
            }
            self.select(seen);
            let label = self.model.selection.label(self.scene());
            self.say(label);
        }
    }

    /// Moves the border of a wipe to a column of the screen. Returns `false` if there is none.
    fn wipe_to(&mut self, column: u16) -> bool {
        let Some(image) = self.model.layout().map(|layout| layout.image) else { return false };
        let cells = f64::from(column) + 0.5 - f64::from(image.x);
        self.wipe(|_| cells / f64::from(image.width.max(1)))
    }

    /// Returns the pixel of the film (column, row) under the mouse.
    fn pixel_at(&self, mouse: Mouse) -> Option<[usize; 2]> {
        self.model.layout()?.film_pixel(mouse.column, mouse.row)
    }

    fn probe_at(&mut self, mouse: Mouse) {
        if let Some(pixel) = self.pixel_at(mouse) {
            self.set_probe(Some(pixel));
        }
    }

    /// Scrolls the list under the mouse, steps the field there, or dollies the camera.
    fn scrolled(&mut self, ticks: i32, mouse: Mouse) {
        let ticks = ticks.clamp(-100, 100);
        let lines = -(ticks * WHEEL_LINES) as isize;
        if self.model.overlay.is_some() {
            let rows = self.model.list_rows().unwrap_or_default();
            let FieldList { cursor, scroll, editor, .. } = self.model.field_list();
            let chosen = line_at(rows, *scroll, mouse) == Some(*cursor) && editor.is_none();
            if chosen && self.in_form() {
                return self.step_field(f64::from(ticks));
            }
            self.move_cursor(-ticks as isize);
            return;
        }
        let Some(layout) = self.model.layout().filter(|_| !self.model.file.unreadable) else {
            return;
        };
        if self.zoom_by_wheel(ticks, mouse) {
            return;
        }
        let scroll = if is_in(mouse, layout.inspector) {
            let rows = self.model.inspector_rows().map(|(rows, _)| rows).unwrap_or_default();
            let FieldList { cursor, scroll, editor, .. } = &mut self.model.inspector;
            let is_chosen = line_at(rows, *scroll, mouse) == Some(*cursor) && editor.is_none();
            if self.model.focus == Focus::Inspector && is_chosen {
                return self.step_field(f64::from(ticks));
            }
            scroll
        } else if is_in(mouse, layout.outline) {
            if self.model.watch.is_some() {
                return self.move_cursor(lines);
            }
            &mut self.model.outline_scroll
        } else if is_in(mouse, layout.picture) && self.model.watch.is_none() {
            return self.dolly(f64::from(ticks));
        } else {
            return;
        };
        *scroll = scroll.saturating_add_signed(lines);
        self.follow = false;
    }
}

/// Index of an object, and a point on its surface.
#[derive(Clone, Copy)]
pub(super) struct ObjectHit {
    object: usize,
    pub point: DVec3,
}

/// Returns the first hit on the ray through the centres of the lens and of a film pixel (column,
/// row).
pub(super) fn first_hit(scene: &Scene, [x, y]: [usize; 2]) -> Option<ObjectHit> {
    let camera = &scene.camera;
    let [width, height] = scene.film.size.map(f64::from);
    let at = [(x as f64 + 0.5) / width, (y as f64 + 0.5) / height];
    let direction = camera.direction_at(at, [width, height]);
    let origin = DVec3::from_array(camera.eye) + direction * camera.near;
    let objects = scene.objects.iter().enumerate();
    let hits = objects.filter_map(|(i, object)| Some((i, object.form().cast(origin, direction)?)));
    let (object, t) = hits.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(ObjectHit { object, point: origin + direction * t })
}
