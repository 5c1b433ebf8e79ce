//! Layout of the screen in panels, which drawing and mouse handling share.

use crate::dashboard::Model;
use ratatui::layout::{Margin, Rect};
use zerkalo_render::film::Window;

/// Panel that can have the focus.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Focus {
    #[default]
    Picture,
    /// List of all parts of the scene.
    Outline,
    /// List of the selection's properties.
    Inspector,
}

/// Areas of the panels, borders included. The area of a side panel is `None` if it is hidden, for
/// lack of room or in full screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    pub picture: Rect,
    /// Area of the cells that show the picture, centred inside the panel.
    pub image: Rect,
    /// Columns and rows of the picture in half cells. A half cell is the upper or lower half of a
    /// terminal cell, and is treated as square. If the number of rows is odd, the last row consists
    /// of upper halves.
    pub raster: [usize; 2],
    /// Columns and rows of the pixels that the block characters of the picture show.
    pub texels: [usize; 2],
    /// Window of the film that the picture shows.
    pub window: Window,
    /// Pixels of the screen that show the picture if the terminal shows images and if pixels show
    /// more of the film than cells.
    pub pixels: Option<PixelGrid>,
    /// Area of the outline, or of the table of watched files.
    pub outline: Option<Rect>,
    pub inspector: Option<Rect>,
    pub plot: Option<Rect>,
    pub status: Rect,
    /// Row of key hints and notices.
    pub hints: Rect,
}

/// Picture in pixels of the screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelGrid {
    /// Cells that the picture covers, at least in part.
    pub place: Rect,
    /// Width and height of the picture in pixels.
    pub size: [usize; 2],
    /// Width and height of a cell in pixels.
    pub cell: [usize; 2],
    /// Window of the film that the pixels show.
    pub window: Window,
}

/// Border between panels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Border {
    /// Left of the side panels.
    Side,
    /// Below the outline.
    Outline,
    /// Above the plot.
    Plot,
}

/// Columns of the side panels, rows of the outline, rows of the plot, each `None` unless the user has
/// moved the [`Border`] with this number.
pub type Borders = [Option<u16>; 3];

/// Zoom of the film in its panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zoom {
    /// Binary logarithm of the number of half cells across a film pixel.
    pub steps: i32,
    /// Column and row of the film, in pixels, at the centre of the panel.
    pub center: [f64; 2],
}

pub const BORDER: Margin = Margin { horizontal: 1, vertical: 1 };

/// Columns and rows of the smallest supported terminal.
pub const SMALLEST: [u16; 2] = [40, 12];

/// Smallest height of the convergence plot in rows.
const PLOT_ROWS: u16 = 8;
/// Least size of side panels whose borders the user has moved.
const LEAST_COLUMNS: u16 = 24;
const LEAST_ROWS: u16 = 5;
/// Smallest width of the terminal at which the side panels stay visible while the picture has the
/// focus.
const SIDE_FROM: u16 = 72;

impl Model {
    /// Returns the layout of the screen; `None` if the terminal is smaller than [`SMALLEST`].
    pub fn layout(&self) -> Option<Layout> {
        let [width, height] = self.screen;
        if width < SMALLEST[0] || height < SMALLEST[1] {
            return None;
        }
        let status = Rect { x: 0, y: height - 2, width, height: 1 };
        let hints = Rect { x: 0, y: height - 1, width, height: 1 };
        let rows = height - 2;
        let mut side = match (width, self.watch.is_some()) {
            (0..100, false) => 28,
            (0..100, true) => 34,
            (100..160, false) => 38,
            (100..160, true) => 46,
            _ => 52,
        };
        let [moved_side, ..] = self.borders;
        if let Some(columns) = moved_side {
            side = columns.min(width / 2).max(LEAST_COLUMNS);
        }
        if self.fullscreen || width < SIDE_FROM && self.focus == Focus::Picture {
            side = 0;
        }
        let picture = Rect { x: 0, y: 0, width: width - side, height: rows };
        let inside = self.inside(picture);
        let film = self.scene().film.size;
        let (raster, window) = match self.zoom {
            Some(zoom) => zoom.window(inside, film),
            None => (fitted(inside, film), Window::whole(film.map(|n| n as usize))),
        };
        let image = centred(inside, raster);
        let cells = PictureCells { image, raster, window, pixels: None };
        let PictureCells { image, raster, window, pixels } = match self.graphics.cell_px() {
            Some(cell) => cells.with_pixels(inside, cell, self.zoom, film),
            None => cells,
        };
        let grid = self.graphics.blocks(self.colors).grid();
        let [outline, inspector, plot] = match side {
            0 => [None; 3],
            _ => self.side_panels(Rect { x: width - side, y: 0, width: side, height: rows }),
        };
        Some(Layout {
            picture,
            image,
            raster,
            texels: [raster[0] * grid[0], (raster[1] * grid[1]).div_ceil(2)],
            window,
            pixels,
            outline,
            inspector,
            plot,
            status,
            hints,
        })
    }

    /// Moves a border between panels to a cell.
    pub(super) fn move_border(&mut self, border: Border, [column, row]: [u16; 2]) {
        let [width, height] = self.screen;
        let sizes = [width.saturating_sub(column), row, height.saturating_sub(row + 2)];
        self.borders[border as usize] = Some(sizes[border as usize]);
    }

    /// Returns the number of half cells across a film pixel if the whole film is visible.
    pub fn fitting_scale(&self) -> f64 {
        let film = self.scene().film.size;
        let inside = self.layout().map(|layout| self.inside(layout.picture));
        inside.map_or(1.0, |inside| fitted(inside, film)[0] as f64 / f64::from(film[0].max(1)))
    }

    /// Returns the room for the picture's cells in its panel.
    fn inside(&self, panel: Rect) -> Rect {
        if self.fullscreen { panel } else { panel.inner(BORDER) }
    }

    /// Divides the side column into outline, inspector and plot, from top to bottom. In `zerkalo
    /// watch` the first is the table of watched files, and the second is `None`.
    fn side_panels(&self, side: Rect) -> [Option<Rect>; 3] {
        let rows = side.height;
        let [_, moved_outline, moved_plot] = self.borders;
        let plot = match moved_plot.unwrap_or(rows * 3 / 10) {
            moved if rows >= 3 * PLOT_ROWS + 6 => moved.clamp(PLOT_ROWS, rows - 2 * PLOT_ROWS),
            _ => 0,
        };
        // The outline and the inspector share `left` rows. In less than 16 rows, there is room for
        // one of them only.
        let left = rows - plot;
        let scene = self.scene();
        let lights = scene.groups.len() + scene.lights.len();
        let parts = [scene.objects.len(), lights, scene.materials.len()];
        let headings = 3 + parts.iter().filter(|n| **n > 0).count();
        let unfolded: usize = self.unfolded.iter().map(|whole| whole.parts(scene).len()).sum();
        // Camera, ambient light, background, film and integrator.
        let lines = 5 + headings + scene.cameras.len() + parts.iter().sum::<usize>() + unfolded;
        let needed = u16::try_from(lines + 2).unwrap_or(u16::MAX);
        let outline = match (self.focus, moved_outline) {
            _ if self.watch.is_some() => left,
            (Focus::Outline, _) if rows < 16 => left,
            _ if rows < 16 => 0,
            (_, Some(moved)) => moved.clamp(LEAST_ROWS, left - LEAST_ROWS),
            (Focus::Outline, None) if rows < 40 => needed.min(left * 3 / 5),
            (_, None) => needed.min(left * 2 / 5),
        };
        let part = |y, height| (height > 0).then_some(Rect { y: side.y + y, height, ..side });
        [part(0, outline), part(outline, left - outline), part(left, plot)]
    }
}

/// Returns the columns and rows of half cells of the largest area with the film's aspect ratio in
/// `inside`.
fn fitted(inside: Rect, [film_width, film_height]: [u32; 2]) -> [usize; 2] {
    let (columns, halves) = (f64::from(inside.width), 2.0 * f64::from(inside.height));
    let (film_width, film_height) = (f64::from(film_width.max(1)), f64::from(film_height.max(1)));
    let per_pixel = (columns / film_width).min(halves / film_height);
    let whole = |pixels: f64, most: f64| (pixels * per_pixel).round().clamp(1.0, most.max(1.0));
    [whole(film_width, columns), whole(film_height, halves)].map(|n| n as usize)
}

/// Returns the cells of a picture of `raster` half cells, at the centre of `inside`.
fn centred(inside: Rect, [columns, halves]: [usize; 2]) -> Rect {
    let (width, height) = (columns as u16, halves.div_ceil(2) as u16);
    Rect {
        x: inside.x + inside.width.saturating_sub(width) / 2,
        y: inside.y + inside.height.saturating_sub(height) / 2,
        width,
        height,
    }
}

/// Cells and pixels of the picture, as in [`Layout`].
struct PictureCells {
    image: Rect,
    raster: [usize; 2],
    window: Window,
    pixels: Option<PixelGrid>,
}

impl PictureCells {
    /// Adds the pixels of the picture, unless cells show each pixel of the film as a square. A film
    /// pixel is a square, of whole pixels of the screen if the film fits into `inside`. The cells
    /// then show the part of the film that covers them exactly.
    fn with_pixels(
        self,
        inside: Rect,
        cell: [usize; 2],
        zoom: Option<Zoom>,
        film: [u32; 2],
    ) -> Self {
        let Self { raster, window, .. } = self;
        if raster[0] >= window.size[0] && (zoom.is_none() || cell[1] == 2 * cell[0]) {
            return self;
        }
        let room = [usize::from(inside.width) * cell[0], usize::from(inside.height) * cell[1]];
        let (scale, window) = match zoom {
            Some(zoom) => {
                let scale = f64::from(zoom.steps).exp2() * cell[0] as f64;
                (scale, zoom.part(room.map(|px| px as f64 / scale), film))
            }
            None => {
                let [across, down] = [0, 1].map(|i| room[i] as f64 / window.size[i] as f64);
                let scale = across.min(down);
                (if scale < 1.0 { scale } else { scale.floor() }, window)
            }
        };
        let size = [0, 1]
            .map(|i| ((window.size[i] as f64 * scale).round() as usize).clamp(1, room[i].max(1)));
        let [width, height] = [0, 1].map(|i| size[i].div_ceil(cell[i]));
        let place = centred(inside, [width, 2 * height]);
        let cells = [0, 1].map(|i| (size[i] / cell[i]).max(1));
        let image = Rect { width: cells[0] as u16, height: cells[1] as u16, ..place };
        let shown = [0, 1]
            .map(|i| (((cells[i] * cell[i]) as f64 / scale) as usize).clamp(1, window.size[i]));
        Self {
            image,
            raster: [cells[0], 2 * cells[1]],
            window: Window { size: shown, ..window },
            pixels: Some(PixelGrid { place, size, cell, window }),
        }
    }
}

impl Zoom {
    /// Returns columns and rows of half cells in `inside`, and the window of the film that they
    /// show.
    fn window(&self, inside: Rect, film: [u32; 2]) -> ([usize; 2], Window) {
        let scale = f64::from(self.steps).exp2();
        let room = [usize::from(inside.width), 2 * usize::from(inside.height)];
        let window = self.part(room.map(|n| n as f64 / scale), film);
        let halves =
            |i: usize| ((window.size[i] as f64 * scale).round() as usize).clamp(1, room[i].max(1));
        ([halves(0), halves(1)], window)
    }

    /// Returns the window of the film of at most `room` pixels.
    fn part(&self, room: [f64; 2], film: [u32; 2]) -> Window {
        let film = film.map(|n| n as usize);
        let size = [0, 1].map(|i| (room[i] as usize).clamp(1, film[i].max(1)));
        let origin = [0, 1].map(|i| {
            let start = (self.center[i] - 0.5 * size[i] as f64).round().max(0.0) as usize;
            start.min(film[i].saturating_sub(size[i]))
        });
        Window { origin, size }
    }
}

impl Layout {
    /// Returns the border between panels in a cell.
    pub fn border_at(&self, column: u16, row: u16) -> Option<Border> {
        let side = self.outline.or(self.inspector)?;
        let below = |area: Option<Rect>| {
            area.is_some_and(|area| area.y > 0 && (area.y - 1..=area.y).contains(&row))
        };
        match column {
            _ if row >= self.status.y => None,
            _ if (side.x - 1..=side.x).contains(&column) => Some(Border::Side),
            _ if column < side.x => None,
            _ if below(self.plot) => Some(Border::Plot),
            _ if below(self.inspector) => Some(Border::Outline),
            _ => None,
        }
    }

    /// Returns the pixel of the film (column, row) that the cell at `column` and `row` of the
    /// screen shows at its centre. Returns `None` outside the picture.
    pub fn film_pixel(&self, column: u16, row: u16) -> Option<[usize; 2]> {
        if !self.image.contains((column, row).into()) {
            return None;
        }
        let at =
            [f64::from(column - self.image.x) + 0.5, 2.0 * f64::from(row - self.image.y) + 1.0];
        let Window { origin, size } = self.window;
        let pixel = |i: usize| {
            let pixel = at[i] / self.raster[i] as f64 * size[i] as f64;
            origin[i] + (pixel as usize).min(size[i].saturating_sub(1))
        };
        Some([pixel(0), pixel(1)])
    }

    /// Returns the cell (column, row) that shows a point of the film in pixels. Returns `None`
    /// outside the window.
    pub fn cell_of(&self, point: [f64; 2]) -> Option<[u16; 2]> {
        let Window { origin, size } = self.window;
        let half = |i: usize| {
            let share = (point[i] - origin[i] as f64) / size[i] as f64;
            (0.0..1.0).contains(&share).then(|| (share * self.raster[i] as f64) as u16)
        };
        Some([self.image.x + half(0)?, self.image.y + half(1)? / 2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use zerkalo_scene::{History, Scene};

    fn at(width: u16, height: u16, focus: Focus) -> Option<Layout> {
        Model { screen: [width, height], focus, ..Model::default() }.layout()
    }

    const FOCI: [Focus; 3] = [Focus::Picture, Focus::Outline, Focus::Inspector];

    /// Checks at every terminal size that the panels stay on the screen and fill it without
    /// overlap, and that the panel with the keyboard focus is never hidden.
    #[test]
    fn panels_tile_the_screen() {
        for width in 40..220 {
            for height in 12..70 {
                for focus in FOCI {
                    let l = at(width, height, focus).unwrap();
                    let panels = [Some(l.picture), l.outline, l.inspector, l.plot];
                    let cells = |a: &Rect| u32::from(a.width) * u32::from(a.height);
                    let all: u32 = panels.iter().flatten().map(cells).sum();
                    assert_eq!(all, u32::from(width) * u32::from(height - 2), "{width}x{height}");
                    for panel in panels.into_iter().flatten() {
                        assert!(panel.x + panel.width <= width && panel.y + panel.height <= height);
                        assert!(panel.width >= 12 && panel.height >= 5, "{panel:?}");
                    }
                    let focused = match focus {
                        Focus::Picture => Some(l.picture),
                        Focus::Outline => l.outline,
                        Focus::Inspector => l.inspector,
                    };
                    assert!(focused.is_some(), "{width}x{height} {focus:?}");
                    assert!(l.plot.is_none_or(|plot| plot.height >= PLOT_ROWS));
                }
            }
        }
        assert!(at(39, 12, Focus::Picture).is_none() && at(40, 11, Focus::Picture).is_none());
        assert!(at(200, 60, Focus::Picture).unwrap().plot.is_some());
        assert!(at(120, 36, Focus::Picture).unwrap().plot.is_some());
        assert!(at(80, 24, Focus::Picture).unwrap().inspector.is_some());
    }

    #[test]
    fn borders_follow_the_mouse_within_limits() {
        for (screen, border, to, height) in [
            ([120, 36], Border::Outline, [90, 15], 15),
            ([120, 36], Border::Outline, [90, 35], 19),
            ([120, 36], Border::Outline, [90, 0], LEAST_ROWS),
            ([80, 24], Border::Outline, [70, 11], 11),
        ] {
            let mut model = Model { screen, ..Model::default() };
            let old = model.layout().unwrap();
            let at = old.inspector.unwrap();
            assert_eq!(old.border_at(at.x + 5, at.y), Some(border));
            model.move_border(border, to);
            assert_eq!(
                model.layout().unwrap().outline.unwrap().height,
                height,
                "{screen:?} {to:?}"
            );
        }
        for (column, width) in [(90, 90), (10, 60), (119, 96)] {
            let mut model = Model { screen: [120, 36], ..Model::default() };
            let old = model.layout().unwrap();
            assert_eq!(old.border_at(old.picture.width, 9), Some(Border::Side));
            model.move_border(Border::Side, [column, 9]);
            assert_eq!(model.layout().unwrap().picture.width, width);
            model.move_border(Border::Plot, [110, 20]);
            assert_eq!(model.layout().unwrap().plot.unwrap().y, 20);
        }
    }

    /// Checks that the picture fills the width or the height of its panel, and that each cell of
    /// the picture shows a film pixel. The picture must have the film's aspect ratio, except for
    /// rounding to whole half cells.
    #[test]
    fn picture_keeps_aspect_ratio_of_film() {
        for film in [[640, 480], [480, 640], [1920, 800], [1, 1], [8192, 1], [1, 8192]] {
            for screen in [[80, 24], [120, 36], [200, 60], [40, 12]] {
                for fullscreen in [false, true] {
                    let mut scene = Scene::default();
                    scene.film.size = film;
                    let history = History::new(Arc::new(scene));
                    let l = Model { screen, fullscreen, history, ..Model::default() };
                    let l = l.layout().unwrap();
                    let inside = if fullscreen { l.picture } else { l.picture.inner(BORDER) };
                    let [columns, halves] = l.raster;
                    let room = [usize::from(inside.width), 2 * usize::from(inside.height)];
                    assert!(columns == room[0] || halves == room[1], "{film:?} {screen:?} {l:?}");
                    assert!(columns <= room[0] && halves <= room[1]);
                    let aspect = f64::from(film[0]) / f64::from(film[1]);
                    let off = (columns as f64 - halves as f64 * aspect).abs() / aspect.max(1.0);
                    assert!(
                        off <= 0.51 || columns == 1 || halves == 1,
                        "{film:?} {screen:?} {l:?}"
                    );
                    let image = l.image;
                    for row in image.y..image.y + image.height {
                        for column in image.x..image.x + image.width {
                            assert!(inside.contains((column, row).into()));
                            let pixel = l.film_pixel(column, row).unwrap();
                            assert!(l.window.contains(pixel));
                        }
                    }
                    assert_eq!(l.film_pixel(image.x + image.width, image.y), None);
                }
            }
        }
    }
}
