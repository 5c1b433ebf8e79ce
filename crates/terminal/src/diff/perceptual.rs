//! Perceptual difference between the cells of the picture that the terminal shows and those of the
//! target frame.

use crate::cells::{Oklab, PictureCell, blocks};
use crate::diff::{TargetFrame, position};
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;

/// Perceptual difference of a cell with unknown contents. It is larger than that between black and
/// white, so that such cells are sent first.
const UNKNOWN: f32 = 2.0;

/// Target and shown colours of one cell of the picture.
#[derive(Clone, Copy, Debug, Default)]
struct CellColors {
    /// Cell of the target frame. `None` where text covers the picture.
    target: Option<PictureCell>,
    /// OKLab colours of the upper and the lower half of the target cell.
    look: [Oklab; 2],
    /// Colours of the upper and the lower half of the cell that the terminal shows. `None` if
    /// unknown.
    shown: Option<[Oklab; 2]>,
    /// `true` if the difference of this cell may count as visible. The value becomes `false` when
    /// the cell is sent exactly or its difference becomes invisible. It becomes `true` again at the
    /// next full comparison.
    counts: bool,
    /// OKLab difference between target and shown cell; 0 if they are equal.
    error: f32,
    /// `true` if the difference between target and shown cell is visible.
    visible: bool,
}

/// Perceptual differences between the target frame and the terminal, for all cells in the area of
/// the picture.
#[derive(Debug, Default)]
pub struct PerceptualDiff {
    area: Rect,
    /// Colours of the cells in the picture's area, row by row.
    cells: Vec<CellColors>,
}

impl PerceptualDiff {
    /// Marks the contents of the terminal in the picture's area as unknown, so that all cells are
    /// sent again.
    pub fn forget(&mut self) {
        self.area = Rect::ZERO;
        self.cells.clear();
    }

    /// Sets the rectangle of the screen in which the picture is. A new rectangle has unknown
    /// contents.
    pub fn fit(&mut self, area: Rect) {
        if self.area != area {
            self.area = area;
            let unknown = CellColors { counts: true, ..CellColors::default() };
            let count = usize::from(area.width) * usize::from(area.height);
            self.cells = vec![unknown; count];
        }
    }

    /// Compares the shown cells with the target frame and marks the cells with a visible
    /// difference, that is, one above `threshold`. If `is_due` is `true`, this is a full
    /// comparison, which considers all cells. Otherwise it considers only cells whose `counts` is
    /// `true`.
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
            // Cells that differ in their contents but not in their colours get the smallest
            // positive error, so that they are sent last.
            cell_colors.error = cell_colors.error.max(f32::MIN_POSITIVE);
        }
    }

    /// Records that text now covers cell `index` of the picture's area.
    pub fn covered(&mut self, index: usize) {
        if let Some(cell_colors) = self.cells.get_mut(index) {
            (cell_colors.shown, cell_colors.counts) = (None, true);
        }
    }

    /// Records that the terminal now shows `cell` at position `index` of the picture's area.
    /// `exact` is `true` if `cell` equals the target.
    pub fn sent(&mut self, index: usize, cell: &Cell, exact: bool) {
        let cell_colors = &mut self.cells[index];
        let shown = picture_cell(cell).halves();
        cell_colors.shown = Some(shown);
        (cell_colors.counts, cell_colors.visible) = (!exact, !exact);
        cell_colors.error =
            if exact { 0.0 } else { difference(shown, cell_colors.look).max(f32::MIN_POSITIVE) };
    }

    /// Returns `(OKLab difference, index)` of each cell whose difference between target and
    /// terminal is visible.
    pub fn visible(&self) -> Vec<(f32, usize)> {
        self.select(|cell_colors| cell_colors.visible)
    }

    /// Returns `(OKLab difference, index)` of each cell whose difference between target and
    /// terminal is invisible, but not 0.
    pub fn hidden(&self) -> Vec<(f32, usize)> {
        self.select(|cell_colors| !cell_colors.visible && cell_colors.error > 0.0)
    }

    /// Creates a mosaic of the target: blocks of `side` x `side` half cells, each block of one
    /// colour. A half cell is the upper or lower half of a cell. Returns `(cells, improved)`.
    /// `cells` has all cells of the picture. A cell with a visible difference shows the mosaic;
    /// every other cell equals the target. `improved` has `(gain, index)` for each mosaic cell that
    /// is closer to the target than the cell on the terminal. The gain is the decrease in OKLab
    /// distance from the target.
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

/// Returns the perceptual difference of two cells: the larger of the OKLab distances between their
/// upper halves and between their lower halves.
fn difference(a: [Oklab; 2], b: [Oklab; 2]) -> f32 {
    a[0].distance(b[0]).max(a[1].distance(b[1]))
}

/// Converts a cell of a ratatui buffer to a [`PictureCell`].
fn picture_cell(cell: &Cell) -> PictureCell {
    let glyph = cell.symbol().chars().next().unwrap_or(' ');
    PictureCell { glyph, fg: cell.fg, bg: cell.bg }
}
