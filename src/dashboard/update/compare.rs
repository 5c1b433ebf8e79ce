//! Commands on the display of the picture: exposure, tone curve, channel, pixel probe, comparison.

use crate::dashboard::update::{Direction, StepSize, cycled};
use crate::dashboard::{CompareView, DisplayChannel, Effect, Mode, UpdateContext};
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
            None => &DisplayChannel::ALL,
        };
        self.model.channel = *cycled(channels, current, by);
        self.repaint();
        self.say(format!("view: {}", self.model.channel.name()));
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

    /// Moves the pixel probe by about one terminal cell, or by one pixel of the film.
    pub(super) fn move_probe(&mut self, direction: Direction, step_size: StepSize) {
        let Some([x, y]) = self.model.probe else {
            self.toggle_probe();
            return;
        };
        let film = self.scene().film.size.map(|n| n as usize);
        let step = match (step_size, self.model.layout()) {
            (StepSize::Coarse, Some(layout)) => {
                [(film[0] / layout.raster[0]).max(1), (2 * film[1] / layout.raster[1]).max(1)]
            }
            _ => [1, 1],
        };
        let to = match direction {
            Direction::Left => [x.saturating_sub(step[0]), y],
            Direction::Right => [x + step[0], y],
            Direction::Up => [x, y.saturating_sub(step[1])],
            _ => [x, y + step[1]],
        };
        self.set_probe(Some(to));
    }

    pub(super) fn pinned(&mut self, picture: Arc<LinearImage>, spp: f64) {
        self.model.comparison.pinned = Some((picture, spp));
        self.repaint();
        self.say(format!("pinned at {spp:.0} spp · c flips · C shows the difference"));
    }

    /// Shows the pinned picture or its difference to the live one, or the live picture if `what` is
    /// shown already.
    pub(super) fn compare(&mut self, what: CompareView) {
        if self.model.comparison.pinned.is_none() {
            self.say("No picture is pinned yet · k pins one");
            return;
        }
        let shown = &mut self.model.comparison.shown;
        *shown = if *shown == what { CompareView::Live } else { what };
        self.repaint();
    }
}
