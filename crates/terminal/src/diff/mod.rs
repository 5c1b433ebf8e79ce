//! Frame difference: selects the cells that the next frame sends to the terminal.
//!
//! Text is sent first, row by row. Cells of the picture with a visible difference follow, the
//! largest difference first, within the byte budget of the frame. A new picture that does not fit
//! is first sent as a mosaic of coarse blocks. While samples accumulate, all cells are compared
//! only when the number of samples per pixel has grown by a factor of 2^(1/4), or, from 64 samples
//! on, of 2^(1/2). Invisible differences are sent when the connection is idle.

mod encode;
mod perceptual;
#[cfg(test)]
mod tests;

use crate::flow::FrameBudget;
pub use encode::Encoder;
use perceptual::PerceptualDiff;
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::{Position, Rect};
use std::time::Duration;

/// Bytes of each frame that are reserved for everything except cells.
const FRAME_OVERHEAD: usize = 64;
/// Time without a change of the picture after which invisible differences are sent.
const IDLE: Duration = Duration::from_secs(2);

/// Contents that the terminal should show.
#[derive(Clone, Copy, Debug)]
pub struct TargetFrame<'a> {
    /// All cells of the screen.
    pub cells: &'a Buffer,
    /// Position of the text cursor; `None` hides it.
    pub cursor: Option<Position>,
    /// Area of the picture; may be empty.
    pub picture: Rect,
    /// Row-major mask of the picture's area: `false` if text covers a cell.
    pub uncovered: &'a [bool],
    /// Number that increases when the picture shows something else, but not when it has more
    /// samples.
    pub subject: u64,
    /// Number that increases when the picture may have changed for any reason.
    pub version: u64,
    /// Mean number of samples per pixel of the picture.
    pub samples: f64,
    /// `true` if the picture changes rarely or only by user input.
    pub settled: bool,
}

/// Summary of an encoded frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// `true` if the frame contains cells of the picture, or was encoded without a byte limit.
    pub picture: bool,
    /// Number of bytes that encode invisible differences.
    pub flushed: usize,
}

/// Differences that remain to be sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pending {
    pub text: bool,
    pub visible: bool,
    /// Earliest time at which invisible differences may be sent; `None` if there are none.
    pub hidden: Option<Duration>,
}

/// Difference between a target frame and the contents of the terminal, which are unknown at first.
#[derive(Debug, Default)]
pub struct FrameDiff {
    /// Contents of the terminal; an empty buffer if they are unknown.
    shown: Buffer,
    cursor: Option<Position>,
    encoder: Encoder,
    picture_diff: PerceptualDiff,
    subject: Option<u64>,
    /// `true` until cells of a new picture have been sent, exactly or as a mosaic.
    fresh: bool,
    /// Samples per pixel from which on all cells are compared again. Until then, only cells that
    /// still differ visibly are compared.
    next_samples: f64,
    version: u64,
    /// Time of the last change of `version`.
    version_at: Duration,
    /// Differences that remain after the last frame.
    pub pending: Pending,
}

impl FrameDiff {
    /// Records that other output has moved the cursor.
    pub fn moved(&mut self) {
        self.encoder.moved();
    }

    /// Records that an image has overwritten the cells of `area`, which count as equal to `cell`.
    pub fn overwritten(&mut self, area: Rect, cell: &Cell) {
        let picture = self.picture_diff.area;
        for at in area.intersection(self.shown.area).positions() {
            self.shown[at] = cell.clone();
            if picture.contains(at) {
                let row = usize::from(at.y - picture.y) * usize::from(picture.width);
                self.picture_diff.covered(row + usize::from(at.x - picture.x));
            }
        }
    }

    /// Records that other output has reset colours and attributes, and moved the cursor.
    pub fn pen_reset(&mut self) {
        self.moved();
        self.encoder.pen_reset();
    }

    /// Appends the bytes of the next frame to `out`, within `allowance`. Appends nothing if the
    /// terminal shows `target` already. OKLab differences up to `threshold` are invisible.
    pub fn frame(
        &mut self,
        target: &TargetFrame,
        now: Duration,
        allowance: FrameBudget,
        threshold: f32,
        out: &mut Vec<u8>,
    ) -> Frame {
        if target.cells.area != self.shown.area {
            self.shown = Buffer::empty(target.cells.area);
            self.encoder = Encoder::new(target.cells.area.width);
            self.encoder.clear(out);
            self.picture_diff.forget();
        }
        if self.cursor.is_some() {
            out.extend(b"\x1b[?25l");
        }
        let before = out.len();
        let mut frame = Frame { picture: true, flushed: 0 };
        if allowance.bytes == usize::MAX {
            self.send_all(target, out);
        } else {
            let room = allowance.bytes.saturating_sub(FRAME_OVERHEAD);
            self.pending.text = !self.send_text(target, room, out);
            let room = room.saturating_sub(out.len());
            self.compare(target, now, threshold);
            frame = self.send_picture(target, now, FrameBudget { bytes: room, ..allowance }, out);
        }
        if out.len() == before && target.cursor == self.cursor {
            // The sequence that hides the cursor has 6 bytes.
            out.truncate(if self.cursor.is_some() { before - 6 } else { before });
            return frame;
        }
        if let Some(Position { x, y }) = target.cursor {
            self.encoder.go(out, x, y);
            out.extend(b"\x1b[?25h");
        }
        self.cursor = target.cursor;
        frame
    }

    /// Appends every cell that differs.
    fn send_all(&mut self, target: &TargetFrame, out: &mut Vec<u8>) {
        for (x, y, cell) in self.shown.diff_iter(target.cells) {
            self.encoder.cell(out, x, y, cell);
        }
        self.shown.clone_from(target.cells);
        self.pending = Pending::default();
    }

    /// Appends the rows of text that differ, as many as fit into `room` bytes, but at least one.
    /// Returns `true` if none remain.
    fn send_text(&mut self, target: &TargetFrame, room: usize, out: &mut Vec<u8>) -> bool {
        let differences = self.shown.diff(target.cells);
        let text = differences.into_iter().filter(|(x, y, _)| !target.shows_picture(*x, *y));
        let text: Vec<_> = text.collect();
        let start = out.len();
        for row in text.chunk_by(|a, b| a.1 == b.1) {
            let (mut encoder, length) = (self.encoder.clone(), out.len());
            for (x, y, cell) in row {
                encoder.cell(out, *x, *y, cell);
            }
            if out.len() > room && length > start {
                out.truncate(length);
                return false;
            }
            self.encoder = encoder;
            for (x, y, cell) in row {
                // A wide character covers the next cell.
                let width = unicode_width::UnicodeWidthStr::width(cell.symbol()).max(1) as u16;
                for x in (*x..x.saturating_add(width)).take_while(|x| *x < target.cells.area.width)
                {
                    self.shown[(x, *y)] = target.cells[(x, *y)].clone();
                    if let Some(index) = target.index(x, *y) {
                        self.picture_diff.covered(index);
                    }
                }
            }
        }
        true
    }

    /// Compares the picture of the target frame with the contents of the terminal.
    fn compare(&mut self, target: &TargetFrame, now: Duration, threshold: f32) {
        if self.version != target.version {
            (self.version, self.version_at) = (target.version, now);
        }
        self.picture_diff.fit(target.picture);
        if self.subject != Some(target.subject) {
            self.subject = Some(target.subject);
            self.fresh = true;
            self.next_samples = 0.0;
        }
        let is_due = target.samples >= self.next_samples || target.settled;
        if is_due {
            let power = if target.samples < 64.0 { 0.25 } else { 0.5 };
            self.next_samples = target.samples * 2f64.powf(power);
        }
        self.picture_diff.compare(target, &self.shown, is_due, threshold);
    }

    /// Appends as many cells of the picture as fit into `allowance`, the largest difference first.
    fn send_picture(
        &mut self,
        target: &TargetFrame,
        now: Duration,
        allowance: FrameBudget,
        out: &mut Vec<u8>,
    ) -> Frame {
        let area = target.picture;
        let mut visible = self.picture_diff.visible();
        let idle_at = if target.settled { now } else { self.version_at + IDLE };
        let mut frame = Frame::default();
        self.pending.visible = !visible.is_empty();
        self.fresh &= self.pending.visible;
        if !visible.is_empty() && allowance.picture {
            let count = visible.len();
            let exact = |index: usize| &target.cells[position(area, index)];
            let mut part = self.fitting(area, &mut visible, allowance.bytes, exact);
            if std::mem::take(&mut self.fresh) && part.cells.len() < count {
                for side in [2, 4, 8, 16] {
                    let (cells, mut order) = self.picture_diff.coarse(target, side);
                    let coarse = |index: usize| &cells[index];
                    let all = order.len();
                    let blocks = self.fitting(area, &mut order, allowance.bytes, coarse);
                    let fits = blocks.cells.len() == all;
                    if all > 0 && (fits || side == 16) {
                        part = blocks;
                    }
                    if fits {
                        break;
                    }
                }
            }
            frame.picture = !part.cells.is_empty();
            self.send(target, part, out);
            self.pending.visible = !self.picture_diff.visible().is_empty();
        } else if visible.is_empty()
            && allowance.picture
            && idle_at <= now
            && allowance.refinement > 0
        {
            let mut hidden = self.picture_diff.hidden();
            let exact = |index: usize| &target.cells[position(area, index)];
            let room = allowance.refinement.min(allowance.bytes);
            let part = self.fitting(area, &mut hidden, room, exact);
            frame = Frame { picture: !part.cells.is_empty(), flushed: part.bytes.len() };
            self.send(target, part, out);
        }
        let has_hidden = !self.picture_diff.hidden().is_empty();
        self.pending.hidden = has_hidden.then_some(idle_at);
        frame
    }

    /// Encodes as many cells as fit into `room` bytes, the largest differences first. `order` has
    /// the difference and index of each cell; `cell` returns the contents by index.
    fn fitting<'a>(
        &self,
        area: Rect,
        order: &mut [(f32, usize)],
        room: usize,
        cell: impl Fn(usize) -> &'a Cell,
    ) -> Part {
        // Equal differences are ordered by index, so that equal input gives equal frames.
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let encoded = |count: usize| {
            let mut indices: Vec<_> = order[..count].iter().map(|(_, index)| *index).collect();
            indices.sort_unstable();
            let (mut encoder, mut bytes) = (self.encoder.clone(), Vec::new());
            let mut cells = Vec::with_capacity(count);
            for index in indices {
                let Position { x, y } = position(area, index);
                encoder.cell(&mut bytes, x, y, cell(index));
                cells.push((index, cell(index).clone()));
            }
            Part { bytes, encoder, cells }
        };
        let mut best = Part { bytes: Vec::new(), encoder: self.encoder.clone(), cells: Vec::new() };
        let mut count = order.len();
        // The next count assumes equal bytes for every cell. It is rarely too low, because the
        // cells of a smaller selection are farther apart and need more bytes each.
        while count > 0 {
            let part = encoded(count);
            if part.bytes.len() <= room {
                best = part;
                break;
            }
            count = (count * room / part.bytes.len()).min(count - 1);
        }
        // A second estimate uses more of `room`.
        if best.cells.len() < order.len() && 10 * best.bytes.len() < 9 * room {
            let estimate = best.cells.len() * room / best.bytes.len().max(1);
            let part = encoded((estimate - estimate / 50).clamp(best.cells.len(), order.len()));
            if part.bytes.len() <= room {
                best = part;
            }
        }
        best
    }

    fn send(&mut self, target: &TargetFrame, part: Part, out: &mut Vec<u8>) {
        out.extend(&part.bytes);
        self.encoder = part.encoder;
        for (index, cell) in part.cells {
            let cell_position = position(target.picture, index);
            let is_exact = cell == target.cells[cell_position];
            self.picture_diff.sent(index, &cell, is_exact);
            self.shown[cell_position] = cell;
        }
    }
}

/// Encoded cells that fit into a frame.
struct Part {
    bytes: Vec<u8>,
    /// State of the encoder after these bytes.
    encoder: Encoder,
    cells: Vec<(usize, Cell)>,
}

impl TargetFrame<'_> {
    /// Returns the index of a cell within the area of the picture; `None` outside the area.
    fn index(&self, x: u16, y: u16) -> Option<usize> {
        let area = self.picture;
        let inside = area.contains(Position { x, y });
        inside.then(|| usize::from(y - area.y) * usize::from(area.width) + usize::from(x - area.x))
    }

    fn shows_picture(&self, x: u16, y: u16) -> bool {
        self.index(x, y).is_some_and(|index| self.uncovered.get(index).copied().unwrap_or(false))
    }
}

/// Returns the position of cell `index` of `area`, row by row.
fn position(area: Rect, index: usize) -> Position {
    let width = usize::from(area.width).max(1);
    Position { x: area.x + (index % width) as u16, y: area.y + (index / width) as u16 }
}
