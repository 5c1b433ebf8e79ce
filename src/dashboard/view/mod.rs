//! Drawing of the dashboard's model into a buffer of terminal cells.
//!
//! The cells of the picture are computed separately by [`View::picture`] and cached until one of
//! their inputs changes.

mod fields;
mod frame;
mod image_viewer;
mod legend;
mod message_view;
mod outline;
mod overlay;
mod picture;
mod pixel_probe;
mod plot;
mod status;
#[cfg(test)]
mod tests;
mod text;
mod theme;
mod watch;

use crate::dashboard::layout::{Focus, Layout, SMALLEST};
use crate::dashboard::model::Model;
use crate::dashboard::overlay::Overlay;
use picture::PictureView;
pub use picture::is_settled;
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use text::Row;
use theme::Theme;
use zerkalo_terminal::cells::{Colors, PictureCells};

/// View of the dashboard's model. It caches the cells of the picture.
#[derive(Debug, Default)]
pub struct View {
    imager: PictureView,
    /// Inputs for which the cells of the picture were computed; `None` before the first picture.
    made_for: Option<Version>,
    picture: PictureCells,
    /// Rectangle of the screen in which the picture was last drawn.
    pub place: Rect,
    /// Row-major mask of the cells of `place`: `true` if no overlay or mark covers the cell.
    pub uncovered: Vec<bool>,
}

/// Inputs of the picture's cells: the model's counter of changes of the picture, the columns and
/// rows of half cells (upper or lower halves of cells), and the set of colours.
type Version = (u64, [usize; 2], Colors);

impl View {
    /// Returns the terminal cells of the rendered picture for the area in `layout`. They are
    /// cached, and computed again only if an input has changed: the model's counter of changes of
    /// the picture, the size of the area, or the set of colours.
    pub fn picture(&mut self, model: &Model, layout: &Layout) -> &PictureCells {
        let version = (model.picture_version, layout.raster, model.colors);
        if self.made_for != Some(version) {
            let settled = picture::is_settled(model);
            let raster = self.imager.raster(model, layout.raster);
            self.picture = PictureCells::new(&raster, model.colors, settled);
            self.made_for = Some(version);
        }
        &self.picture
    }

    /// Draws `model` into `buffer`, which must be empty and have the size of the model's screen.
    /// Returns the position of the text cursor, or `None` if the cursor is hidden.
    pub fn draw(&mut self, model: &Model, buffer: &mut Buffer) -> Option<Position> {
        let theme = Theme { colors: model.colors };
        if let Some(Overlay::ViewerImage(viewed)) = &model.overlay {
            let cells = image_viewer::draw(model, viewed, &theme, buffer);
            (self.place, self.uncovered) = match (cells, &viewed.image) {
                (Some(cells), Some(image)) => {
                    picture::visible_mask(&cells, image.layout.place, buffer)
                }
                _ => (Rect::ZERO, Vec::new()),
            };
            return None;
        }
        (self.place, self.uncovered) = (Rect::ZERO, Vec::new());
        let Some(layout) = model.layout() else {
            too_small(model.screen, buffer);
            return None;
        };
        self.picture(model, &layout);
        frame::draw(model, &layout, self.imager.legend.as_ref(), &theme, buffer);
        if model.file.unreadable {
            message_view::broken(model, &layout, &theme, buffer);
        } else {
            picture::paint(&self.picture, layout.image, buffer);
            message_view::failure(model, &layout, &theme, buffer);
            pixel_probe::draw(model, &layout, &theme, buffer);
        }
        status::draw(model, layout.status, &theme, buffer);
        status::hints_line(model, layout.hints, &theme, buffer);
        // An open form replaces the panels: outline, inspector and plot are not drawn then.
        let mut cursor = None;
        if model.watch.is_some() {
            watch::draw(model, &layout, &theme, buffer);
            plot::draw(model, &layout, &theme, buffer);
        } else if !matches!(model.overlay, Some(Overlay::Form(_))) {
            outline::draw(model, &layout, &theme, buffer);
            cursor = fields::inspector(model, &layout, &theme, buffer);
            plot::draw(model, &layout, &theme, buffer);
        }
        if model.overlay.is_some() {
            cursor = overlay::draw(model, &theme, buffer);
        }
        if !model.file.unreadable {
            (self.place, self.uncovered) =
                picture::visible_mask(&self.picture, layout.image, buffer);
        }
        cursor
    }
}

/// Returns `true` if key presses go to the panel `focus`: it has the keyboard focus, and no overlay
/// is open.
fn is_active(model: &Model, focus: Focus) -> bool {
    model.focus == focus && model.overlay.is_none()
}

/// Draws a message on a terminal that is too small.
fn too_small([width, height]: [u16; 2], buffer: &mut Buffer) {
    let [columns, rows] = SMALLEST;
    let text = format!(
        "zerkalo needs at least {columns} columns and {rows} rows; this terminal has {width} and \
         {height}."
    );
    let lines = crate::dashboard::overlay_layout::wrapped(&text, width.max(1));
    let area = Rect { x: 0, y: 0, width, height };
    let top = height.saturating_sub(lines.len() as u16) / 2;
    for (row, line) in (top..).zip(&lines) {
        let indent = usize::from(width).saturating_sub(text::columns(line)) / 2;
        Row::new(buffer, area, row).skip(indent).put(line, ratatui::style::Style::new());
    }
}
