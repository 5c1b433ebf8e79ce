use crate::diff::*;
use crate::flow::FrameBudget;
use ratatui::style::{Color, Style};
use std::num::NonZeroU16;

const AREA: Rect = Rect { x: 0, y: 0, width: 40, height: 12 };
const PICTURE: Rect = Rect { x: 2, y: 1, width: 30, height: 8 };
const THRESHOLD: f32 = 0.02;
const EVERYTHING: FrameBudget =
    FrameBudget { bytes: usize::MAX, picture: true, refinement: usize::MAX };

fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

fn within(bytes: usize) -> FrameBudget {
    FrameBudget { bytes, picture: true, refinement: bytes / 2 }
}

/// Screen with a picture, the frame difference that sends it in parts, and an emulated terminal
/// that receives the parts.
struct Fixture {
    diff: FrameDiff,
    cells: Buffer,
    uncovered: Vec<bool>,
    cursor: Option<Position>,
    subject: u64,
    version: u64,
    samples: f64,
    settled: bool,
    parser: vt100::Parser,
}

impl Fixture {
    fn new() -> Self {
        let [rows, columns] = [AREA.height, AREA.width].map(|n| NonZeroU16::new(n).unwrap());
        let mut fixture = Self {
            diff: FrameDiff::default(),
            cells: Buffer::empty(AREA),
            uncovered: vec![true; 240],
            cursor: None,
            subject: 1,
            version: 0,
            samples: 1.0,
            settled: false,
            parser: vt100::Parser::new(rows, columns, 0),
        };
        fixture.paint(|x, y| [8 * x as u8, 20 * y as u8, 100]);
        fixture
    }

    /// Paints both halves of every picture cell with `color`, the lower half with slightly more
    /// red.
    fn paint(&mut self, color: impl Fn(u16, u16) -> [u8; 3]) {
        for at in PICTURE.positions() {
            let [r, g, b] = color(at.x - PICTURE.x, at.y - PICTURE.y);
            let lower = Color::Rgb(r.saturating_add(9), g, b);
            let style = Style::new().fg(Color::Rgb(r, g, b)).bg(lower);
            self.cells[at].set_symbol("▀").set_style(style);
        }
        self.version += 1;
    }

    fn say(&mut self, row: u16, text: &str) {
        self.cells.set_string(0, row, text, Style::new());
    }

    fn frame(&mut self, now: u64, allowance: FrameBudget) -> (Frame, Vec<u8>) {
        let target = TargetFrame {
            cells: &self.cells,
            cursor: self.cursor,
            picture: PICTURE,
            uncovered: &self.uncovered,
            subject: self.subject,
            version: self.version,
            samples: self.samples,
            settled: self.settled,
        };
        let mut bytes = Vec::new();
        let frame = self.diff.frame(&target, ms(now), allowance, THRESHOLD, &mut bytes);
        self.parser.process(&bytes);
        (frame, bytes)
    }

    /// Returns the number of cells of the picture that the terminal shows exactly.
    fn exact(&self) -> usize {
        PICTURE.positions().filter(|at| self.is_exact(at.x, at.y)).count()
    }

    /// Sends all differences that remain between the screen and the terminal.
    fn finish(&mut self) {
        self.settled = true;
        for i in 0..100 {
            self.frame(100_000 + i, within(20_000));
        }
        assert_eq!((self.exact(), self.diff.pending), (240, Pending::default()));
    }

    fn is_exact(&self, x: u16, y: u16) -> bool {
        let (wanted, cell) = (&self.cells[(x, y)], self.parser.screen().cell(y, x).unwrap());
        let same = |color, wanted| match (color, wanted) {
            (vt100::Color::Rgb(r, g, b), Color::Rgb(x, y, z)) => [r, g, b] == [x, y, z],
            _ => false,
        };
        let [fg, bg] = [cell.fgcolor(), cell.bgcolor()];
        match cell.contents() {
            "▀" => same(fg, wanted.fg) && same(bg, wanted.bg),
            "▄" => same(bg, wanted.fg) && same(fg, wanted.bg),
            " " | "" => same(bg, wanted.fg) && same(bg, wanted.bg),
            _ => false,
        }
    }
}

#[test]
fn unlimited_frame_sends_all_cells() {
    let mut fixture = Fixture::new();
    fixture.say(10, "words");
    let (frame, bytes) = fixture.frame(0, EVERYTHING);
    assert!(frame.picture && bytes.starts_with(b"\x1b[m\x1b[2J"));
    assert_eq!(fixture.exact(), 240);
    assert!(fixture.parser.screen().contents().contains("words"));
    assert_eq!(fixture.diff.pending, Pending::default());
    assert_eq!(fixture.frame(1, EVERYTHING).1, b"");
    // If one cell changes, only this cell is sent.
    fixture.cells[(5, 5)].set_bg(Color::Rgb(1, 2, 3));
    assert!(fixture.frame(2, EVERYTHING).1.len() < 50);
    assert_eq!(fixture.exact(), 240);
    // A change of the screen size clears the terminal.
    fixture.cells = Buffer::empty(Rect { width: 39, ..AREA });
    assert!(fixture.frame(3, EVERYTHING).1.starts_with(b"\x1b[m\x1b[2J"));
}

#[test]
fn text_precedes_picture_within_the_budget() {
    let mut fixture = Fixture::new();
    (9..12).for_each(|row| fixture.say(row, "a line of text of some length"));
    let (frame, bytes) = fixture.frame(0, within(400));
    assert!(bytes.len() <= 400, "{}", bytes.len());
    assert!(frame.picture);
    let text = fixture.parser.screen().contents();
    assert_eq!(text.matches("a line of text of some length").count(), 3);
    assert!(fixture.diff.pending.visible && !fixture.diff.pending.text);
    let mut frames = 1;
    while fixture.diff.pending.visible {
        assert!(fixture.frame(100 * frames, within(400)).1.len() <= 400);
        frames += 1;
        assert!(frames < 100);
    }
    assert!(frames > 5);
    assert!(fixture.exact() > 200);
    fixture.finish();
}

#[test]
fn text_only_budget_sends_no_picture() {
    let mut fixture = Fixture::new();
    fixture.say(10, "words");
    let text_only = FrameBudget { bytes: 1500, picture: false, refinement: 0 };
    let (frame, _) = fixture.frame(0, text_only);
    assert_eq!((frame, fixture.exact()), (Frame::default(), 0));
    assert!(fixture.parser.screen().contents().contains("words"));
    assert!(fixture.diff.pending.visible);
    assert_eq!(fixture.frame(1, text_only).1, b"");
    // Text that does not fit into the budget is sent row by row.
    let long: String = ('a'..='z').chain('0'..='9').collect();
    (9..12).for_each(|row| fixture.say(row, &long));
    let narrow = FrameBudget { bytes: 120, ..text_only };
    for rows in 1..=3 {
        let (_, bytes) = fixture.frame(2, narrow);
        assert!(bytes.len() <= 120, "{}", bytes.len());
        assert_eq!(fixture.parser.screen().contents().matches(&long).count(), rows);
        assert_eq!(fixture.diff.pending.text, rows < 3);
    }
}

#[test]
fn largest_difference_is_sent_first() {
    let mut fixture = Fixture::new();
    fixture.frame(0, EVERYTHING);
    // After a first frame with a budget, three cells change. The budget of the next frame suffices
    // for one of them.
    fixture.samples = 2.0;
    fixture.frame(50, within(20_000));
    for (at, color) in [((3, 3), [24, 90, 90]), ((9, 6), [250, 250, 250]), ((20, 2), [150, 20, 60])]
    {
        let [r, g, b] = color;
        fixture.cells[at].set_bg(Color::Rgb(r, g, b)).set_fg(Color::Rgb(r, g, b));
    }
    fixture.version += 1;
    fixture.samples = 4.0;
    let differing = |fixture: &Fixture| 240 - fixture.exact();
    let before = differing(&fixture);
    assert_eq!(before, 3);
    fixture.frame(100, within(FRAME_OVERHEAD + 45));
    assert_eq!(differing(&fixture), before - 1);
    let parser = &fixture.parser;
    let cell = parser.screen().cell(6, 9).unwrap();
    assert!([cell.fgcolor(), cell.bgcolor()].contains(&vt100::Color::Rgb(250, 250, 250)));
}

#[test]
fn invisible_differences_wait_for_idle_time() {
    let mut fixture = Fixture::new();
    fixture.frame(0, within(20_000));
    assert_eq!(fixture.exact(), 240);
    fixture.paint(|x, y| [8 * x as u8, 20 * y as u8, 101]);
    fixture.samples = 2.0;
    assert_eq!(fixture.frame(100, within(20_000)).1, b"");
    let Pending { visible, hidden, .. } = fixture.diff.pending;
    assert_eq!((visible, hidden), (false, Some(ms(100) + IDLE)));
    // After `IDLE` without a change of the picture, invisible differences are sent in slices of at
    // most half of the byte budget.
    let (frame, bytes) = fixture.frame(2200, within(4000));
    assert!(frame.flushed > 500 && frame.flushed <= 2000 && bytes.len() <= 2000, "{frame:?}");
    // Invisible differences of a settled picture are sent at once, if the budget permits
    // refinement.
    fixture.settled = true;
    assert_eq!(fixture.frame(2300, FrameBudget { refinement: 0, ..within(4000) }).1, b"");
    while fixture.diff.pending.hidden.is_some() {
        assert!(fixture.frame(2400, within(4000)).0.flushed > 0);
    }
    assert_eq!(fixture.exact(), 240);
}

#[test]
fn cells_are_compared_after_enough_new_samples() {
    let mut fixture = Fixture::new();
    fixture.samples = 16.0;
    fixture.frame(0, within(20_000));
    // With only 6 % more samples even a visible difference is not sent, because the next comparison
    // is due after 19 % more (a factor of 2^(1/4)).
    fixture.samples = 17.0;
    fixture.paint(|x, y| [8 * x as u8, 20 * y as u8, 150]);
    assert_eq!(fixture.frame(50, within(20_000)).1, b"");
    assert!(!fixture.diff.pending.visible);
    fixture.samples = 20.0;
    fixture.frame(100, within(20_000));
    assert_eq!(fixture.exact(), 240);
    // A new number in `subject` means a new picture, which is compared and sent at once.
    fixture.subject += 1;
    fixture.samples = 1.0;
    fixture.paint(|x, y| [8 * x as u8, 20 * y as u8, 250]);
    fixture.frame(150, within(20_000));
    assert_eq!(fixture.exact(), 240);
}

#[test]
fn new_picture_appears_as_mosaic_first() {
    let mut fixture = Fixture::new();
    fixture.frame(0, within(20_000));
    fixture.subject += 1;
    fixture.paint(|x, y| [255 - 8 * x as u8, 200 - 20 * y as u8, 20]);
    let (_, bytes) = fixture.frame(50, within(1200));
    assert!(bytes.len() <= 1200, "{}", bytes.len());
    // Every cell has nearly the target's colour, although not exactly.
    for at in PICTURE.positions() {
        let cell = fixture.parser.screen().cell(at.y, at.x).unwrap();
        let vt100::Color::Rgb(r, ..) = cell.bgcolor() else { panic!("{at} has no colour") };
        let wanted = 255 - 8 * (at.x - PICTURE.x) as i32;
        assert!((i32::from(r) - wanted).abs() < 90, "{at}: {r} for {wanted}");
    }
    assert!(fixture.diff.pending.visible);
    fixture.finish();
}

#[test]
fn uncovered_picture_is_sent_again() {
    let mut fixture = Fixture::new();
    fixture.frame(0, within(20_000));
    let before = fixture.cells.clone();
    for (row, range) in [(3, 35..50), (4, 65..80)] {
        fixture.say(row, "       overlay      ");
        range.for_each(|at| fixture.uncovered[at] = false);
    }
    // `uncovered` becomes `false` for exactly the cells of the text: columns 0 to 17 of the
    // picture's rows 2 and 3.
    let mask: Vec<_> = (0..240).map(|at| !(2..4).contains(&(at / 30)) || at % 30 >= 18).collect();
    fixture.uncovered = mask;
    fixture.frame(50, within(20_000));
    assert!(fixture.parser.screen().contents().contains("overlay"));
    fixture.cells = before;
    fixture.uncovered = vec![true; 240];
    fixture.frame(100, within(20_000));
    assert!(!fixture.parser.screen().contents().contains("overlay"));
    assert_eq!(fixture.exact(), 240);
}

#[test]
fn cursor_is_hidden_during_a_frame() {
    let mut fixture = Fixture::new();
    fixture.cursor = Some(Position { x: 7, y: 10 });
    let (_, bytes) = fixture.frame(0, EVERYTHING);
    assert!(bytes.ends_with(b"\x1b[?25h"));
    assert_eq!(fixture.parser.screen().cursor_position(), (10, 7));
    assert_eq!(fixture.frame(1, EVERYTHING).1, b"", "nothing has changed");
    fixture.say(10, "typed");
    let (_, bytes) = fixture.frame(2, within(500));
    assert!(bytes.starts_with(b"\x1b[?25l") && bytes.ends_with(b"\x1b[?25h"));
    fixture.cursor = None;
    assert_eq!(fixture.frame(3, EVERYTHING).1, b"\x1b[?25l");
    assert_eq!(fixture.frame(4, EVERYTHING).1, b"");
}

#[test]
fn wide_characters_are_sent_whole() {
    let mut fixture = Fixture::new();
    for (now, text) in ["漢字 and more", "a漢", "漢a", "plain"].into_iter().enumerate() {
        fixture.cells.set_string(0, 10, " ".repeat(40), Style::new());
        fixture.say(10, text);
        fixture.frame(100 * now as u64, within(20_000));
        let screen = fixture.parser.screen();
        assert_eq!(screen.contents_between(10, 0, 10, 40).trim_end(), text);
    }
}
