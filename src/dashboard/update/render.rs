//! Commands on rendering, exports and the colour depth of the terminal.

use crate::dashboard::model::Colors;
use crate::dashboard::text::durations;
use crate::dashboard::update::cycled;
use crate::dashboard::update::prompt::stop_text;
use crate::dashboard::{Answer, Effect, Format, ListCursor, Overlay, UpdateContext};
use std::sync::Arc;
use zerkalo_render::schedule::Stop;
use zerkalo_render::session::{QUALITIES, Report, State};

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

    /// Writes the picture. If its render has just begun, asks if the end is awaited.
    pub(super) fn export(&mut self, format: Format) {
        let report = self.model.snapshot.as_ref().map(|snapshot| &snapshot.report);
        let has_begun = |report: &&Report| {
            matches!(report.state, State::Tracing)
                && report.eta_seconds.is_some_and(|left| left.high > 2.0)
        };
        let Some(report) = report.filter(has_begun).filter(|_| self.model.watch.is_none()) else {
            return self.export_now(format);
        };
        let left = report.eta_seconds.map_or(String::new(), durations);
        let text = format!("The picture needs {left} more for its noise target.");
        let [now, done]: [Answer; 2] = match format {
            Format::Png => [
                ('n', "write the PNG now", |c| c.export_now(Format::Png)),
                ('w', "write it when converged", |c| c.export_when_done(Format::Png)),
            ],
            Format::Exr => [
                ('n', "write the EXR now", |c| c.export_now(Format::Exr)),
                ('w', "write it when converged", |c| c.export_when_done(Format::Exr)),
            ],
        };
        self.ask(text, &[now, done]);
    }

    fn export_now(&mut self, format: Format) {
        self.emit(Effect::Export(format));
        self.say(format!("writing {} …", format.extension()));
    }

    fn export_when_done(&mut self, format: Format) {
        self.model.export_when_done = Some(format);
        self.say(format!("{} when converged", format.extension()));
    }

    /// Writes the picture that [`Self::export_when_done`] awaits, if it is complete.
    pub(super) fn export_if_done(&mut self) {
        let state = self.model.snapshot.as_ref().map(|snapshot| &snapshot.report.state);
        if let Some(State::Finished(_)) = state
            && let Some(format) = self.model.export_when_done.take()
        {
            self.export_now(format);
        }
    }

    pub(super) fn checkpoint(&mut self) {
        let scene = Arc::clone(self.model.seen());
        self.emit(Effect::Checkpoint(scene));
        self.say("writing a checkpoint …");
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
