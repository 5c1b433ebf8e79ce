//! Commands on rendering, exports and the colour depth of the terminal.

use crate::dashboard::model::{Colors, Tone};
use crate::dashboard::update::cycled;
use crate::dashboard::update::prompt::stop_text;
use crate::dashboard::{Effect, Format, ListCursor, Overlay, UpdateContext};
use std::sync::Arc;
use zerkalo_render::BOUNCE_SHARES;
use zerkalo_render::schedule::{Interval, Stop};
use zerkalo_render::session::{QUALITIES, State};
use zerkalo_scene::Scene;

/// Time for which the noise by bounce is measured.
const BOUNCE_SECONDS: f64 = 1.0;

impl UpdateContext<'_> {
    pub(super) fn pause(&mut self) {
        self.model.paused = !self.model.paused;
    }

    pub(super) fn restart(&mut self) {
        self.emit(Effect::Restart);
        self.say("restarted");
    }

    pub(super) fn set_stop(&mut self, stop: Stop) {
        self.model.stop = stop;
        self.emit(Effect::Stop(stop));
        let text = stop_text(&stop);
        let when = if text == "none" { "never".to_string() } else { format!("at {text}") };
        self.say(format!("stops {when}"));
    }

    /// Opens the list of noise targets with the cursor on the current target.
    pub(super) fn open_noise_targets(&mut self) {
        let wanted = self.model.stop.noise_levels.unwrap_or(0.5);
        let index = QUALITIES.iter().position(|levels| *levels <= wanted);
        let index = index.unwrap_or(QUALITIES.len() - 1);
        self.model.overlay = Some(Overlay::NoiseTargets(ListCursor { index, scroll: 0 }));
    }

    pub(super) fn measure_bounces(&mut self) {
        self.emit(Effect::MeasureBounces(BOUNCE_SECONDS));
        self.say("measuring the noise by bounce …");
    }

    pub(super) fn bounces(&mut self, shares: Option<[f64; BOUNCE_SHARES]>) {
        let Some(shares) = shares else { return self.say("There is no noise") };
        let names = ["seen directly", "1 bounce", "2 bounces", "more"];
        let texts = names.iter().zip(shares).filter(|(_, share)| *share >= 0.005);
        let texts: Vec<_> =
            texts.map(|(name, share)| format!("{name} {:.0} %", 100.0 * share)).collect();
        self.notify(Tone::Plain, format!("noise by bounce: {}", texts.join(" · ")), Some(15.0));
    }

    pub(super) fn export(&mut self, format: Format) {
        self.emit(Effect::Export(format));
        self.say(format!("writing {} …", format.extension()));
    }

    /// Returns `true` if the picture will be better in a moment: the render has not yet reached its
    /// target.
    pub(super) fn improves(&self) -> bool {
        let report = self.model.snapshot.as_ref().map(|snapshot| &snapshot.report);
        self.model.watch.is_none() && report.is_some_and(|r| matches!(r.state, State::Tracing))
    }

    /// Writes a PNG as soon as the render ends.
    pub(super) fn export_when_done(&mut self) {
        self.model.export_when_done = true;
        self.say("a PNG is written when the picture has converged");
        self.export_if_done();
    }

    pub(super) fn export_if_done(&mut self) {
        if self.model.export_when_done && self.model.snapshot.is_some() && !self.improves() {
            self.model.export_when_done = false;
            self.export(Format::Png);
        }
    }

    pub(super) fn checkpoint(&mut self) {
        let scene = Arc::clone(self.model.seen());
        self.emit(Effect::Checkpoint(scene));
        self.say("writing a checkpoint …");
    }

    /// Returns the time of a render of `scene`, which is this picture at another size, by the time of
    /// this one.
    pub(super) fn expected_seconds(&self, scene: &Scene) -> Option<Interval> {
        let report = &self.model.snapshot.as_ref()?.report;
        let (left, share) = match report.state {
            State::Finished(_) => (Interval::exact(0.0), 1.0),
            // Both renders share the processors until this one has ended.
            _ => (report.eta_seconds?, 2.0),
        };
        let pixels = |size: [u32; 2]| f64::from(size[0]) * f64::from(size[1]);
        let factor = share * pixels(scene.film.size) / pixels(self.scene().film.size);
        let [low, high] = [left.low, left.high].map(|left| factor * (report.seconds + left));
        Some(Interval { low, high })
    }

    /// Writes the picture of the running export as it is, or after its first pass.
    pub(super) fn finish_export(&mut self) {
        if let Some(export) = &mut self.model.export {
            (export.progress, export.left) = (1.0, None);
            self.emit(Effect::FinishExport);
            self.say("writing the picture as it is, after a whole pass");
        }
    }

    pub(super) fn cancel_export(&mut self) {
        match self.model.export.take() {
            Some(_) => {
                self.emit(Effect::CancelExport);
                self.say("the export is cancelled");
            }
            None => self.say("No export is running"),
        }
    }

    pub(super) fn next_colors(&mut self) {
        self.model.colors = *cycled(&Colors::ALL, |colors| *colors == self.model.colors, 1);
        self.repaint();
        self.say(self.model.colors.name());
    }
}
