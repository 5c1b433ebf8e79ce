//! Which of the wanted cells go out now.
//!
//! Text goes first, row by row. Of the picture a cell goes if the difference can be seen, the largest
//! difference first, as many as the frame may hold; what is so different at once that it does not fit
//! appears in coarse blocks before. More samples make differences worth looking for only when they
//! have become so many more that the picture is another one. What cannot be seen waits until nothing
//! else happens.

mod encode;
mod perceptual;
#[cfg(test)]
mod tests;

use crate::terminal::flow::FrameBudget;
pub use encode::Encoder;
use perceptual::PerceptualDiff;
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::{Position, Rect};
use std::time::Duration;

/// Bytes of a frame beside its cells: cursor, brackets, question.
const BESIDE_CELLS: usize = 64;
/// A picture that has not changed for so long is sent exactly.
const IDLE: Duration = Duration::from_secs(2);

/// What the terminal ought to show.
#[derive(Clone, Copy, Debug)]
pub struct TargetFrame<'a> {
    /// All of it.
    pub cells: &'a Buffer,
    /// Where text is being typed.
    pub cursor: Option<Position>,
    /// Where the picture is; may be empty.
    pub picture: Rect,
    /// Which cells of that area show it, row by row: nothing lies over them.
    pub uncovered: &'a [bool],
    /// Counts up when the picture is another one than the same with more samples.
    pub subject: u64,
    /// Counts up when the picture may be another one.
    pub version: u64,
    /// Samples per pixel.
    pub samples: f64,
    /// The picture will not change by itself.
    pub settled: bool,
}

/// What a frame was made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Frame {
    /// Parts of the picture.
    pub picture: bool,
    /// Bytes of differences that nobody sees.
    pub flushed: usize,
}

/// What is still to be sent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pending {
    /// Text.
    pub text: bool,
    /// Differences of the picture that can be seen.
    pub visible: bool,
    /// Differences that cannot be seen, if there are any: when they may be sent.
    pub hidden: Option<Duration>,
}

/// What the terminal shows, beside what it ought to show.
#[derive(Debug)]
pub struct FrameDiff {
    shown: Buffer,
    /// Nothing is known of what the terminal shows: it has to be cleared.
    unknown: bool,
    cursor: Option<Position>,
    encoder: Encoder,
    sight: PerceptualDiff,
    subject: Option<u64>,
    /// The picture as it is now has not been shown in any form.
    fresh: bool,
    /// With so many samples differences are looked for again.
    next_samples: f64,
    version: u64,
    /// When the version came.
    since: Duration,
    rest: Pending,
}

impl FrameDiff {
    /// For a terminal that shows nothing.
    pub fn new() -> Self {
        Self {
            shown: Buffer::empty(Rect::ZERO),
            unknown: true,
            cursor: None,
            encoder: Encoder::new(0),
            sight: PerceptualDiff::default(),
            subject: None,
            fresh: true,
            next_samples: 0.0,
            version: 0,
            since: Duration::ZERO,
            rest: Pending::default(),
        }
    }

    /// What the last frame has left.
    pub fn rest(&self) -> Pending {
        self.rest
    }

    /// Something else than a frame has moved the cursor.
    pub fn moved(&mut self) {
        self.encoder.moved();
    }

    /// Writes the next frame to `out`, which stays empty if there is nothing to send. Differences of at
    /// most `threshold`, in OKLab, cannot be seen.
    pub fn frame(
        &mut self,
        wanted: &TargetFrame,
        now: Duration,
        allowance: FrameBudget,
        threshold: f32,
        out: &mut Vec<u8>,
    ) -> Frame {
        if self.unknown || wanted.cells.area != self.shown.area {
            self.shown = Buffer::empty(wanted.cells.area);
            self.encoder = Encoder::new(wanted.cells.area.width);
            self.encoder.clear(out);
            self.sight.forget();
            self.unknown = false;
        }
        if self.cursor.is_some() {
            out.extend(b"\x1b[?25l");
        }
        let before = out.len();
        let mut frame = Frame { picture: true, flushed: 0 };
        if allowance.bytes == usize::MAX {
            self.everything(wanted, out);
        } else {
            let room = allowance.bytes.saturating_sub(BESIDE_CELLS);
            self.rest.text = !self.text(wanted, room, out);
            let room = room.saturating_sub(out.len());
            self.look_for(wanted, now, threshold);
            frame = self.picture(wanted, now, FrameBudget { bytes: room, ..allowance }, out);
        }
        if out.len() == before && wanted.cursor == self.cursor {
            // The cursor was hidden for nothing.
            out.truncate(if self.cursor.is_some() { before - 6 } else { before });
            return frame;
        }
        if let Some(Position { x, y }) = wanted.cursor {
            self.encoder.go(out, x, y);
            out.extend(b"\x1b[?25h");
        }
        self.cursor = wanted.cursor;
        frame
    }

    /// Every cell that differs.
    fn everything(&mut self, wanted: &TargetFrame, out: &mut Vec<u8>) {
        for (x, y, cell) in self.shown.diff_iter(wanted.cells) {
            self.encoder.cell(out, x, y, cell);
        }
        self.shown.clone_from(wanted.cells);
        self.rest = Pending::default();
    }

    /// Rows of text that differ, as many as there is room for, but one; whether that was all.
    fn text(&mut self, wanted: &TargetFrame, room: usize, out: &mut Vec<u8>) -> bool {
        let differences = self.shown.diff(wanted.cells);
        let text = differences.into_iter().filter(|(x, y, _)| !wanted.shows_picture(*x, *y));
        let text: Vec<_> = text.collect();
        let begun = out.len();
        for row in text.chunk_by(|a, b| a.1 == b.1) {
            let (mut encoder, length) = (self.encoder.clone(), out.len());
            for (x, y, cell) in row {
                encoder.cell(out, *x, *y, cell);
            }
            if out.len() > room && length > begun {
                out.truncate(length);
                return false;
            }
            self.encoder = encoder;
            for (x, y, cell) in row {
                // A wide character takes the cells beside it as well.
                let width = unicode_width::UnicodeWidthStr::width(cell.symbol()).max(1) as u16;
                for x in (*x..x.saturating_add(width)).take_while(|x| *x < wanted.cells.area.width)
                {
                    self.shown[(x, *y)] = wanted.cells[(x, *y)].clone();
                    if let Some(at) = wanted.place(x, *y) {
                        self.sight.covered(at);
                    }
                }
            }
        }
        true
    }

    /// Takes note of what the picture ought to look like.
    fn look_for(&mut self, wanted: &TargetFrame, now: Duration, threshold: f32) {
        if self.version != wanted.version {
            (self.version, self.since) = (wanted.version, now);
        }
        self.sight.fit(wanted.picture);
        if self.subject != Some(wanted.subject) {
            self.subject = Some(wanted.subject);
            self.fresh = true;
            self.next_samples = 0.0;
        }
        let look_again = wanted.samples >= self.next_samples || wanted.settled;
        if look_again {
            let power = if wanted.samples < 64.0 { 0.25 } else { 0.5 };
            self.next_samples = wanted.samples * 2f64.powf(power);
        }
        self.sight.compare(wanted, &self.shown, look_again, threshold);
    }

    /// Cells of the picture, as many as there is room for.
    fn picture(
        &mut self,
        wanted: &TargetFrame,
        now: Duration,
        allowance: FrameBudget,
        out: &mut Vec<u8>,
    ) -> Frame {
        let area = wanted.picture;
        let mut visible = self.sight.visible();
        let idle_at = if wanted.settled { now } else { self.since + IDLE };
        let mut frame = Frame::default();
        self.rest.visible = !visible.is_empty();
        self.fresh &= self.rest.visible;
        if !visible.is_empty() && allowance.picture {
            let all = visible.len();
            let exact = |at: usize| &wanted.cells[position(area, at)];
            let mut part = self.fitting(area, &mut visible, allowance.bytes, exact);
            if std::mem::take(&mut self.fresh) && part.cells.len() < all {
                for side in [2, 4, 8, 16] {
                    let (cells, mut order) = self.sight.coarse(wanted, side);
                    let coarse = |at: usize| &cells[at];
                    let whole = order.len();
                    let blocks = self.fitting(area, &mut order, allowance.bytes, coarse);
                    let fits = blocks.cells.len() == whole;
                    if whole > 0 && (fits || side == 16) {
                        part = blocks;
                    }
                    if fits {
                        break;
                    }
                }
            }
            frame.picture = !part.cells.is_empty();
            self.send(wanted, part, out);
            self.rest.visible = self.sight.has_visible();
        } else if visible.is_empty()
            && allowance.picture
            && idle_at <= now
            && allowance.refinement > 0
        {
            let mut hidden = self.sight.hidden();
            let exact = |at: usize| &wanted.cells[position(area, at)];
            let room = allowance.refinement.min(allowance.bytes);
            let part = self.fitting(area, &mut hidden, room, exact);
            frame = Frame { picture: !part.cells.is_empty(), flushed: part.bytes.len() };
            self.send(wanted, part, out);
        }
        self.rest.hidden = self.sight.has_hidden().then_some(idle_at);
        frame
    }

    /// The first of `order` that fit into `room` bytes.
    fn fitting<'a>(
        &self,
        area: Rect,
        order: &mut [(f32, usize)],
        room: usize,
        cell: impl Fn(usize) -> &'a Cell,
    ) -> Part {
        // Ties by place, so that frames do not depend on how they are sorted.
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let encoded = |count: usize| {
            let mut places: Vec<_> = order[..count].iter().map(|(_, at)| *at).collect();
            places.sort_unstable();
            let (mut encoder, mut bytes) = (self.encoder.clone(), Vec::new());
            let mut cells = Vec::with_capacity(count);
            for at in places {
                let Position { x, y } = position(area, at);
                encoder.cell(&mut bytes, x, y, cell(at));
                cells.push((at, cell(at).clone()));
            }
            Part { bytes, encoder, cells }
        };
        let mut best = Part { bytes: Vec::new(), encoder: self.encoder.clone(), cells: Vec::new() };
        let mut count = order.len();
        // Half of the cells takes more than half of the bytes: so it is found from above.
        while count > 0 {
            let part = encoded(count);
            if part.bytes.len() <= room {
                best = part;
                break;
            }
            count = (count * room / part.bytes.len()).min(count - 1);
        }
        // And then a little more from below.
        if best.cells.len() < order.len() && 10 * best.bytes.len() < 9 * room {
            let more = best.cells.len() * room / best.bytes.len().max(1);
            let part = encoded((more - more / 50).clamp(best.cells.len(), order.len()));
            if part.bytes.len() <= room {
                best = part;
            }
        }
        best
    }

    fn send(&mut self, wanted: &TargetFrame, part: Part, out: &mut Vec<u8>) {
        out.extend(&part.bytes);
        self.encoder = part.encoder;
        for (at, cell) in part.cells {
            let place = position(wanted.picture, at);
            let exact = cell == wanted.cells[place];
            self.sight.sent(at, &cell, exact);
            self.shown[place] = cell;
        }
    }
}

/// Cells of a frame.
struct Part {
    bytes: Vec<u8>,
    /// What the terminal knows after that.
    encoder: Encoder,
    cells: Vec<(usize, Cell)>,
}

impl TargetFrame<'_> {
    /// The number of a cell within the picture's area.
    fn place(&self, x: u16, y: u16) -> Option<usize> {
        let area = self.picture;
        let inside = area.contains(Position { x, y });
        inside.then(|| usize::from(y - area.y) * usize::from(area.width) + usize::from(x - area.x))
    }

    fn shows_picture(&self, x: u16, y: u16) -> bool {
        self.place(x, y).is_some_and(|at| self.uncovered.get(at).copied().unwrap_or(false))
    }
}

/// Where the cell with that number within `area` is.
fn position(area: Rect, at: usize) -> Position {
    let width = usize::from(area.width).max(1);
    Position { x: area.x + (at % width) as u16, y: area.y + (at / width) as u16 }
}

impl Default for FrameDiff {
    fn default() -> Self {
        Self::new()
    }
}
