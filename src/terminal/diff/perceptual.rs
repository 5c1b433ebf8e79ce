//! How the cells of the picture look, as they are shown and as they ought to be.

use crate::terminal::cells::{CellColor, Oklab, PictureCell, blocks};
use crate::terminal::diff::{TargetFrame, position};
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use ratatui::style::Color;

/// How different a cell is of which nothing is known: more than black and white.
const UNKNOWN: f32 = 2.0;

/// One cell of the picture.
#[derive(Clone, Copy, Debug)]
struct CellColors {
    /// What ought to be there; `None`: something that is not the picture.
    wanted: Option<PictureCell>,
    look: [Oklab; 2],
    /// How what is there looks; `None`: it is not known.
    shown: Option<[Oklab; 2]>,
    /// A difference in it counts: it was looked for after the samples had become so many.
    counts: bool,
    /// How different it is from what ought to be there; 0: not at all.
    error: f32,
    /// The difference can be seen.
    visible: bool,
}

/// The cells of the picture's area, row by row.
#[derive(Debug, Default)]
pub struct PerceptualDiff {
    area: Rect,
    cells: Vec<CellColors>,
}

impl PerceptualDiff {
    /// Nothing is known of what is shown.
    pub fn forget(&mut self) {
        self.area = Rect::ZERO;
        self.cells.clear();
    }

    /// The picture is here now.
    pub fn fit(&mut self, area: Rect) {
        if self.area != area {
            self.area = area;
            let black = Oklab { l: 0.0, a: 0.0, b: 0.0 };
            let unknown = CellColors {
                wanted: None,
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

    /// Compares what is shown with what ought to be. `look_again`: every difference counts.
    pub fn compare(
        &mut self,
        wanted: &TargetFrame,
        shown: &Buffer,
        look_again: bool,
        threshold: f32,
    ) {
        for (at, seen) in self.cells.iter_mut().enumerate() {
            let place = position(self.area, at);
            let cell = &wanted.cells[place];
            (seen.error, seen.visible) = (0.0, false);
            seen.counts |= look_again;
            if !wanted.uncovered.get(at).copied().unwrap_or(false) {
                seen.wanted = None;
                continue;
            }
            let picture = picture_cell(cell);
            if seen.wanted != Some(picture) {
                seen.wanted = Some(picture);
                seen.look = picture.halves();
            }
            if *cell == shown[place] {
                (seen.shown, seen.counts) = (Some(seen.look), false);
                continue;
            }
            seen.error = seen.shown.map_or(UNKNOWN, |shown| difference(shown, seen.look));
            seen.counts &= seen.error > threshold;
            seen.visible = seen.counts;
            // Equal looks, other cells: still to be told apart from what need not be sent.
            seen.error = seen.error.max(f32::MIN_POSITIVE);
        }
    }

    /// Something else than the picture is shown there now.
    pub fn covered(&mut self, at: usize) {
        if let Some(seen) = self.cells.get_mut(at) {
            (seen.shown, seen.counts) = (None, true);
        }
    }

    /// `cell` is shown there now; `exact`: as it ought to be.
    pub fn sent(&mut self, at: usize, cell: &Cell, exact: bool) {
        let seen = &mut self.cells[at];
        let shown = picture_cell(cell).halves();
        seen.shown = Some(shown);
        (seen.counts, seen.visible) = (!exact, !exact);
        seen.error = if exact { 0.0 } else { difference(shown, seen.look).max(f32::MIN_POSITIVE) };
    }

    /// Errors and numbers of the cells whose differences can be seen.
    pub fn visible(&self) -> Vec<(f32, usize)> {
        self.those(|seen| seen.visible)
    }

    /// The same for all others that are not exact.
    pub fn hidden(&self) -> Vec<(f32, usize)> {
        self.those(|seen| !seen.visible && seen.error > 0.0)
    }

    /// Whether differences can be seen.
    pub fn has_visible(&self) -> bool {
        self.cells.iter().any(|seen| seen.visible)
    }

    /// Whether there are differences that cannot be seen.
    pub fn has_hidden(&self) -> bool {
        self.cells.iter().any(|seen| !seen.visible && seen.error > 0.0)
    }

    /// The picture in blocks of `side` x `side` half cells: its cells, and of those that look more like
    /// the picture than what is shown, by how much, and the number.
    pub fn coarse(&self, wanted: &TargetFrame, side: usize) -> (Vec<Cell>, Vec<(f32, usize)>) {
        let width = usize::from(self.area.width);
        let rows = usize::from(self.area.height);
        let mut halves = vec![None; 2 * width * rows];
        for (at, seen) in self.cells.iter().enumerate() {
            let Some([upper, lower]) = seen.wanted.and_then(|cell| cell.colors()) else { continue };
            let (x, y) = (at % width, at / width);
            halves[2 * y * width + x] = Some(upper);
            halves[(2 * y + 1) * width + x] = Some(lower);
        }
        let blocks = blocks(&halves, width, side);
        let mut cells: Vec<Cell> = Vec::with_capacity(self.cells.len());
        let mut better = Vec::new();
        for (at, seen) in self.cells.iter().enumerate() {
            let (x, y) = (at % width, at / width);
            let mean = blocks[2 * y * width + x];
            let mut cell = wanted.cells[position(self.area, at)].clone();
            if let (Some([r, g, b]), true) = (mean, seen.visible) {
                let look = [Oklab::of([r, g, b]); 2];
                cell = Cell::new(" ");
                cell.set_bg(Color::Rgb(r, g, b));
                let gain = seen.error - difference(look, seen.look);
                if gain > 0.0 {
                    better.push((gain, at));
                }
            }
            cells.push(cell);
        }
        (cells, better)
    }

    fn those(&self, which: impl Fn(&CellColors) -> bool) -> Vec<(f32, usize)> {
        let cells = self.cells.iter().enumerate().filter(|(_, seen)| which(seen));
        cells.map(|(at, seen)| (seen.error, at)).collect()
    }
}

/// The larger of the differences of the two halves.
fn difference(a: [Oklab; 2], b: [Oklab; 2]) -> f32 {
    a[0].distance(b[0]).max(a[1].distance(b[1]))
}

/// A cell that was made from one of the picture.
fn picture_cell(cell: &Cell) -> PictureCell {
    let ink = |color| match color {
        Color::Rgb(r, g, b) => CellColor::Rgb([r, g, b]),
        Color::Indexed(index) => CellColor::Indexed(index),
        _ => CellColor::Plain,
    };
    let glyph = cell.symbol().chars().next().unwrap_or(' ');
    PictureCell { glyph, fg: ink(cell.fg), bg: ink(cell.bg) }
}
