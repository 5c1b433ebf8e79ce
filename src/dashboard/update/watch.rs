//! Reports on watched film files.

use crate::dashboard::{ListCursor, UpdateContext, WatchTable, short_name};
use std::path::Path;
use std::sync::Arc;
use zerkalo_render::schedule::Stop;
use zerkalo_render::session::{WatchReport, WatchedShards};
use zerkalo_scene::Scene;
use zerkalo_scene::value::sanitized;

impl UpdateContext<'_> {
    /// Stores a report. A cursor on the first row stays there; on another row it follows its entry
    /// to the entry's new row.
    pub(super) fn watched(&mut self, report: WatchReport) {
        let before = self.model.watch.take();
        if let Some(size) = report.size.filter(|size| *size != self.scene().film.size) {
            let mut scene = Scene::clone(self.scene());
            scene.film.size = size;
            let scene = Arc::new(scene);
            self.model.file.saved = Arc::clone(&scene);
            self.model.history.restart(scene);
            self.repaint();
        }
        if before.as_ref().is_none_or(|before| before.report.size.is_none()) {
            self.model.display = report.display;
        }
        self.model.file.name = match report.source.as_str() {
            "" => "no film yet".to_string(),
            source => short_name(Path::new(&sanitized(source))),
        };
        self.model.stop = Stop { noise_levels: report.target_levels, ..Stop::default() };
        let key = |row: &WatchedShards| (row.path.clone(), row.shards.clone());
        let chosen = before.as_ref().and_then(|table| table.report.shards.get(table.at.index));
        let chosen = chosen.map(key);
        let same = report.shards.iter().position(|row| Some(key(row)) == chosen);
        let mut at = before.map_or_else(ListCursor::default, |table| table.at);
        // The first row needs the user's attention most, so a cursor there does not move.
        at.index = if at.index == 0 { 0 } else { same.unwrap_or(at.index) };
        self.model.watch = Some(WatchTable { report, at });
    }
}
