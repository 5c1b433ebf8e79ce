//! Perceptual difference between the cells of the picture that the terminal shows and those of the
//! target frame.

use crate::terminal::cells::{CellColor, Oklab, PictureCell, blocks};
use crate::terminal::diff::{TargetFrame, position};
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;

/// Difference of a cell with unknown contents. It is larger than that between black and white, so
/// that such cells are sent first.
const UNKNOWN: f32 = 2.0;

/// Target and shown colours of one cell of the picture.
#[derive(Clone, Copy, Debug)]
struct CellColors {
    /// Cell of the target frame. `None` where text covers the picture.
    target: Option<PictureCell>,
    /// Colours of the halves of the target cell.
    look: [Oklab; 2],
    /// Colours of the halves of the cell on the terminal. `None` if unknown.
    shown: Option<[Oklab; 2]>,
    /// `true` if a difference of this cell may be visible. After the cell has been sent exactly,
    /// its differences are ignored until the next full comparison.
    counts: bool,
    /// Difference between target and shown cell; 0 if they are equal.
    error: f32,
    /// `true` if the difference is visible.
    visible: bool,
}

/// Perceptual differences of all cells in the area of the picture.
#[derive(Debug, Default)]
pub struct PerceptualDiff {
    area: Rect,
    /// Cells, row by row.
    cells: Vec<CellColors>,
}

impl PerceptualDiff {
    /// Marks the contents of the terminal as unknown.
    pub fn forget(&mut self) {
        self.area = Rect::ZERO;
        self.cells.clear();
    }

    /// Sets the area of the picture. A new area has unknown contents.
    pub fn fit(&mut self, area: Rect) {
        if self.area != area {
            self.area = area;
            let black = Oklab { l: 0.0, a: 0.0, b: 0.0 };
            let unknown = CellColors {
                target: None,
                look: [black; 2],
                shown: None,
                counts: true,
                error: 0.0,
                visible: false,
            };
            let count = usize::from(area.width) * usize::from(area.height);
            self.cells = vec![unknown; count];
        }
    }

    /// Compares the shown cells with the target. In a full comparison (`is_due`) every difference
    /// above `threshold` is visible, otherwise only those of cells with `counts`.
    pub fn compare(&mut self, target: &TargetFrame, shown: &Buffer, is_due: bool, threshold: f32) {
        for (index, cell_colors) in self.cells.iter_mut().enumerate() {
            let cell_position = position(self.area, index);
            let cell = &target.cells[cell_position];
            (cell_colors.error, cell_colors.visible) = (0.0, false);
            cell_colors.counts |= is_due;
            if !target.uncovered.get(index).copied().unwrap_or(false) {
                cell_colors.target = None;
                continue;
            }
            let picture = picture_cell(cell);
            if cell_colors.target != Some(picture) {
                cell_colors.target = Some(picture);
                cell_colors.look = picture.halves();
            }
            if *cell == shown[cell_position] {
                (cell_colors.shown, cell_colors.counts) = (Some(cell_colors.look), false);
                continue;
            }
            cell_colors.error =
                cell_colors.shown.map_or(UNKNOWN, |shown| difference(shown, cell_colors.look));
            cell_colors.counts &= cell_colors.error > threshold;
            cell_colors.visible = cell_colors.counts;
            // Cells that differ but have equal colours get a positive error, so that they are sent
            // last.
            cell_colors.error = cell_colors.error.max(f32::MIN_POSITIVE);
        }
    }

    /// Records that text now covers cell `index`.
    pub fn covered(&mut self, index: usize) {
        if let Some(cell_colors) = self.cells.get_mut(index) {
            (cell_colors.shown, cell_colors.counts) = (None, true);
        }
    }

    /// Records that the terminal shows `cell` at `index`. `exact` is `true` if `cell` equals the
    /// target.
    pub fn sent(&mut self, index: usize, cell: &Cell, exact: bool) {
        let cell_colors = &mut self.cells[index];
        let shown = picture_cell(cell).halves();
        cell_colors.shown = Some(shown);
        (cell_colors.counts, cell_colors.visible) = (!exact, !exact);
        cell_colors.error =
            if exact { 0.0 } else { difference(shown, cell_colors.look).max(f32::MIN_POSITIVE) };
    }

    /// Returns the difference and the index of each cell with a visible difference.
    pub fn visible(&self) -> Vec<(f32, usize)> {
        self.select(|cell_colors| cell_colors.visible)
    }

    /// Returns the difference and the index of each cell with an invisible difference.
    pub fn hidden(&self) -> Vec<(f32, usize)> {
        self.select(|cell_colors| !cell_colors.visible && cell_colors.error > 0.0)
    }

    /// Returns `true` if there are visible differences.
    pub fn has_visible(&self) -> bool {
        self.cells.iter().any(|cell_colors| cell_colors.visible)
    }

    /// Returns `true` if there are invisible differences.
    pub fn has_hidden(&self) -> bool {
        self.cells.iter().any(|cell_colors| !cell_colors.visible && cell_colors.error > 0.0)
    }

    /// Creates a mosaic of the target with blocks of `side` x `side` half cells. Returns all its
    /// cells, and a list of the cells that it improves: the gain (how much closer to the target
    /// than the shown cell, in OKLab distance) and the index.
    pub fn coarse(&self, target: &TargetFrame, side: usize) -> (Vec<Cell>, Vec<(f32, usize)>) {
        let width = usize::from(self.area.width);
        let rows = usize::from(self.area.height);
        let mut halves = vec![None; 2 * width * rows];
        for (index, cell_colors) in self.cells.iter().enumerate() {
            let Some([upper, lower]) = cell_colors.target.and_then(|cell| cell.colors()) else {
                continue;
            };
            let (x, y) = (index % width, index / width);
            halves[2 * y * width + x] = Some(upper);
            halves[(2 * y + 1) * width + x] = Some(lower);
        }
        let blocks = blocks(&halves, width, side);
        let mut cells: Vec<Cell> = Vec::with_capacity(self.cells.len());
        let mut improved = Vec::new();
        for (index, cell_colors) in self.cells.iter().enumerate() {
            let (x, y) = (index % width, index / width);
            let mean = blocks[2 * y * width + x];
            let mut cell = target.cells[position(self.area, index)].clone();
            if let (Some([r, g, b]), true) = (mean, cell_colors.visible) {
                let look = [Oklab::of([r, g, b]); 2];
                cell = Cell::new(" ");
                cell.set_bg(Color::Rgb(r, g, b));
                let gain = cell_colors.error - difference(look, cell_colors.look);
                if gain > 0.0 {
                    improved.push((gain, index));
                }
            }
            cells.push(cell);
        }
        (cells, improved)
    }

    fn select(&self, predicate: impl Fn(&CellColors) -> bool) -> Vec<(f32, usize)> {
        let cells = self.cells.iter().enumerate().filter(|(_, cell_colors)| predicate(cell_colors));
        cells.map(|(index, cell_colors)| (cell_colors.error, index)).collect()
    }
}

/// Returns the larger of two OKLab distances: between the upper halves and between the lower
/// halves.
fn difference(a: [Oklab; 2], b: [Oklab; 2]) -> f32 {
    a[0].distance(b[0]).max(a[1].distance(b[1]))
}

/// Converts a cell of a ratatui buffer to a [`PictureCell`].
fn picture_cell(cell: &Cell) -> PictureCell {
    let cell_color = |color| match color {
        Color::Rgb(r, g, b) => CellColor::Rgb([r, g, b]),
        Color::Indexed(index) => CellColor::Indexed(index),
        _ => CellColor::Plain,
    };
    let glyph = cell.symbol().chars().next().unwrap_or(' ');
    PictureCell { glyph, fg: cell_color(cell.fg), bg: cell_color(cell.bg) }
}
