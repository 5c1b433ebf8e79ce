//! Looking at a picture that was written.

use crate::dashboard::message::Effect;
use crate::dashboard::model::short_name;
use crate::dashboard::overlay::{Overlay, ViewedImage};
use crate::dashboard::update::UpdateContext;
use crate::terminal::image::ViewerImage;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl UpdateContext<'_> {
    /// Shows the last picture that was written.
    pub(super) fn view_last_export(&mut self) {
        match self.model.last_export.clone() {
            Some(path) => self.view_image(path),
            None => self.say("No picture was written yet · p writes one"),
        }
    }

    fn view_image(&mut self, path: PathBuf) {
        let (display, screen) = (self.model.display, self.model.screen);
        self.emit(Effect::ViewImage { path: path.clone(), display, screen });
        self.model.drag = None;
        self.model.overlay =
            Some(Overlay::ViewerImage(ViewedImage { path, still: None, sent: 0.0 }));
        self.repaint();
    }

    /// On a screen of another size.
    pub(super) fn refit_image(&mut self) {
        if let Some(Overlay::ViewerImage(looked)) = &self.model.overlay {
            self.view_image(looked.path.clone());
        }
    }

    /// Back to the panels.
    pub(super) fn close_viewer(&mut self) {
        self.model.overlay = None;
        self.repaint();
    }

    /// A picture is ready, or cannot be read.
    pub(super) fn still(&mut self, path: &Path, result: Result<Arc<ViewerImage>, String>) {
        let screen = self.model.screen;
        let Some(Overlay::ViewerImage(looked)) = &mut self.model.overlay else { return };
        if looked.path != path {
            return;
        }
        match result {
            Ok(still) if still.screen == screen => {
                looked.still = Some(still);
                self.repaint();
            }
            // It was made before the screen changed.
            Ok(_) => {}
            Err(why) => {
                let name = short_name(path);
                self.close_viewer();
                self.refuse(&format!("{name} cannot be shown: {why}"));
            }
        }
    }
}
