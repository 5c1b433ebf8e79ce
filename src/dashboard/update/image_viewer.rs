//! Viewer of exported images.

use crate::dashboard::{Effect, Overlay, UpdateContext, ViewedImage, short_name};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_terminal::image::ViewerImage;
use zerkalo_terminal::stores_files;

impl UpdateContext<'_> {
    /// Returns the path of the last written picture, or says that there is none.
    pub(super) fn last_export(&mut self) -> Option<PathBuf> {
        if self.model.last_export.is_none() {
            self.say("No picture was written yet · p writes one");
        }
        self.model.last_export.clone()
    }

    pub(super) fn view_last_export(&mut self) {
        if let Some(path) = self.last_export() {
            self.view_image(path, false);
        }
    }

    pub(super) fn download_last_export(&mut self) {
        let Some(path) = self.last_export() else { return };
        if stores_files(&self.model.graphics.terminal) {
            self.view_image(path, true);
        } else {
            self.say("iTerm2 and WezTerm store files, this terminal does not · y copies the path for scp");
        }
    }

    /// Records the progress of the upload. A download ends the viewer.
    pub(super) fn image_sent(&mut self, sent: f64) {
        let Some(Overlay::ViewerImage(viewed)) = &mut self.model.overlay else { return };
        viewed.sent = sent;
        if viewed.downloads && sent >= 1.0 {
            let name = short_name(&viewed.path);
            self.close_viewer();
            self.say(format!("{name} is on the machine of your terminal"));
        }
    }

    fn view_image(&mut self, path: PathBuf, downloads: bool) {
        let (display, screen) = (self.model.display, self.model.screen);
        self.emit(Effect::ViewImage { path: path.clone(), display, screen, downloads });
        self.model.drag = None;
        self.model.overlay =
            Some(Overlay::ViewerImage(ViewedImage { path, image: None, sent: 0.0, downloads }));
        self.repaint();
    }

    /// Requests the viewed image for the new screen size.
    pub(super) fn refit_image(&mut self) {
        if let Some(Overlay::ViewerImage(viewed)) = &self.model.overlay {
            self.view_image(viewed.path.clone(), viewed.downloads);
        }
    }

    pub(super) fn close_viewer(&mut self) {
        self.model.overlay = None;
        self.repaint();
    }

    /// Shows an encoded image, or reports why it cannot be shown. Ignores an image of another path
    /// or screen size.
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
            Ok(_) => {}
            Err(why) => {
                let name = short_name(path);
                self.close_viewer();
                self.refuse(&format!("{name} cannot be shown: {why}"));
            }
        }
    }
}
