//! Commands on the display of the picture: exposure, tone curve, channel, pixel probe, comparison.

use crate::dashboard::update::{Direction, cycled};
use crate::dashboard::{DisplayChannel, Effect, Mode, UpdateContext};
use std::sync::Arc;
use zerkalo_render::film::{LinearImage, Tone};

/// Change of the exposure per step, in stops.
const EXPOSURE_STEP: f64 = 0.25;
/// Largest exposure in stops. Beyond it every picture is white or black.
const MOST_EXPOSURE: f64 = 20.0;

impl UpdateContext<'_> {
    pub(super) fn exposure(&mut self, steps: f64) {
        let ev = self.model.display.exposure_ev + steps * EXPOSURE_STEP;
        self.set_exposure(ev.clamp(-MOST_EXPOSURE, MOST_EXPOSURE));
    }

    pub(super) fn set_exposure(&mut self, ev: f64) {
        self.model.display.exposure_ev = ev;
        self.set_display();
        self.say(format!("exposure {ev:+.2} stops"));
    }

    pub(super) fn next_tone(&mut self) {
        let current = |(_, tone): &(_, Tone)| *tone == self.model.display.tone;
        let (name, tone) = *cycled(&Tone::NAMED, current, 1);
        self.model.display.tone = tone;
        self.set_display();
        self.say(format!("tone curve: {name}"));
    }

    fn set_display(&mut self) {
        self.emit(Effect::Display(self.model.display));
        self.repaint();
    }

    pub(super) fn next_channel(&mut self, by: isize) {
        let current = |channel: &DisplayChannel| *channel == self.model.channel;
        let channels = match self.model.watch {
            Some(_) => &DisplayChannel::OF_FILM[..],
            None => &DisplayChannel::LIVE,
        };
        self.model.channel = *cycled(channels, current, by);
        self.repaint();
        self.say(format!("view: {}", self.model.channel.name()));
    }

    pub(super) fn toggle_marks(&mut self) {
        self.model.marks_off = !self.model.marks_off;
        self.say(if self.model.marks_off { "marks off" } else { "marks on" });
    }

    pub(super) fn toggle_probe(&mut self) {
        if self.model.mode == Mode::Probe {
            self.end_mode();
            return;
        }
        self.enter_mode(Mode::Probe);
        let [width, height] = self.scene().film.size.map(|n| n as usize);
        self.set_probe(Some([width / 2, height / 2]));
    }

    pub(super) fn set_probe(&mut self, pixel: Option<[usize; 2]>) {
        let [width, height] = self.scene().film.size.map(|n| n as usize);
        let pixel = pixel.map(|[x, y]| [x.min(width - 1), y.min(height - 1)]);
        self.model.probe = pixel;
        self.show_view();
    }

    /// Moves the pixel probe by about one terminal cell.
    pub(super) fn move_probe(&mut self, direction: Direction) {
        let [width, height] = self.scene().film.size.map(|n| n as usize);
        let raster = self.model.layout().map(|layout| layout.raster);
        self.shift_probe(direction, raster.map_or([1; 2], |[x, y]| [width / x, 2 * height / y]));
    }

    pub(super) fn move_probe_by_pixel(&mut self, direction: Direction) {
        self.shift_probe(direction, [1; 2]);
    }

    /// Moves the pixel probe by `step` pixels, at least by 1. If there is no probe yet, places one.
    fn shift_probe(&mut self, [right, up, _]: Direction, step: [usize; 2]) {
        let Some([x, y]) = self.model.probe else {
            self.toggle_probe();
            return;
        };
        let [across, along] = step.map(|pixels| pixels.max(1) as isize);
        let x = x.saturating_add_signed(right as isize * across);
        self.set_probe(Some([x, y.saturating_add_signed(-(up as isize) * along)]));
    }

    pub(super) fn pinned(&mut self, picture: Arc<LinearImage>, spp: f64) {
        self.model.pinned = Some((picture, spp));
        self.repaint();
        self.say(format!("pinned at {spp:.0} spp · c flips · C shows the difference"));
    }

    /// Shows `channel`, the pinned picture or its difference from the live one. If it is shown
    /// already, shows the live picture.
    pub(super) fn compare(&mut self, channel: DisplayChannel) {
        if self.model.pinned.is_none() {
            self.say("No picture is pinned yet · k pins one");
            return;
        }
        let is_shown = self.model.channel == channel;
        self.model.channel = if is_shown { DisplayChannel::Beauty } else { channel };
        self.repaint();
    }
}
