//! Commands on the display of the picture: exposure, tone curve, channel, pixel probe, comparison.

use crate::dashboard::update::{Coalesce, Direction, cycled};
use crate::dashboard::{DisplayChannel, Effect, Mode, UpdateContext};
use std::sync::Arc;
use zerkalo_render::film::LinearImage;
use zerkalo_scene::Tone;
use zerkalo_scene::edit::{self, SceneSettings, Target};
use zerkalo_terminal::cells::linear;

/// Change of the exposure per step, in stops.
const EXPOSURE_STEP: f64 = 0.25;
/// Level of the median pixel after [`UpdateContext::expose`].
const MIDDLE_LEVEL: u8 = 90;
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

    /// Sets the exposure that gives half of the picture's pixels more than [`MIDDLE_LEVEL`].
    pub(super) fn expose(&mut self) {
        let picture = self.model.snapshot.as_ref().and_then(|snapshot| {
            let newest = snapshot.weights_for(self.seen());
            let picture = snapshot.picture.as_ref()?;
            Some(picture.mixed(newest.as_ref().unwrap_or(&snapshot.weights)))
        });
        let luminance =
            |[red, green, blue]: &[f32; 3]| 0.2126 * red + 0.7152 * green + 0.0722 * blue;
        let mut luminances: Vec<f32> = picture.iter().flatten().map(luminance).collect();
        luminances.sort_unstable_by(f32::total_cmp);
        match luminances.get(luminances.len() / 2) {
            Some(median) if *median > 1e-6 => {
                let middle = linear([MIDDLE_LEVEL; 3])[0];
                let steps = f64::from(middle / median).log2() / EXPOSURE_STEP;
                self.set_exposure(
                    (steps.round() * EXPOSURE_STEP).clamp(-MOST_EXPOSURE, MOST_EXPOSURE),
                );
            }
            _ => self.say("Half of the picture is black · A adds a light"),
        }
    }

    pub(super) fn next_tone(&mut self) {
        let tone = *cycled(&Tone::ALL, |tone| *tone == self.model.display.tone, 1);
        if self.model.watch.is_some() {
            self.model.display.tone = tone;
            self.set_display();
        } else {
            let film = Target::Settings(SceneSettings::Film);
            self.commit(edit::set(self.scene(), &film, "tone", tone.name()), Coalesce::Repeat);
        }
        self.say(format!("tone curve: {}", tone.name()));
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
        self.follow_probe();
    }

    /// Moves the pixel probe by about one terminal cell.
    pub(super) fn move_probe(&mut self, direction: Direction) {
        let step = self.model.layout().map_or([1; 2], |layout| {
            let ([width, height], [x, y]) = (layout.window.size, layout.raster);
            [width / x, 2 * height / y]
        });
        self.shift_probe(direction, step);
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
