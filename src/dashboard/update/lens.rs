//! Commands on focus and aperture of the camera.

use crate::dashboard::UpdateContext;
use crate::dashboard::update::Coalesce;
use crate::dashboard::update::mouse::first_hit;
use zerkalo_scene::camera::{Aperture, Camera};
use zerkalo_scene::edit::{self, bounds};
use zerkalo_scene::value::{number, round_significant};

impl UpdateContext<'_> {
    /// Opens the aperture by `stops` stops; a negative number closes it.
    pub(super) fn aperture(&mut self, stops: f64) {
        let edit = edit::change_aperture(self.scene(), stops);
        self.commit(edit, Coalesce::Repeat);
        self.say_lens();
    }

    /// Focuses on the pixel probe, else on the middle of the selection, else on the centre of the
    /// picture.
    pub(super) fn focus(&mut self) {
        let [width, height] = self.scene().film.size.map(|n| n as usize);
        let selection = bounds(self.scene(), &self.model.selection);
        match (self.model.probe, selection) {
            (Some(pixel), _) => self.focus_on_pixel(pixel),
            (None, Some(ball)) => self.focus_on(ball.center),
            (None, None) => self.focus_on_pixel([width / 2, height / 2]),
        }
    }

    /// Focuses on the object that is visible at the centre of film pixel `pixel`.
    pub(super) fn focus_on_pixel(&mut self, pixel: [usize; 2]) {
        match first_hit(self.scene(), pixel) {
            Some((_, point)) => self.focus_on(point.to_array()),
            None => self.refuse("There is no object to focus on here."),
        }
    }

    fn focus_on(&mut self, point: [f64; 3]) {
        let edit = edit::focus_on(self.scene(), point);
        let is_ok = edit.is_ok();
        self.commit(edit, Coalesce::Single);
        if is_ok {
            self.say_lens();
        }
    }

    fn say_lens(&mut self) {
        let text = lens_text(&self.scene().camera);
        self.say(text);
    }
}

/// Describes aperture and focus for a notice.
fn lens_text(camera: &Camera) -> String {
    let distance = number(round_significant(camera.focus_depth(), 4));
    match camera.aperture {
        Some(Aperture::FNumber(f)) => {
            format!("focus at {distance} · f/{} · / * close, open · right click focuses", number(f))
        }
        Some(Aperture::Radius(radius)) if radius > 0.0 => format!(
            "focus at {distance} · aperture {} · / * close, open · right click focuses",
            number(radius)
        ),
        _ => format!("focus at {distance} · pinhole, all in focus · * opens the aperture"),
    }
}
