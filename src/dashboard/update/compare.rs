//! Commands on the display of the picture: exposure, tone curve, channel, pixel probe, history and comparison.

use crate::dashboard::pictures::KeptPicture;
use crate::dashboard::update::{Coalesce, Direction, cycled};
use crate::dashboard::{DisplayChannel, Effect, Focus, Mode, PickEntry, UpdateContext};
use std::time::Duration;
use zerkalo_render::session::State;
use zerkalo_scene::Tone;
use zerkalo_scene::edit::{self, SceneSettings, Target};
use zerkalo_terminal::cells::linear;

/// Change of the exposure per step, in stops.
const EXPOSURE_STEP: f64 = 0.25;
/// Level of the median pixel after [`UpdateContext::expose`].
const MIDDLE_LEVEL: u8 = 90;
/// Largest exposure in stops. Beyond it every picture is white or black.
const MOST_EXPOSURE: f64 = 20.0;
/// Time after which a picture is not a step on the way to another one.
const KEPT_AFTER: Duration = Duration::from_secs(2);
/// Mean number of samples per pixel of a picture that is kept before it has converged.
const KEPT_SPP: f64 = 32.0;
/// Largest number of pixels of pictures that are kept unasked, a little more than 1920 x 1080.
const MOST_PIXELS: u64 = 1 << 21;
/// Label of a picture before the first undo step.
const OPENED: &str = "as opened";
const NONE_KEPT: &str = "There is no earlier picture yet · k pins this one";

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
        self.model.channel_before_probe = Some(self.model.channel);
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

    pub(super) fn pin(&mut self) {
        let step = self.step();
        self.emit(Effect::Pin { step, is_pinned: true });
    }

    /// Returns the label of the last undo step.
    fn step(&self) -> String {
        let (done, _) = self.model.history.labels();
        let view = if self.model.free_view.is_some() { ", other view" } else { "" };
        format!("{}{view}", done.last().unwrap_or(&OPENED))
    }

    /// Returns `true` if the live picture belongs into the history: it was not made on the way to
    /// another one, and its film is not too large for copies.
    fn is_worth_keeping(&self) -> bool {
        let pixels = self.scene().film.size.map(u64::from).iter().product::<u64>();
        let is_old = self.now >= self.model.pictures.since + KEPT_AFTER;
        is_old && pixels <= MOST_PIXELS && self.model.watch.is_none()
    }

    /// Keeps the picture when it has converged.
    pub(super) fn keep_converged(&mut self) {
        let Some(report) = self.model.snapshot.as_ref().map(|snapshot| &snapshot.report) else {
            return;
        };
        let (generation, is_done) = (report.generation, matches!(report.state, State::Finished(_)));
        if is_done && self.model.pictures.converged != generation && self.is_worth_keeping() {
            self.model.pictures.converged = generation;
            let step = self.step();
            self.emit(Effect::Pin { step, is_pinned: false });
        }
    }

    /// Keeps the picture that a change of the scene or the view is about to replace, if it has enough
    /// samples.
    pub(super) fn keep_replaced(&mut self) {
        let report = self.model.snapshot.as_ref().map(|snapshot| &snapshot.report);
        let is_good = report.is_some_and(|report| {
            report.spp.mean >= KEPT_SPP && report.generation != self.model.pictures.converged
        });
        let step = self.step();
        let step = self.model.pictures.step.replace(step);
        if is_good && self.is_worth_keeping() {
            let step = step.unwrap_or_else(|| OPENED.to_string());
            self.emit(Effect::Pin { step, is_pinned: false });
        }
        self.model.pictures.since = self.now;
    }

    pub(super) fn pinned(&mut self, picture: KeptPicture) {
        let text = picture.is_pinned.then(|| picture.description());
        self.model.pictures.add(picture);
        if self.model.channel.compares() {
            self.repaint();
        }
        if let Some(text) = text {
            self.say(format!("pinned: {text} · c flips · C compares · j lists"));
        }
    }

    /// Lists the kept pictures. The chosen one is compared with the live one.
    pub(super) fn list_pictures(&mut self) {
        let pictures = &self.model.pictures;
        let entry = |(i, picture): (usize, &KeptPicture)| {
            let note = if picture.is_pinned { "pinned" } else { "" };
            PickEntry::new(format!("{} {}", i + 1, picture.description()), note)
        };
        let entries: Vec<_> = pictures.kept.iter().enumerate().map(entry).collect();
        if entries.is_empty() {
            return self.say(NONE_KEPT);
        }
        let index = pictures.chosen.unwrap_or(0);
        self.open_pick("compare with an earlier picture", entries, index, |c, name| {
            let number = name.split(' ').next().and_then(|n| n.parse::<usize>().ok());
            c.model.pictures.chosen = number.map(|n| n - 1);
            if !c.model.channel.compares() {
                c.model.channel = DisplayChannel::Pinned;
            }
            c.repaint();
        });
    }

    /// Shows the next comparison: difference, side by side, wipe, none.
    pub(super) fn next_comparison(&mut self) {
        if self.model.compared().is_none() {
            return self.say(NONE_KEPT);
        }
        let current = |channel: &DisplayChannel| *channel == self.model.channel;
        self.model.channel = *cycled(&DisplayChannel::COMPARISONS, current, 1);
        self.repaint();
        if self.model.channel == DisplayChannel::Wipe {
            // The arrow keys are those of the border.
            self.model.focus = Focus::Picture;
        }
        self.say(match self.model.channel {
            DisplayChannel::Wipe => "pinned | live: Left, Right or a drag moves the border",
            channel => channel.name(),
        });
    }

    /// Moves the border of a wipe to a fraction of the picture's width. Returns `false` if there is
    /// none.
    pub(super) fn wipe(&mut self, to: impl FnOnce(f64) -> f64) -> bool {
        let is_wipe = self.model.channel == DisplayChannel::Wipe;
        if is_wipe {
            self.model.pictures.border =
                (to(self.model.pictures.border + 0.5) - 0.5).clamp(-0.5, 0.5);
            self.repaint();
        }
        is_wipe
    }

    pub(super) fn toggle_histogram(&mut self) {
        self.model.histogram = !self.model.histogram;
        self.repaint();
        self.say(if self.model.histogram { "histogram of the luminance" } else { "convergence" });
    }

    /// Shows `channel`, or the live picture if it is shown already.
    pub(super) fn compare(&mut self, channel: DisplayChannel) {
        if self.model.compared().is_none() {
            return self.say(NONE_KEPT);
        }
        let is_shown = self.model.channel == channel;
        self.model.channel = if is_shown { DisplayChannel::Beauty } else { channel };
        self.repaint();
    }
}
