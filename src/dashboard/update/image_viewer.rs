//! Commands and messages of the viewer of exported images.

use crate::dashboard::message::Effect;
use crate::dashboard::model::short_name;
use crate::dashboard::overlay::{Overlay, ViewedImage};
use crate::dashboard::update::UpdateContext;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_terminal::image::ViewerImage;

impl UpdateContext<'_> {
    /// Shows the last exported image.
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
            Some(Overlay::ViewerImage(ViewedImage { path, image: None, sent: 0.0 }));
        self.repaint();
    }

    /// Requests that the viewed image be read again and encoded for the new screen size.
    pub(super) fn refit_image(&mut self) {
        if let Some(Overlay::ViewerImage(viewed)) = &self.model.overlay {
            self.view_image(viewed.path.clone());
        }
    }

    /// Closes the viewer of exported images and shows the panels again.
    pub(super) fn close_viewer(&mut self) {
        self.model.overlay = None;
        self.repaint();
    }

    /// Shows an image that was read and encoded for the viewer, or reports why it cannot be shown.
    /// Ignores an image of another path or for another screen size.
    pub(super) fn image_ready(&mut self, path: &Path, result: Result<Arc<ViewerImage>, String>) {
        let screen = self.model.screen;
        let Some(Overlay::ViewerImage(viewed)) = &mut self.model.overlay else { return };
        if viewed.path != path {
            return;
        }
        match result {
            Ok(image) if image.screen == screen => {
                viewed.image = Some(image);
                self.repaint();
            }
            // The image was encoded for the previous screen size. It is ignored.
            Ok(_) => {}
            Err(why) => {
                let name = short_name(path);
                self.close_viewer();
                self.refuse(&format!("{name} cannot be shown: {why}"));
            }
        }
    }
}
