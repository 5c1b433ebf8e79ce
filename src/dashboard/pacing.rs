//! Which of the wanted cells go out, and when.

use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use std::time::Duration;

/// Frames that answer nobody come no faster than this.
pub const FRAME_INTERVAL: Duration = Duration::from_millis(33);

/// What the terminal shows, beside what it ought to show.
#[derive(Debug)]
pub struct Pacing {
    shown: Buffer,
    /// Nothing is known of what the terminal shows: it has to be cleared.
    unknown: bool,
    last: Option<Duration>,
}

/// What a frame sends.
#[derive(Debug, PartialEq)]
pub struct Outgoing {
    /// The screen has to be cleared first.
    pub clear: bool,
    /// Column, row and contents of cells, row by row.
    pub cells: Vec<(u16, u16, Cell)>,
}

impl Pacing {
    /// For a terminal that shows nothing.
    pub fn new() -> Self {
        Self { shown: Buffer::empty(Rect::ZERO), unknown: true, last: None }
    }

    /// When the next frame may go out; `answers`: it shows what the user has just done, and so does
    /// not wait. `now` and the answer are times since the same moment.
    pub fn due(&self, now: Duration, answers: bool) -> Duration {
        match self.last {
            Some(last) if !answers => now.max(last + FRAME_INTERVAL),
            _ => now,
        }
    }

    /// The cells to send now, so that the terminal shows `wanted`.
    pub fn outgoing(&mut self, wanted: &Buffer, now: Duration) -> Outgoing {
        let clear = self.unknown || wanted.area != self.shown.area;
        if clear {
            self.shown = Buffer::empty(wanted.area);
        }
        let cells = self.shown.diff(wanted).into_iter().map(|(x, y, c)| (x, y, c.clone()));
        let cells = cells.collect();
        self.shown.clone_from(wanted);
        self.unknown = false;
        self.last = Some(now);
        Outgoing { clear, cells }
    }

    /// From now on nothing is known of what the terminal shows.
    pub fn forget(&mut self) {
        self.unknown = true;
    }
}

impl Default for Pacing {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(n: u64) -> Duration {
        Duration::from_millis(n)
    }

    #[test]
    fn only_what_differs_goes_out() {
        let mut pacing = Pacing::new();
        let mut wanted = Buffer::empty(Rect::new(0, 0, 4, 2));
        wanted.set_string(1, 1, "ab", ratatui::style::Style::new());
        let first = pacing.outgoing(&wanted, ms(0));
        assert!(first.clear);
        let places: Vec<_> = first.cells.iter().map(|(x, y, c)| (*x, *y, c.symbol())).collect();
        assert_eq!(places, [(1, 1, "a"), (2, 1, "b")]);
        assert_eq!(pacing.outgoing(&wanted, ms(1)), Outgoing { clear: false, cells: vec![] });
        wanted[(2, 1)].set_symbol("c");
        let third = pacing.outgoing(&wanted, ms(2));
        assert_eq!((third.clear, third.cells.len()), (false, 1));
        pacing.forget();
        let again = pacing.outgoing(&wanted, ms(3));
        assert_eq!((again.clear, again.cells.len()), (true, 2));
        let resized = pacing.outgoing(&Buffer::empty(Rect::new(0, 0, 5, 2)), ms(4));
        assert_eq!(resized, Outgoing { clear: true, cells: vec![] });
    }

    #[test]
    fn only_answers_come_at_once() {
        let mut pacing = Pacing::new();
        assert_eq!(pacing.due(ms(5), false), ms(5));
        pacing.outgoing(&Buffer::empty(Rect::new(0, 0, 1, 1)), ms(5));
        assert_eq!(pacing.due(ms(6), true), ms(6));
        assert_eq!(pacing.due(ms(6), false), ms(5) + FRAME_INTERVAL);
        assert_eq!(pacing.due(ms(90), false), ms(90));
    }
}
