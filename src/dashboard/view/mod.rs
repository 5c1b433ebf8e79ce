//! Drawing of the model into a buffer of terminal cells. The cells of the picture are cached.

pub mod false_color;
mod fields;
mod frame;
mod ground_grid;
mod histogram;
mod image_viewer;
mod legend;
mod loupe;
pub mod marks;
mod message_view;
mod outline;
mod overlay;
mod painter;
mod picture;
mod pixel_probe;
mod plot;
mod status;
#[cfg(test)]
mod tests;
pub mod theme;
mod watch;

use crate::dashboard::layout::SMALLEST;
use crate::dashboard::{Focus, Layout, Model, Overlay};
use painter::Painter;
use picture::PictureView;
pub use picture::is_settled;
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use ratatui::style::Style;
use theme::Theme;
use zerkalo_terminal::cells::{Blocks, Colors, mosaic_cells, picture_cells};

#[derive(Debug, Default)]
pub struct View {
    imager: PictureView,
    /// Version for which `picture` was made; `None` before the first picture.
    made_for: Option<Version>,
    picture: Buffer,
    /// Rectangle in which the picture was last drawn.
    pub place: Rect,
    /// Row-major mask of the cells of `place`: `true` if nothing covers the cell.
    pub uncovered: Vec<bool>,
}

/// Key of the cache: picture version, columns and rows of texels, and set of colours.
type Version = (u64, [usize; 2], Colors);

impl View {
    /// Returns the cells of the picture for the area in `layout`.
    pub fn picture(&mut self, model: &Model, layout: &Layout) -> &Buffer {
        let version = (model.picture_version, layout.texels, model.colors);
        if self.made_for != Some(version) {
            let settled = picture::is_settled(model);
            let raster = match model.is_empty() {
                true => Some(ground_grid::raster(model.scene(), layout.texels)),
                false => self.imager.raster(model, layout),
            };
            let raster = raster.unwrap_or_default();
            let is_negative = model.on_light && model.colors == Colors::Mono;
            let raster = if is_negative { raster.negative() } else { raster };
            self.picture = match model.graphics.blocks(model.colors) {
                Blocks::Halves => picture_cells(&raster, model.colors, settled),
                fine => mosaic_cells(&raster, fine),
            };
            self.made_for = Some(version);
        }
        &self.picture
    }

    fn plot(&self, model: &Model, layout: &Layout, painter: &mut Painter) {
        match (layout.plot, &self.imager.histogram) {
            (Some(area), Some(histogram)) if model.histogram => histogram.draw(area, painter),
            _ => plot::draw(model, layout, painter),
        }
    }

    /// Draws `model` into `buffer`, which must be empty and have the size of the screen. Returns
    /// the position of the text cursor.
    pub fn draw(&mut self, model: &Model, buffer: &mut Buffer) -> Option<Position> {
        let theme = Theme {
            colors: model.colors,
            on_light: model.on_light,
            tones: model.preferences.tones,
        };
        let painter = &mut Painter { theme, buffer };
        (self.place, self.uncovered) = (Rect::ZERO, Vec::new());
        if let Some(Overlay::ViewerImage(viewed)) = &model.overlay {
            if let Some((cells, place)) = image_viewer::draw(model, viewed, painter) {
                (self.place, self.uncovered) = picture::visible_mask(&cells, place, painter.buffer);
            }
            return None;
        }
        let Some(layout) = model.layout() else {
            too_small(model.screen, painter);
            return None;
        };
        self.picture(model, &layout);
        let mut magnified = None;
        frame::draw(model, &layout, self.imager.legend.as_ref(), painter);
        if model.file.unreadable {
            message_view::broken(model, &layout, painter);
        } else {
            picture::paint(&self.picture, layout.image, painter.buffer);
            marks::draw(model, &layout, painter);
            magnified = loupe::draw(model, &layout, painter);
            message_view::failure(model, &layout, painter);
            message_view::empty(model, &layout, painter);
            pixel_probe::draw(model, &layout, painter);
        }
        status::draw(model, layout.status, painter);
        status::hints_line(model, layout.hints, painter);
        // An open form replaces outline, inspector and plot.
        let mut cursor = None;
        if model.watch.is_some() {
            watch::draw(model, &layout, painter);
            self.plot(model, &layout, painter);
        } else if !matches!(model.overlay, Some(Overlay::Form(_))) {
            outline::draw(model, &layout, painter);
            cursor = fields::inspector(model, &layout, painter);
            self.plot(model, &layout, painter);
        }
        if model.overlay.is_some() {
            cursor = overlay::draw(model, painter);
        }
        if !model.file.unreadable {
            (self.place, self.uncovered) =
                picture::visible_mask(&self.picture, layout.image, painter.buffer);
            if let Some(cells) = &magnified {
                loupe::uncover(cells, painter.buffer, self.place, &mut self.uncovered);
            }
        }
        cursor
    }
}

/// Returns `true` if keys go to the panel `focus`.
fn is_active(model: &Model, focus: Focus) -> bool {
    model.focus == focus && model.overlay.is_none()
}

fn too_small([width, height]: [u16; 2], painter: &mut Painter) {
    let [columns, rows] = SMALLEST;
    let message = format!(
        "zerkalo needs at least {columns} columns and {rows} rows; this terminal has {width} and \
         {height}."
    );
    let area = Rect { x: 0, y: 0, width, height };
    painter.paragraphs(area, &[(message, Style::new())]);
}
