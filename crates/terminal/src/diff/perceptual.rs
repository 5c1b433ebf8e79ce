//! Perceptual difference between the terminal and the target frame, in the cells of the picture.

use crate::cells::{Oklab, PictureCell, level};
use crate::diff::{TargetFrame, position};
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;
use std::collections::HashMap;

/// Difference that a cell with unknown contents has: more than that between black and white.
const UNKNOWN: f32 = 2.0;

/// Target and shown colours of one cell of the picture.
#[derive(Clone, Copy, Debug, Default)]
struct CellColors {
    /// Cell of the target frame; `None` where text covers the picture.
    target: Option<PictureCell>,
    /// Colours of the quarters of the target cell.
    quarters: [Oklab; 4],
    /// Colours of the quarters on the terminal; `None` if unknown.
    shown: Option<[Oklab; 4]>,
    /// `true` if a difference may count as visible: from a comparison of all cells on, until the
    /// cell is sent exactly or its difference is invisible.
    counts: bool,
    /// OKLab difference; 0 if the cells are equal.
    error: f32,
    visible: bool,
}

/// Differences of all cells in the area of the picture.
#[derive(Debug, Default)]
pub struct PerceptualDiff {
    pub area: Rect,
    /// Colours of the cells, row by row.
    cells: Vec<CellColors>,
}

impl PerceptualDiff {
    /// Marks the contents of the terminal as unknown.
    pub fn forget(&mut self) {
        self.area = Rect::ZERO;
        self.cells.clear();
    }

    /// Sets the area of the picture. The contents of a new area are unknown.
    pub fn fit(&mut self, area: Rect) {
        if self.area != area {
            self.area = area;
            let unknown = CellColors { counts: true, ..CellColors::default() };
            let count = usize::from(area.width) * usize::from(area.height);
            self.cells = vec![unknown; count];
        }
    }

    /// Compares the target with the contents `shown` of the terminal, and marks cells as visible
    /// whose difference is above `threshold`. Unless `is_due`, only cells whose `counts` is `true`
    /// are considered.
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
            let picture = PictureCell::from(cell);
            if cell_colors.target != Some(picture) {
                cell_colors.target = Some(picture);
                cell_colors.quarters = picture.quarters();
            }
            if *cell == shown[cell_position] {
                (cell_colors.shown, cell_colors.counts) = (Some(cell_colors.quarters), false);
                continue;
            }
            cell_colors.error =
                cell_colors.shown.map_or(UNKNOWN, |shown| difference(shown, cell_colors.quarters));
            cell_colors.counts &= cell_colors.error > threshold;
            cell_colors.visible = cell_colors.counts;
            // Cells with equal colours but different contents are sent last.
            cell_colors.error = cell_colors.error.max(f32::MIN_POSITIVE);
        }
    }

    /// Records that text covers cell `index`.
    pub fn covered(&mut self, index: usize) {
        if let Some(cell_colors) = self.cells.get_mut(index) {
            (cell_colors.shown, cell_colors.counts) = (None, true);
        }
    }

    /// Records that the terminal shows `cell`, which is the target cell if `exact` is `true`.
    pub fn sent(&mut self, index: usize, cell: &Cell, exact: bool) {
        let cell_colors = &mut self.cells[index];
        let shown = PictureCell::from(cell).quarters();
        cell_colors.shown = Some(shown);
        (cell_colors.counts, cell_colors.visible) = (!exact, !exact);
        cell_colors.error = if exact {
            0.0
        } else {
            difference(shown, cell_colors.quarters).max(f32::MIN_POSITIVE)
        };
    }

    /// Returns `(difference, index)` of each cell with a visible difference.
    pub fn visible(&self) -> Vec<(f32, usize)> {
        self.select(|cell_colors| cell_colors.visible)
    }

    /// Returns `(difference, index)` of each cell with an invisible difference.
    pub fn hidden(&self) -> Vec<(f32, usize)> {
        self.select(|cell_colors| !cell_colors.visible && cell_colors.error > 0.0)
    }

    /// Creates a mosaic of the target in the cells with a visible difference: blocks of `side` x
    /// `side` half cells (`side` is even) in their mean colours in linear light. Also returns
    /// `(gain, index)` of each cell that the mosaic brings closer to the target; the gain is a fall
    /// of OKLab distance.
    pub fn coarse(&self, target: &TargetFrame, side: usize) -> (Vec<Cell>, Vec<(f32, usize)>) {
        let width = usize::from(self.area.width);
        let block = |index: usize| (index % width / side, index / width / (side / 2));
        let light = |cell_colors: &CellColors| {
            cell_colors.target.filter(PictureCell::is_24_bit).map(|cell| cell.light())
        };
        // Sums in linear light, and numbers of quarters of cells.
        let mut blocks: HashMap<_, ([f32; 3], f32)> = HashMap::new();
        for (index, cell_colors) in self.cells.iter().enumerate() {
            for quarter in light(cell_colors).into_iter().flatten() {
                let (sum, count) = blocks.entry(block(index)).or_default();
                (0..3).for_each(|c| sum[c] += quarter[c]);
                *count += 1.0;
            }
        }
        let mut cells: Vec<Cell> = Vec::with_capacity(self.cells.len());
        let mut improved = Vec::new();
        for (index, cell_colors) in self.cells.iter().enumerate() {
            let mut cell = target.cells[position(self.area, index)].clone();
            if cell_colors.visible && light(cell_colors).is_some() {
                let (sum, count) = blocks[&block(index)];
                let [r, g, b] = sum.map(|sum| level(sum / count));
                let quarters = [Oklab::of([r, g, b]); 4];
                cell = Cell::new(" ");
                cell.set_bg(Color::Rgb(r, g, b));
                let gain = cell_colors.error - difference(quarters, cell_colors.quarters);
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

/// Returns the largest of the distances between quarters.
fn difference(a: [Oklab; 4], b: [Oklab; 4]) -> f32 {
    let squares = (0..4).map(|i| a[i].distance_squared(b[i]));
    squares.fold(0.0, f32::max).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_means_of_linear_light() {
        let area = Rect::new(0, 0, 3, 1);
        let mut cells = Buffer::empty(area);
        for (x, fg, bg) in [(0, 255, 0), (1, 0, 0), (2, 255, 255)] {
            cells[(x, 0)]
                .set_char('▀')
                .set_fg(Color::Rgb(fg, fg, fg))
                .set_bg(Color::Rgb(bg, bg, bg));
        }
        let uncovered = [true; 3];
        let target = TargetFrame {
            cells: &cells,
            cursor: None,
            picture: area,
            uncovered: &uncovered,
            subject: 0,
            version: 0,
            samples: 1.0,
            settled: false,
        };
        let mut difference = PerceptualDiff::default();
        difference.fit(area);
        difference.compare(&target, &Buffer::empty(area), true, 0.01);
        let (cells, _) = difference.coarse(&target, 2);
        // The mean of one white and three black half cells is a linear light of 0.25, which is the
        // 8-bit level 137.
        let levels = [137, 137, 255].map(|level| Color::Rgb(level, level, level));
        assert_eq!([0, 1, 2].map(|x| cells[x].bg), levels);
    }
}
